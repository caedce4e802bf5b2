"""How well the samples date what a source played by its own clock."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tactile_lab.analysis.delay import delay
from tactile_lab.analysis.estimate import Z95
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.lag import Lag
from tactile_lab.store.shunt import BIN_TIME, Shunt
from tactile_lab.waveform import Waveform

REST = 0.1
"""Points further apart, s, are of movements of their own."""
AROUND = 0.01
"""So much before and after a movement is looked at, and ten times L/R more, s."""


def list_timing(
    steps: FloatArray,
    listed: NDArray[np.bool_],
    shunt: Shunt,
    coil_lag: float,
    visible: float,
) -> float | None:
    """Half of the 95 % band of when points of lists came, s; None where none is seen.

    Each movement by itself is compared with the shunt: how much later that shows it
    than its points say, and how well, is how well they are dated.

    Args:
        steps: shape (n, 2): from that time on, s, the source gives this current, A.
        listed: shape (n,): which of them are points of lists.
        shunt: the recorded coil current.
        coil_lag: L/R of the coil, s.
        visible: smallest movement that the shunt shows, A.
    """
    off = []
    for first, last in _movements(steps[:, 0], listed):
        part = steps[max(first - 1, 0) : last + 1]
        if np.ptp(part[:, 1]) < visible:
            continue
        begin = float(steps[first, 0]) - AROUND
        end = float(steps[last, 0]) + AROUND + 10 * coil_lag
        if last + 1 < len(steps):  # of which this tells nothing
            end = min(end, float(steps[last + 1, 0]) - BIN_TIME)
        stairs = part.copy()
        stairs[0, 0] = min(begin, float(stairs[0, 0]))
        flow, _ = Lag(coil=coil_lag).follow(Waveform.stairs(stairs, end))
        middle, seen = shunt(begin, end)
        if middle.size < 2:
            continue
        width = float(np.median(np.diff(middle)))
        try:
            found = delay(flow, middle - width / 2, width, seen)
        except NotIdentifiableError:
            continue
        off.append((Z95 * found.value) ** 2 + found.half**2)
    return math.sqrt(sum(off) / len(off)) if off else None


def _movements(
    time: FloatArray, listed: NDArray[np.bool_]
) -> Iterator[tuple[int, int]]:
    """First and last of the points of each movement."""
    points = np.flatnonzero(listed)
    apart = (np.diff(points) > 1) | (np.diff(time[points]) > REST)
    for part in np.split(points, np.flatnonzero(apart) + 1):
        if part.size:
            yield int(part[0]), int(part[-1])
