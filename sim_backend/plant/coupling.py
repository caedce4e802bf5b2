"""AC coupling of a scope input: what the capacitor holds back."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from sim_backend.plant.pieces import Pieces
from tactile_lab.arrays import FloatArray

CUTOFF = 1.0
"""Frequency of the high-pass, Hz."""
GRID = 1e-3
"""Distance of the points between which the capacitor's voltage is straight, s."""
_KEPT = 1000


class Capacitor:
    """Voltage of the coupling capacitor since an acquisition began.

    It is charged to the signal at the begin. Its voltage is followed on a grid of its
    own, from the signal at each grid point alone, so that blocks do not matter.

    Args:
        started: begin of the acquisition, s.
    """

    def __init__(self, started: float) -> None:
        self._started = started
        self._first = 0
        self._value: list[float] = []
        self._slope: list[float] = []

    def passed(
        self, signal: Callable[[float, float], Pieces], start: float, end: float
    ) -> Pieces:
        """The signal over [start, end) less what the capacitor holds.

        Args:
            signal: the coupled signal over [start, end).
            start: s, not before what was asked for long ago.
            end: s.
        """
        known = self._first + len(self._value)
        last = max(math.ceil((end - self._started) / GRID), 1)
        if known < last:
            begin = self._started + known * GRID
            self._charge(signal(begin, max(end, begin + GRID)), known, last)
        index = np.arange(self._first, self._first + len(self._value), dtype=np.float64)
        grid = self._started + GRID * index
        held = Pieces(grid, np.array(self._value), np.array(self._slope))
        return minus(signal(start, end), held.between(start, end))

    def _charge(self, signal: Pieces, known: int, last: int) -> None:
        for k in range(known, last):
            time = self._started + k * GRID
            level = signal.at(time)
            if self._value:
                held = self._value[-1] + GRID * self._slope[-1]
            else:
                held = level
            self._value.append(held)
            self._slope.append((level - held) * 2 * math.pi * CUTOFF)
        surplus = len(self._value) - _KEPT - (last - known)
        if surplus > 0:
            del self._value[:surplus], self._slope[:surplus]
            self._first += surplus


def minus(one: Pieces, other: Pieces) -> Pieces:
    """`one` less `other`, from where both are known."""
    start = np.union1d(one.start, other.start)
    start = start[start >= max(one.start[0], other.start[0])]
    left, right = _at(one, start), _at(other, start)
    return Pieces(start, left[0] - right[0], left[1] - right[1])


def _at(pieces: Pieces, start: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Value and slope of the pieces at `start`."""
    i = pieces.start.searchsorted(start, side="right") - 1
    slope = pieces.slope[i]
    return pieces.value[i] + (start - pieces.start[i]) * slope, slope
