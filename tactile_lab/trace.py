"""A signal against time, at any resolution: what is read, thinned, drawn and compared.

A `Trace` is a row of cells. A cell is a bin of many samples, a single sample, or a
corner of a line; it holds the least, the largest and the mean value of the signal from
its time on.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray

Flags = NDArray[np.bool_]

HOLDS = 0.01
"""How long the last value of a record is good for at least, s."""

WIDER = 1.5
"""How many times as wide as the own the cells of another trace are called wider."""


@dataclass(frozen=True, eq=False)
class Trace:
    """One signal over a stretch of time.

    Every operation gives a new trace; arrays may be shared, so they are only read.
    Invariants: all arrays have one length; `time` ascends; `low` <= `mean` <= `high`
    (up to rounding); the first cell begins a stretch, so `gap[0]` is true.

    Attributes:
        time: shape (n,), start of each cell, s on the run's axis.
        low, high: shape (n,), extremes in each cell, in `unit`; equal where a cell
            holds one value.
        mean: shape (n,), mean of each cell, in `unit`.
        gap: shape (n,), whether nothing is known of the time just before a cell: no
            line is drawn to it, no value read there.
        width: length of a whole cell, s; 0 for corners of a line.
        signal: a name of `tactile_lab.signals`; "" where the user of it knows.
        unit: SI unit unless scaled; "" where the user of it knows.
    """

    time: FloatArray
    low: FloatArray
    high: FloatArray
    mean: FloatArray
    gap: Flags
    width: float = 0.0
    signal: str = ""
    unit: str = ""

    @classmethod
    def nothing(cls, signal: str = "", unit: str = "") -> Trace:
        """No cells."""
        none = np.empty(0)
        return cls(none, none, none, none, np.empty(0, np.bool_), 0.0, signal, unit)

    @classmethod
    def line(
        cls,
        time: FloatArray,
        value: FloatArray,
        gap: Flags | None = None,
        *,
        signal: str = "",
        unit: str = "",
    ) -> Trace:
        """A line through points, broken before those in `gap`; unbroken without it."""
        gap = np.zeros(time.size, np.bool_) if gap is None else gap.copy()
        gap[:1] = True
        return cls(time, value, value, value, gap, 0.0, signal, unit)

    @classmethod
    def steps(cls, time: FloatArray, value: FloatArray, until: float) -> Trace:
        """A line on which each value holds until the next, the last until `until` s."""
        if time.size:
            ends = np.append(time[1:], max(until, float(time[-1])))
            time = np.column_stack([time, ends]).ravel()
        return cls.line(time, np.repeat(value, 2))

    @classmethod
    def bins(
        cls,
        time: FloatArray,
        low: NDArray[Any],
        high: NDArray[Any],
        mean: NDArray[Any],
        width: float,
        *,
        signal: str = "",
        unit: str = "",
    ) -> Trace:
        """Bins of `width` s; where more than half of one is missing there is a gap."""
        gap = np.ones(time.size, np.bool_)
        gap[1:] = np.diff(time) > 1.5 * width
        low, high, mean = (np.asarray(v, np.float64) for v in (low, high, mean))
        return cls(time, low, high, mean, gap, width, signal, unit)

    def __len__(self) -> int:
        return self.time.size

    @property
    def empty(self) -> bool:
        """Whether there are no cells."""
        return self.time.size == 0

    @property
    def end(self) -> float:
        """End of the last cell, s; 0 without one."""
        return float(self.time[-1]) + self.width if self.time.size else 0.0

    @cached_property
    def flat(self) -> bool:
        """Whether each cell holds one value; also without cells."""
        return self.low is self.high or bool((self.low == self.high).all())

    @property
    def extent(self) -> tuple[float, float] | None:
        """Least and largest value; None without cells."""
        if self.empty:
            return None
        return float(self.low.min()), float(self.high.max())

    @cached_property
    def step(self) -> float:
        """Usual time from one cell to the next, s; 0 below two points of a line."""
        return self.width or middle(np.diff(self.time))

    # --- values at times

    def at(self, time: float) -> float | None:
        """The mean at a time, s, on the line through the cells; None in a gap.

        The last cell before a gap or the end holds for two steps; the last of all for
        `HOLDS` at least, for a record may end so much before its run.
        """
        after = int(np.searchsorted(self.time, time, side="right"))
        if after == 0:
            return None
        if after == self.time.size or self.gap[after]:
            late = time - float(self.time[after - 1])
            least = HOLDS if after == self.time.size else 0.0
            if late > max(2 * self.step, least):
                return None
            return float(self.mean[after - 1])
        return float(np.interp(time, self.time, self.mean))

    def on(self, grid: FloatArray) -> FloatArray:
        """Means at the times in `grid`, s; NaN outside the trace and in its gaps."""
        if self.empty:
            return np.full(grid.size, np.nan)
        after = np.searchsorted(self.time, grid, side="right")
        beyond = grid > self.time[-1]
        within = np.minimum(after, self.time.size - 1)
        missing = (after == 0) | beyond | (self.gap[within] & (grid < self.time[-1]))
        return np.where(missing, np.nan, np.interp(grid, self.time, self.mean))

    # --- parts

    def __getitem__(self, cells: slice) -> Trace:
        """Some of the cells, with no step between."""
        gap = self.gap[cells]
        if gap.size and not gap[0]:
            gap = gap.copy()
            gap[0] = True
        return Trace(
            self.time[cells],
            self.low[cells],
            self.high[cells],
            self.mean[cells],
            gap,
            self.width,
            self.signal,
            self.unit,
        )

    def cut(self, start: float, end: float) -> Trace:
        """The cells that begin in [start, end) s."""
        first, last = np.searchsorted(self.time, [start, end])
        return self[first:last]

    def around(self, start: float, end: float) -> Trace:
        """What a picture of [start, end] s needs: one more cell on either side."""
        first, last = self.time.searchsorted((start, end)).tolist()
        return self[max(0, first - 1) : last + 1]

    def join(self, other: Trace) -> Trace:
        """This trace, then another that begins where this one ends, or later.

        There is a gap between them where more than half a cell is missing, and between
        lines: nobody says how long their points are good.
        """
        if self.empty:
            return other
        if other.empty:
            return self
        both = (self, other)
        gap = np.concatenate([one.gap for one in both])
        gap[self.time.size] = follows_late(self.end, other)
        return replace(
            self,
            time=np.concatenate([one.time for one in both]),
            low=np.concatenate([one.low for one in both]),
            high=np.concatenate([one.high for one in both]),
            mean=np.concatenate([one.mean for one in both]),
            gap=gap,
            width=self.width if self.width == other.width else 0.0,
        )

    # --- coarser, scaled, shifted

    def thin(self, count: int) -> Trace:
        """About `count` cells (above 0), extremes and means kept.

        Edges lie on a grid of absolute time: cells do not wander as a view scrolls. A
        line keeps its corners up to four times `count`.
        """
        size = self.time.size
        if size <= (count if self.width else 4 * count):
            return self
        per = -(-size // count)
        number = round(float(self.time[0]) / self.width) if self.width else 0
        return self.merge(per, (-number) % per)

    def corners(self, count: int) -> Trace:
        """A line's first, least, largest and last corner in each of `count` columns.

        Drawn as many px wide, it looks as the whole does: a pause between bursts of
        corners stays one, where `thin` would join it to the mean of a burst.
        """
        if self.time.size <= 4 * count:
            return self
        width = (float(self.time[-1]) - float(self.time[0])) / count or 1.0
        column = np.floor(self.time / width)
        first = np.flatnonzero(np.diff(column, prepend=-np.inf))
        last = np.append(first[1:], self.time.size) - 1
        least = np.lexsort((self.low, column))[first]
        largest = np.lexsort((self.high, column))[last]
        broken = np.flatnonzero(self.gap)
        parts = (first, least, largest, last, broken, np.maximum(broken - 1, 0))
        kept = np.unique(np.concatenate(parts))
        low, high, mean = self.low[kept], self.high[kept], self.mean[kept]
        return replace(
            self, time=self.time[kept], low=low, high=high, mean=mean,
            gap=self.gap[kept],
        )  # fmt: skip

    def merge(self, per: int, first: int = 0) -> Trace:
        """Every `per` cells as one.

        A gap begins a new one if it is as long; a shorter one is lost within it. In a
        line every gap does.

        Args:
            per: cells joined into one.
            first: cells joined into the first one; 0: as many as in the others.
        """
        if per <= 1 or self.empty:
            return self
        edges = np.arange(first or per, self.time.size, per)
        edges = np.concatenate([(0,), edges, (self.time.size,)])
        breaks = self.gap.nonzero()[0][1:]
        if self.width:
            missing = self.time[breaks] - self.time[breaks - 1] - self.width
            breaks = breaks[missing > (per - 0.5) * self.width]
        if breaks.size:
            edges = np.union1d(edges, breaks)
        edges, counts = edges[:-1], edges[1:] - edges[:-1]
        low = np.minimum.reduceat(self.low, edges)
        high = np.maximum.reduceat(self.high, edges)
        mean = np.add.reduceat(self.mean, edges) / counts
        time, gap, width = self.time[edges], self.gap[edges], per * self.width
        return Trace(time, low, high, mean, gap, width, self.signal, self.unit)

    def scaled(self, by: float, unit: str = "") -> Trace:
        """All values `by` times as large, `by` above 0; in another unit."""
        if by == 1.0 or self.empty:
            return self
        low, high, mean = self.low * by, self.high * by, self.mean * by
        time, gap, unit = self.time, self.gap, unit or self.unit
        return Trace(time, low, high, mean, gap, self.width, self.signal, unit)

    def shifted(self, by: float) -> Trace:
        """`by` s later."""
        return replace(self, time=self.time + by) if by else self

    def means(self) -> Trace:
        """The line of means, without extremes."""
        time, mean, gap = self.time, self.mean, self.gap
        return Trace(time, mean, mean, mean, gap, self.width, self.signal, self.unit)

    # --- differences

    def residual(self, model: Trace) -> Trace:
        """This less the model, at the times of this that the model covers.

        A measured cell is a mean over its width; so is what is taken from it, or every
        ramp would leave a difference where the cells of the two do not fall together.
        The last cell before a gap is left out: nobody knows over what it is a mean.
        Where the model's cells are the wider ones, both are averaged over these: of a
        run with long gaps, as many cells are much narrower than those of the model.
        """
        if self.empty or model.time.size < 2:
            return Trace.nothing(self.signal, self.unit)
        if model.step > WIDER * self.step:
            return self._residual_of_wider(model)
        reach = float(model.time[-1]) + model.step
        inside = (self.time >= model.time[0]) & (self.time < reach)
        if self.time.size > 2:
            inside &= ~np.append(self.gap[1:], True)
        time = self.time[inside]
        step = np.diff(self.time, append=np.inf)[inside]
        ends = np.minimum(time + np.minimum(step, self.step), model.time[-1])
        area = np.concatenate([[0.0], np.cumsum(np.diff(model.time) * model.mean[:-1])])
        over = np.interp(ends, model.time, area) - np.interp(time, model.time, area)
        plain = np.interp(time, model.time, model.mean)
        width = ends - time
        expected = np.divide(over, width, out=plain, where=width > 0)
        rest = self.mean[inside] - expected
        made = Trace.line(time, rest, self.gap[inside])
        return replace(made, width=self.width, signal=self.signal, unit=self.unit)

    def _residual_of_wider(self, model: Trace) -> Trace:
        """The residual over the model's cells, of those that lie within no gap."""
        ends = np.append(model.time[1:], model.end)
        last = np.append(self.gap[1:], True)
        wide = np.minimum(np.diff(self.time, append=np.inf), self.step) * ~last
        knots = np.column_stack([self.time, self.time + wide]).ravel()

        def within(heights: FloatArray) -> FloatArray:
            """The integral over each of the model's cells."""
            after = np.cumsum(wide * heights)
            whole = np.column_stack([after - wide * heights, after]).ravel()
            until = np.interp(ends, knots, whole)
            return np.asarray(until - np.interp(model.time, knots, whole))

        covered = within(np.ones_like(wide))
        inside = covered > 0.99 * (ends - model.time)
        rest = (within(self.mean)[inside] / covered[inside]) - model.mean[inside]
        gap = ~np.append(False, inside[:-1])[inside]
        made = Trace.line(model.time[inside], rest, gap)
        return replace(made, width=model.width, signal=self.signal, unit=self.unit)

    def minus(self, other: Trace, grid: FloatArray) -> Trace:
        """This less another at the times in `grid`, s, at which both have data."""
        value = self.on(grid) - other.on(grid)
        known = np.isfinite(value)
        gap = np.diff(known, prepend=False)[known]
        return Trace.line(grid[known], value[known], gap, signal=self.signal)


def follows_late(end: float, after: Trace) -> bool:
    """Whether more than half a cell is missing between `end` s and a trace."""
    return not after.width or float(after.time[0]) - end > after.width / 2


def middle(values: FloatArray) -> float:
    """The median, the larger of two; 0 without values.

    np.median loads masked arrays when first called, in the midst of a frame.
    """
    half = values.size // 2
    return float(np.partition(values, half)[half]) if values.size else 0.0
