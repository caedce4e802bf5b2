"""What the window of a skin shows: spikes of an array, as they come or from disk."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.skin.events import EVENT, Events
from tactile_lab.skin.kernel import STUCK

DOTS = 40_000
"""Most dots of the raster; of more spikes every second, every fourth, ... is drawn."""
STRETCHES = 40
"""Parts of the duration: the map shows one of them, the fullest sets its scale."""
PIXELS = 600
"""Most pixels of the map along a side."""
ACROSS = 8
"""Pixels from a taxel to its nearest neighbour, if the map's size allows."""
STEP = 1 << 20
"""Events that are read at once."""


class Dots:
    """A sample of all spikes, evenly thinned as more come.

    Attributes:
        every: one of so many spikes is kept.
        seen: spikes taken so far.
    """

    def __init__(self) -> None:
        self.every, self.seen = 1, 0
        self._kept = np.empty(0, EVENT)

    def add(self, time: FloatArray, taxel: NDArray[np.integer]) -> None:
        """Take further spikes."""
        part = slice(-self.seen % self.every, None, self.every)
        more = np.empty(time[part].size, EVENT)
        more["time"], more["taxel"] = time[part], taxel[part]
        self.seen += time.size
        self._kept = np.concatenate([self._kept, more])
        while self._kept.size > DOTS:
            self._kept, self.every = self._kept[::2], 2 * self.every

    @property
    def points(self) -> tuple[FloatArray, FloatArray]:
        """Times, s, and numbers of taxels."""
        return self._kept["time"], self._kept["taxel"].astype(float)


class Film:
    """The spikes of an array on disk, read as they are looked at.

    Attributes:
        stretch: time that one picture tells of, s.
        most: spikes of the fullest taxel in a stretch, of those that are not stuck.
        dots: for the raster.
    """

    def __init__(self, events: Events) -> None:
        self.events = events
        self.stretch = events.duration / STRETCHES
        self.dots, self.most = Dots(), 1
        self._size = events.places.shape[0]
        total, free = events.time.shape[0], events.role != STUCK
        open_, count = 0, np.zeros(self._size, np.int64)
        for first in range(0, total, STEP):
            time = events.time[first : first + STEP]
            taxel = events.taxel[first : first + STEP]
            self.dots.add(time, taxel)
            number = (time / self.stretch).astype(int)
            for stretch in np.unique(number):
                if stretch != open_:
                    open_, count = stretch, np.zeros(self._size, np.int64)
                count += np.bincount(taxel[number == stretch], minlength=self._size)
                self.most = max(self.most, int(count[free].max(initial=0)))

    def counts(self, at: float) -> NDArray[np.int64]:
        """Spikes of each taxel in the stretch before `at` s."""
        time = self.events.time
        first, last = (_first(time, t) for t in (at - self.stretch, at))
        return np.bincount(self.events.taxel[first:last], minlength=self._size)


def _first(time: FloatArray, at: float) -> int:
    """Number of the first of ascending times on disk that is not before `at`, s."""
    low, high = 0, time.shape[0]
    while high - low > STEP:
        middle = (low + high) // 2
        low, high = (middle, high) if time[middle] < at else (low, middle)
    return low + int(np.searchsorted(time[low:high], at))


def pixels(places: FloatArray, side: float) -> tuple[NDArray[np.int64], FloatArray]:
    """Which taxel each pixel of a map shows.

    Args:
        places: of the taxels' centres, shape (n, 2), m.
        side: of a taxel, m.

    Returns:
        Taxel, or -1 beside them all, shape (columns, rows) from the lower left; and
        left, bottom, width and height of the map, m.
    """
    low, high = places.min(axis=0) - side / 2, places.max(axis=0) + side / 2
    one = max(side / ACROSS, float((high - low).max()) / PIXELS)
    shape = np.maximum(1, np.ceil((high - low) / one - 1e-6).astype(int))
    found = np.full(shape, -1)
    begin = np.rint((places - side / 2 - low) / one).astype(int)
    width = max(1, round(side / one))
    for dx in range(width):
        for dy in range(width):
            at = np.minimum(begin + np.array([dx, dy]), shape - 1)
            found[at[:, 0], at[:, 1]] = np.arange(len(places))
    return found, np.array([*low, *(shape * one)])
