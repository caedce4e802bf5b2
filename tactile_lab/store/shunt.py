"""The recorded coil current, as steps and lists are looked for in it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from tactile_lab.arrays import FloatArray

if TYPE_CHECKING:
    from tactile_lab.store.signal import StoredSignal

Shunt = Callable[[float, float], tuple[FloatArray, FloatArray]]
"""The coil current between two times, s: its bins' middles, s, and means, A."""

BIN_TIME = 5e-4
"""Bins of the shunt that edges are looked for in, s, where samples are as near."""

MOST_BINS = 1000
"""Bins read at once: of a longer stretch only the mean is asked for."""


def shunt_of(signal: StoredSignal, overrange: FloatArray) -> Shunt:
    """Reads the recorded coil current between two times.

    Args:
        signal: the coil current.
        overrange: shape (n, 2): between which times, s, its channel left its range:
            from these it gives nothing.
    """
    begins, ends = overrange.T

    def seen(start: float, end: float) -> tuple[FloatArray, FloatArray]:
        if np.any((begins < end) & (ends > start)):
            return np.empty(0), np.empty(0)
        part = signal.between(start, end)
        # as fine as edges are looked for in; a long level is read from the pyramid
        wanted = round((part.stop - part.start) * signal.interval / BIN_TIME)
        found = signal.trace(
            part.start, part.stop, cells=min(max(1, wanted), MOST_BINS)
        )
        # the last may be short; a sample is of an instant, the first of its bin's
        middle = (found.width - signal.interval) / 2
        return found.time[:-1] + middle, found.mean[:-1]

    return seen
