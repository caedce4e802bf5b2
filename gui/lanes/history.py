"""What was measured in this run, kept small enough for ever.

The newest `FINE` bins stay at full resolution; the whole run stays at a resolution
that halves each time `COARSE` bins are full. Memory is the same after a minute and
after a day.
"""

from __future__ import annotations

import numpy as np

from gui.lanes.decimate import Drawn, FloatArray, cut, line_between, stepped
from tactile_lab.acquisition.live import Bins

FINE = 1 << 17
COARSE = 1 << 15
FIRST = 1 << 12
"""Bins there is room for at first: zeroing memory for all at once takes a frame."""


class Track:
    """One signal's least, largest and mean value against time."""

    def __init__(self) -> None:
        self._fine = np.empty((4, FIRST))
        self._fine_from = 0
        self._fine_to = 0
        self._width = 0.0
        self._coarse = np.empty((4, COARSE))
        self._coarse_to = 0
        self._per = 1
        self._open: list[FloatArray] = []
        self._open_bins = 0
        self.mean = float("nan")

    @property
    def end(self) -> float:
        """Time up to which there are bins, s; 0 without any."""
        if self._fine_to == self._fine_from:
            return 0.0
        return float(self._fine[0, self._fine_to - 1]) + self._width

    def add(self, bins: Bins) -> None:
        """Append bins that follow those before."""
        count = bins.time.size
        if count == 0:
            return
        self._width = bins.width
        self.mean = float(bins.mean[-min(count, 50) :].mean())
        rows = np.array([bins.time, bins.low, bins.high, bins.mean], dtype=np.float64)
        rows = rows[:, -FINE:]
        count = rows.shape[1]
        self._make_room(self._fine_to + count)
        if self._fine_to + count > self._fine.shape[1]:
            oldest = max(self._fine_from, self._fine_to + count - FINE)
            kept = self._fine[:, oldest : self._fine_to].copy()
            self._fine[:, : kept.shape[1]] = kept
            self._fine_from, self._fine_to = 0, kept.shape[1]
        self._fine[:, self._fine_to : self._fine_to + count] = rows
        self._fine_to += count
        self._fine_from = max(self._fine_from, self._fine_to - FINE)
        self._coarsen(rows)

    def _make_room(self, wanted: int) -> None:
        """Have room for `wanted` bins, at most for twice `FINE`."""
        size = self._fine.shape[1]
        if size < min(wanted, 2 * FINE):
            wider = np.empty((4, min(max(2 * size, wanted), 2 * FINE)))
            wider[:, : self._fine_to] = self._fine[:, : self._fine_to]
            self._fine = wider

    def between(self, start: float, end: float, count: int) -> Drawn:
        """What lies in [start, end] s in at most about `count` columns."""
        fine = self._fine[:, self._fine_from : self._fine_to]
        if fine.shape[1] == 0:
            return Drawn.nothing()
        if start >= fine[0, 0] or self._coarse_to == 0:
            return cut(fine, self._width, start, end, count)
        coarse = self._coarse[:, : self._coarse_to]
        return cut(coarse, self._width * self._per, start, end, count)

    def _coarsen(self, rows: FloatArray) -> None:
        """Add to the whole-run picture; halve its resolution when it is full."""
        self._open.append(rows)
        self._open_bins += rows.shape[1]
        if self._open_bins < self._per:
            return
        waiting = np.concatenate(self._open, axis=1)
        whole = waiting.shape[1] // self._per
        cells = waiting[:, : whole * self._per].reshape(4, whole, self._per)
        rest = waiting[:, whole * self._per :].copy()
        self._open, self._open_bins = [rest], rest.shape[1]
        made = np.array(
            [
                cells[0, :, 0],
                cells[1].min(axis=1),
                cells[2].max(axis=1),
                cells[3].mean(axis=1),
            ]
        )
        while self._coarse_to + made.shape[1] > COARSE:
            self._halve()
            made = _halved(made)
        self._coarse[:, self._coarse_to : self._coarse_to + made.shape[1]] = made
        self._coarse_to += made.shape[1]

    def _halve(self) -> None:
        kept = _halved(self._coarse[:, : self._coarse_to])
        self._coarse[:, : kept.shape[1]] = kept
        self._coarse_to = kept.shape[1]
        self._per *= 2


def _halved(rows: FloatArray) -> FloatArray:
    """Pairs of bins as one; an odd last one stays alone."""
    even = rows[:, 0::2].copy()
    odd = rows[:, 1::2]
    n = odd.shape[1]
    even[1, :n] = np.minimum(even[1, :n], odd[1])
    even[2, :n] = np.maximum(even[2, :n], odd[2])
    even[3, :n] = (even[3, :n] + odd[3]) / 2
    return even


class SlowTrack:
    """A value read now and then: a line through its readings."""

    def __init__(self) -> None:
        self._rows = np.empty((2, 4096))
        self._count = 0

    @property
    def end(self) -> float:
        """Time of the last reading, s; 0 without one."""
        return float(self._rows[0, self._count - 1]) if self._count else 0.0

    @property
    def last(self) -> float | None:
        """The last reading."""
        return float(self._rows[1, self._count - 1]) if self._count else None

    def add(self, time: float, value: float) -> None:
        """Append a reading; past 2e5 of them every other older one is dropped."""
        if self._count == self._rows.shape[1]:
            if self._count >= 200_000:
                half = self._rows[:, : self._count : 2].copy()
                self._rows[:, : half.shape[1]] = half
                self._count = half.shape[1]
            else:
                self._rows = np.concatenate([self._rows, np.empty_like(self._rows)], 1)
        self._rows[:, self._count] = time, value
        self._count += 1

    def between(
        self, start: float, end: float, count: int, hold: float | None = None
    ) -> Drawn:
        """A line through the readings around [start, end] s.

        With `hold`, each reading holds until the next and the last until `hold` s.
        """
        first = np.searchsorted(self._rows[0, : self._count], start)
        time, value = self._rows[:, max(0, int(first) - 1) : self._count]
        if hold is not None:
            time, value = stepped(time, value, hold)
        return line_between(time, value, start, end, count)
