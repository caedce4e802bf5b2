"""Minimum and maximum per pixel column: what a trace looks like at any zoom."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

HOLDS = 0.01
"""How long the last value of a record is good for, s."""


@dataclass(frozen=True, eq=False)
class Drawn:
    """A trace ready to draw.

    Attributes:
        time: shape (n,), s.
        low, high: shape (n,), SI; equal where a column holds one sample.
        mean: shape (n,), SI, mean of each column.
        gap: shape (n,), true where the point is not joined to the one before.
    """

    time: FloatArray
    low: FloatArray
    high: FloatArray
    mean: FloatArray
    gap: NDArray[np.bool_]

    @classmethod
    def nothing(cls) -> Drawn:
        """No points."""
        none = np.empty(0)
        return cls(none, none, none, none, np.empty(0, np.bool_))

    @classmethod
    def line(cls, time: FloatArray, value: FloatArray) -> Drawn:
        """A line through points, unbroken."""
        gap = np.zeros(time.size, np.bool_)
        gap[:1] = True
        return cls(time, value, value, value, gap)

    @property
    def empty(self) -> bool:
        """Whether there is nothing to draw."""
        return self.time.size == 0

    @property
    def extent(self) -> tuple[float, float] | None:
        """Least and largest value; None without points."""
        if self.empty:
            return None
        return float(self.low.min()), float(self.high.max())

    def at(self, time: float) -> float | None:
        """The mean at a time, s; None outside the points and in a gap.

        The last point before either holds for two columns; the last of all for `HOLDS`
        at least, for a record may end so much before its run.
        """
        after = int(np.searchsorted(self.time, time, side="right"))
        if after == 0:
            return None
        if after == self.time.size or self.gap[after]:
            late = time - float(self.time[after - 1])
            least = HOLDS if after == self.time.size else 0.0
            if late > max(2 * self.column, least):
                return None
            return float(self.mean[after - 1])
        return float(np.interp(time, self.time, self.mean))

    @cached_property
    def column(self) -> float:
        """Usual time from one point to the next, s; 0 below two points."""
        return middle(np.diff(self.time))


def middle(values: FloatArray) -> float:
    """The median, the larger of two; 0 without values.

    np.median loads masked arrays when first called, in the midst of a frame.
    """
    half = values.size // 2
    return float(np.partition(values, half)[half]) if values.size else 0.0


def columns(rows: FloatArray, count: int, width: float) -> Drawn:
    """At most `count` columns of consecutive bins.

    Args:
        rows: shape (4, n): start of each bin, ascending, s; least, largest and mean
            value of each bin.
        count: columns wanted, above 0.
        width: length of one bin, s; a step longer than 1.5 of it is a gap.
    """
    time, low, high, mean = rows
    if time.size == 0:
        return Drawn.nothing()
    gap = np.zeros(time.size, np.bool_)
    gap[1:] = np.diff(time) > 1.5 * width
    gap[0] = True
    if time.size <= count:
        return Drawn(time, low, high, mean, gap)
    # edges on a grid of absolute time: bins do not wander as the view scrolls
    per = -(-time.size // count)
    first = round(float(time[0]) / width) if width > 0 else 0
    offset = (-first) % per
    edges = np.concatenate([[0], np.arange(offset or per, time.size, per)])
    if np.count_nonzero(gap) > 1:
        edges = np.union1d(edges, np.flatnonzero(gap))
    counts = np.diff(np.append(edges, time.size))
    return Drawn(
        time[edges],
        np.minimum.reduceat(low, edges),
        np.maximum.reduceat(high, edges),
        np.add.reduceat(mean, edges) / counts,
        gap[edges],
    )


def cut(rows: FloatArray, width: float, start: float, end: float, count: int) -> Drawn:
    """What `rows` of bins, `width` s each, have in [start, end] s; see `columns`."""
    first, last = np.searchsorted(rows[0], [start, end])
    first, last = max(0, int(first) - 1), min(rows.shape[1], int(last) + 1)
    return columns(rows[:, first:last], count, width)


def zigzag(drawn: Drawn) -> tuple[FloatArray, FloatArray]:
    """One polyline through all columns: down to the low, up to the high, and on.

    The nearer extreme comes first, so that the line does not cross itself needlessly.
    """
    n = drawn.time.size
    x = np.repeat(drawn.time, 2)
    y = np.empty(2 * n)
    y[0::2], y[1::2] = drawn.low, drawn.high
    if n > 1:
        middle = (drawn.low + drawn.high) / 2
        falling = np.empty(n, np.bool_)
        falling[1:] = middle[1:] < middle[:-1]
        falling[0] = falling[1]
        y[0::2] = np.where(falling, drawn.high, drawn.low)
        y[1::2] = np.where(falling, drawn.low, drawn.high)
    return x, y


def stepped(
    time: FloatArray, value: FloatArray, until: float
) -> tuple[FloatArray, FloatArray]:
    """The corners of a line on which each value holds until the next, to `until` s."""
    end = np.append(time[1:], max(until, float(time[-1]))) if time.size else time
    return np.column_stack([time, end]).ravel(), np.repeat(value, 2)


def line_between(
    time: FloatArray, value: FloatArray, start: float, end: float, count: int
) -> Drawn:
    """A polyline's part around [start, end] s, its extremes kept where it is dense."""
    if time.size == 0:
        return Drawn.nothing()
    first, last = np.searchsorted(time, [start, end])
    first, last = max(0, first - 1), min(time.size, last + 1)
    fresh = np.zeros(last - first, np.bool_)
    return thinned(time[first:last], value[first:last], fresh, count)


def thinned(
    time: FloatArray, value: FloatArray, gap: NDArray[np.bool_], count: int
) -> Drawn:
    """A line through points, broken at gaps; above 4 `count` points, by columns."""
    if time.size == 0:
        return Drawn.nothing()
    gap[0] = True
    if time.size <= 4 * count:
        return Drawn(time, value, value, value, gap)
    edges = np.arange(0, time.size, -(-time.size // count))
    if np.count_nonzero(gap) > 1:
        edges = np.union1d(edges, np.flatnonzero(gap))
    low, high = np.minimum.reduceat(value, edges), np.maximum.reduceat(value, edges)
    counts = np.diff(np.append(edges, value.size))
    mean = np.add.reduceat(value, edges) / counts
    return Drawn(time[edges], low, high, mean, gap[edges])
