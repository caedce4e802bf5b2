"""A signal at several resolutions: fed blocks, read at any zoom, live and from disk."""

from __future__ import annotations

import numpy as np

from tactile_lab.trace import Trace, follows_late

BRANCH = 16
"""Cells joined into one on the next level."""

FINE = 1 << 17
"""Newest cells kept on the finest level."""

COARSE = 1 << 16
"""Newest cells kept on each coarser level."""

SMALL = 4096
"""Cells up to which a level has none above it: so many are thinned in no time."""

PARTS = 4
"""Closer looks kept: that of the lanes, those around the cursors, and the last one."""

WAITING = 1 << 10
"""Cells of the finest level that may wait to be joined until a coarser one is read."""

ROOM = 1 << 12
"""Room beyond twice what is held, cells: to zero all at once takes a frame."""


class Level:
    """The newest cells of one width, as they come.

    Args:
        keep: how many cells are kept; there is room for a quarter more.
        signal: of the traces it gives.

    Attributes:
        width: of a cell, s; 0 before the first.
        end: of the newest cell, s; 0 without one.
        count: cells added so far, forgotten ones included.
    """

    def __init__(self, keep: int, signal: str = "") -> None:
        self.width = 0.0
        self.end = 0.0
        self._signal = signal
        self.count = 0
        self._keep = keep
        self._first, self._last = 0, 0
        self._values = np.empty((4, 0))
        self._gap = np.empty(0, np.bool_)

    def __len__(self) -> int:
        return self._last - self._first

    @property
    def forgotten(self) -> int:
        """Cells that are no longer kept."""
        return self.count - len(self)

    @property
    def start(self) -> float:
        """Time of the oldest cell that is kept, s; 0 without one."""
        return float(self._values[0, self._first]) if len(self) else 0.0

    def add(self, cells: Trace, gap: bool | None = None) -> None:
        """Append cells; `gap`: whether one is before them, None: as their time says."""
        if cells.empty:
            return
        if gap is None:
            gap = len(self) == 0 or follows_late(self.end, cells)
        self.width = cells.width
        more = cells[-self._keep :] if len(cells) > self._keep else cells
        self.count += len(cells) - len(more)
        self._make_room(len(more))
        place = slice(self._last, self._last + len(more))
        for row, part in enumerate((more.time, more.low, more.high, more.mean)):
            self._values[row, place] = part
        self._gap[place] = more.gap
        self._gap[self._last] = gap
        self._last += len(more)
        self.count += len(more)
        self.end = more.end
        self._first = max(self._first, self._last - self._keep)

    def drop_last(self) -> None:
        """Take the newest cell back."""
        self._last -= 1
        self.count -= 1

    def since(self, number: int = 0) -> Trace:
        """Cells from number `number` on, as far as they are kept."""
        return self._cells(self._first + max(0, number - self.forgotten), self._last)

    def around(self, start: float, end: float) -> Trace:
        """What a picture of [start, end] s needs: one more cell on either side."""
        time = self._values[0, self._first : self._last]
        first, last = (self._first + time.searchsorted((start, end))).tolist()
        return self._cells(max(self._first, first - 1), min(last + 1, self._last))

    def _cells(self, first: int, last: int) -> Trace:
        time, low, high, mean = self._values[:, first:last]
        gap = self._gap[first:last]
        if gap.size and not gap[0]:
            gap = gap.copy()
            gap[0] = True
        return Trace(time, low, high, mean, gap, self.width, self._signal)

    def has_gap(self, number: int) -> bool:
        """Whether there is a gap before cell `number`, which is kept."""
        return bool(self._gap[self._first + number - self.forgotten])

    def _make_room(self, more: int) -> None:
        """Have room for `more` cells; what a trace still shows is never overwritten.

        The first to come get what they need: they may be all.
        """
        if self._last + more <= self._gap.size:
            return
        kept = slice(max(self._first, self._last + more - self._keep), self._last)
        held = kept.stop - kept.start
        grown = 2 * (held + more) + ROOM if held else more
        size = min(grown, self._keep + self._keep // 4)
        values, gap = np.empty((4, size)), np.empty(size, np.bool_)
        values[:, :held], gap[:held] = self._values[:, kept], self._gap[kept]
        self._values, self._gap = values, gap
        self._first, self._last = 0, held


class Pyramid:
    """One signal, kept small enough for ever, with closer looks at parts of it.

    The finest level has the newest `FINE` cells as they came. Each level above it has
    cells sixteen times as long, and so reaches sixteen times as far back; memory hardly
    grows between a minute and a day. What is finer than the finest level, or no longer
    kept, may be read or computed elsewhere and put in by `refine`.
    """

    def __init__(self) -> None:
        self._levels = [Level(FINE)]
        self._open: list[int] = [0]
        self._waiting = 0
        self._parts: tuple[tuple[float, float, Trace], ...] = ()

    @classmethod
    def of(cls, whole: Trace) -> Pyramid:
        """A signal that is known already."""
        made = cls()
        made.add(whole)
        return made

    def add(self, cells: Trace) -> None:
        """Append cells of the finest level that follow those before."""
        self._levels[0].add(cells)
        self._waiting += len(cells)
        if self._waiting >= WAITING:
            self._join()

    def _join(self) -> None:
        """Bring all levels up to the finest."""
        if not self._waiting:
            return
        self._waiting = 0
        for above in range(1, len(self._levels)):
            self._carry_up(above)
        while len(self._levels[-1]) > SMALL:
            self._levels.append(Level(COARSE))
            self._open.append(0)
            self._carry_up(len(self._levels) - 1)

    @property
    def width(self) -> float:
        """Of a cell of the finest level, s."""
        return self._levels[0].width

    @property
    def start(self) -> float:
        """Time from which on there are cells, s; 0 without any."""
        return self._levels[-1].start

    @property
    def end(self) -> float:
        """Time up to which there are cells, s; 0 without any."""
        return self._levels[0].end

    def newest(self, cells: int) -> Trace:
        """The newest cells of the finest level."""
        level = self._levels[0]
        return level.since(level.count - cells)

    def between(self, start: float, end: float, count: int) -> Trace:
        """What lies in [start, end] s in about `count` cells."""
        if self.coarse(start, end, count) and (part := self._part(start, end)):
            return part.around(start, end).thin(count)
        level = self._levels[0]
        known = not level.forgotten or start >= level.start
        if not known or end - start >= 2 * count * BRANCH * level.width:
            self._join()
        for above in self._levels[1:]:
            known = not level.forgotten or start >= level.start
            if known and end - start < 2 * count * above.width:
                break
            level = above
        return level.around(start, end).thin(count)

    # --- closer looks

    def coarse(self, start: float, end: float, count: int) -> bool:
        """Whether a closer look would show more of [start, end] s in `count` cells."""
        return end - start < count * self.width

    def wants(self, start: float, end: float, count: int) -> bool:
        """Whether [start, end] s in `count` cells needs a closer look than it has."""
        if not self.coarse(start, end, count) or start >= self.end or end <= self.start:
            return False
        part = self._part(start, end)
        if part is None:
            return True
        # in one that is flat there is nothing more to be seen
        return not part.flat and part.width > (end - start) / count

    def refine(self, start: float, end: float, part: Trace) -> None:
        """Put in a closer look at [start, end] s."""
        self._parts = ((start, end, part), *self._parts)[:PARTS]

    def _part(self, start: float, end: float) -> Trace | None:
        """The closest look at [start, end] s."""
        start, end = max(start, self.start), min(end, self.end)
        having = [part for a, b, part in self._parts if a <= start and end <= b]
        return min(having, key=lambda part: part.width, default=None)

    def _carry_up(self, number: int) -> None:
        """Bring a level up to what the one below it has.

        Its last cell may be a part of one until more has come.
        """
        level, finer = self._levels[number], self._levels[number - 1]
        fresh = finer.since(self._open[number])
        first = finer.count - len(fresh)
        if len(level):
            level.drop_last()
        level.add(fresh.merge(BRANCH, -first % BRANCH), finer.has_gap(first))
        begun = np.searchsorted(fresh.time, level.since(level.count - 1).time[0])
        self._open[number] = first + int(begun)
