"""Piecewise-linear waveforms with explicit jumps: force N(t), current A(t)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import ParameterError

NEAR = 0.01
"""Part of a value, or of its largest change, that is told as no difference."""


@dataclass(frozen=True, eq=False)
class Waveform:
    """A value against time, linear between points.

    The same time twice is a jump; the later value holds at that instant
    (right-continuous). The first value holds before the first point, so a first
    value other than 0 is no jump, and the last value holds after the last point.

    Args:
        time: shape (n,), s, finite, non-decreasing, at most two points per instant.
        value: shape (n,), the caller's SI unit, finite.

    Raises:
        ParameterError: empty, unequal lengths, unsorted, or not finite.
    """

    time: FloatArray
    value: FloatArray

    def __post_init__(self) -> None:
        time, value = _own(self.time), _own(self.value)
        if time.ndim != 1 or time.shape != value.shape or time.size == 0:
            raise ParameterError(
                f"A waveform needs as many values as times, at least one; got shapes "
                f"{time.shape} and {value.shape}."
            )
        for what, numbers in (("time", time), ("value", value)):
            bad = np.flatnonzero(~np.isfinite(numbers))
            if bad.size:
                raise ParameterError(
                    f"Waveform {what} number {bad[0] + 1} is {numbers[bad[0]]}; "
                    "give finite numbers."
                )
        unsorted = np.flatnonzero(np.diff(time) < 0)
        if unsorted.size:
            i = int(unsorted[0])
            raise ParameterError(
                f"Waveform times must not decrease: point {i + 2} at {time[i + 1]:g} s "
                f"follows {time[i]:g} s. Sort the points."
            )
        triple = np.flatnonzero(time[2:] == time[:-2])
        if triple.size:
            i = int(triple[0])
            raise ParameterError(
                f"Waveform has three points at {time[i]:g} s; a jump has two, "
                "the value before and the value after."
            )
        time.setflags(write=False)
        value.setflags(write=False)
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "value", value)

    @classmethod
    def constant(cls, value: float) -> Waveform:
        """A waveform that has one value at all times."""
        return cls(np.zeros(1), np.array([value]))

    @classmethod
    def through(cls, points: Iterable[tuple[float, float]]) -> Waveform:
        """A waveform through (time s, value) points."""
        pairs = np.array(list(points), dtype=np.float64).reshape(-1, 2)
        return cls(pairs[:, 0], pairs[:, 1])

    @classmethod
    def pulse(
        cls, level: float, *, ramp: float, hold: float, rest: float = 0.0
    ) -> Waveform:
        """0 to `level` in `ramp` s, `hold` s there, `ramp` s back, `rest` s at 0."""
        rise, fall = ramp, ramp + hold
        points = [(0.0, 0.0), (rise, level), (fall, level), (fall + ramp, 0.0)]
        if rest > 0:
            points.append((fall + ramp + rest, 0.0))
        return cls.through(points)

    @classmethod
    def stairs(cls, steps: FloatArray, end: float) -> Waveform:
        """0, then each value of `steps` until the next, the last until `end` s.

        Args:
            steps: shape (n, 2): from that time on, s, that value.
            end: s; or the last step's time, if that is later.
        """
        if len(steps) == 0:
            return cls.constant(0.0)
        if steps[0, 0] > 0:  # the first may come late, and be no small one
            steps = np.concatenate([[[0.0, 0.0]], steps])
        time = np.repeat(steps[:, 0], 2)[1:]
        value = np.repeat(steps[:, 1], 2)[:-1]
        return cls.tidied(
            np.append(time, max(end, time[-1])), np.append(value, value[-1])
        )

    @classmethod
    def tidied(cls, time: FloatArray, value: FloatArray) -> Waveform:
        """Without points equal to the one before, or between two of the same instant.

        Args:
            time: s, non-decreasing.
            value: at those times.
        """
        keep = np.ones(time.size, dtype=bool)
        keep[1:] = (np.diff(time) != 0) | (np.diff(value) != 0)
        time, value = time[keep], value[keep]
        keep = np.ones(time.size, dtype=bool)
        keep[1:-1] = (time[2:] != time[1:-1]) | (time[1:-1] != time[:-2])
        return cls(time[keep], value[keep])

    @cached_property
    def start(self) -> float:
        """Time of the first point, s."""
        return float(self.time[0])

    @cached_property
    def end(self) -> float:
        """Time of the last point, s."""
        return float(self.time[-1])

    @cached_property
    def first(self) -> float:
        """Value at and before the first point."""
        return float(self.value[0])

    @property
    def peak(self) -> float:
        """Largest magnitude of the value."""
        return float(np.max(np.abs(self.value)))

    @cached_property
    def steepest(self) -> float:
        """Largest slope magnitude, per s; infinite where there is a jump."""
        rise = np.abs(np.diff(self.value))
        run = np.diff(self.time)
        if np.any((run == 0) & (rise > 0)):
            return float("inf")
        sloped = run > 0
        return float(np.max(rise[sloped] / run[sloped], initial=0.0))

    def at(self, time: ArrayLike) -> FloatArray:
        """Value at `time` (any shape, s), right-continuous at jumps."""
        t = np.asarray(time, dtype=np.float64)
        after = np.searchsorted(self.time, t, side="right")
        left = np.clip(after - 1, 0, self.time.size - 1)
        right = np.clip(after, 0, self.time.size - 1)
        run = self.time[right] - self.time[left]
        inside = (after > 0) & (run > 0)
        part = np.where(inside, (t - self.time[left]) / np.where(run > 0, run, 1.0), 0)
        value: FloatArray = self.value[left] + part * (
            self.value[right] - self.value[left]
        )
        return value

    def integral(self, time: ArrayLike) -> FloatArray:
        """Integral from the first point to `time` (any shape, s), in its unit times s.

        Before and after its points it holds its first and last value.
        """
        t = np.asarray(time, dtype=np.float64)
        pieces = np.diff(self.time) * (self.value[1:] + self.value[:-1]) / 2
        until = np.concatenate([[0.0], np.cumsum(pieces)])
        k = np.clip(np.searchsorted(self.time, t, side="right") - 1, 0, None)
        within = (t - self.time[k]) * (self.value[k] + self.at(t)) / 2
        return np.asarray(until[k] + within)

    def mean(self, start: FloatArray, width: float) -> FloatArray:
        """Mean over `width` s from each `start`, s."""
        whole = self.integral(start + width) - self.integral(start)
        return np.asarray(whole / width)

    def pieces(self, points: int) -> Iterator[Waveform]:
        """Consecutive parts that begin with the point the one before ends with.

        Args:
            points: that each has at most, beside that one.
        """
        if self.time.size <= points + 1:
            yield self
            return
        for start in range(0, self.time.size - 1, points):
            part = slice(start, start + points + 1)
            yield Waveform(self.time[part], self.value[part])

    def each(self, change: Callable[[Waveform], Waveform]) -> Waveform:
        """What `change` makes of it, as a `LongWaveform` changes each of its pieces."""
        return change(self)

    def arrival(self, at: float, since: float) -> float:
        """When it came within `NEAR` of the value it has at `at` s, to stay, s.

        Args:
            at: s.
            since: nothing before is looked at; the answer where it stayed near, s.
        """
        held = float(self.at(at))
        inside = self._between(since, at)
        away = np.flatnonzero(np.abs(self.value[inside] - held) > NEAR * abs(held))
        if not away.size:
            return since
        there = self.time[inside][away[-1] + 1 :]
        return float(there[0]) if there.size else at

    def departure(self, since: float, until: float, near: float = NEAR) -> float | None:
        """When it begins to leave the value it comes to `since` s with; None if never.

        It has not left while it changes by less than `near` of its largest change.

        Args:
            since: s; a jump there is a departure.
            until: nothing beyond is looked at, s.
            near: part of its largest change.
        """
        inside = self._between(since, until)
        times, values = self.time[inside], self.value[inside]
        if not times.size:
            return None
        came = values[0] if times[0] == since else self.at(since)
        apart = np.abs(values - came)
        if apart.max() == 0:
            return None
        first = int(np.argmax(apart > near * apart.max()))
        return float(times[first - 1]) if first > 0 else since

    def _between(self, since: float, until: float) -> slice:
        """The points from `since` to `until` s, both included."""
        first = int(np.searchsorted(self.time, since))
        return slice(first, int(np.searchsorted(self.time, until, side="right")))

    def segments(self) -> Iterator[tuple[float, float, float, float]]:
        """Each (start s, end s, value at start, value at end); jumps have no length."""
        for i in range(self.time.size - 1):
            yield (
                float(self.time[i]),
                float(self.time[i + 1]),
                float(self.value[i]),
                float(self.value[i + 1]),
            )

    def with_points_at(self, levels: FloatArray) -> Waveform:
        """The same waveform with a point wherever it crosses one of `levels`."""
        levels, jumps = np.sort(levels), np.diff(self.time) == 0
        begin, change = self.value[:-1], np.diff(self.value)
        low, high = np.minimum(begin, self.value[1:]), np.maximum(begin, self.value[1:])
        first, stop = (
            np.searchsorted(levels, low, "right"),
            np.searchsorted(levels, high),
        )
        counts = np.where(jumps, 0, np.maximum(stop - first, 0))
        if not counts.any():
            return self
        part = np.repeat(np.arange(counts.size), counts)  # of it, one for each point
        nth = np.arange(part.size) - np.repeat(np.cumsum(counts) - counts, counts)
        rises = change[part] > 0
        value = levels[np.where(rises, first[part] + nth, stop[part] - 1 - nth)]
        start, end = self.time[part], self.time[part + 1]
        time = start + (end - start) * (value - begin[part]) / change[part]
        before = np.where(nth == 0, start, np.roll(time, 1))
        new = (before < time) & (time < end)  # or it would be a jump
        where, time, value = part[new] + 1, time[new], value[new]
        return Waveform(
            np.insert(self.time, where, time), np.insert(self.value, where, value)
        )

    def shifted(self, by: float) -> Waveform:
        """The same waveform `by` s later."""
        return Waveform(self.time + by, self.value)

    def since(self, start: float) -> Waveform:
        """From `start` s on, after its first value; itself where it begins later.

        Where it has left that value by then, it jumps at `start`.
        """
        if self.start >= start:
            return self
        after = self.time > start
        time = np.concatenate([[start, start], self.time[after]])
        begun = [self.value[0], self.at(start)]
        return Waveform.tidied(time, np.concatenate([begun, self.value[after]]))

    def scaled(self, by: float) -> Waveform:
        """The same waveform with every value multiplied."""
        return Waveform(self.time, self.value * by)

    def plus(self, other: Waveform) -> Waveform:
        """The sum of two waveforms without jumps, with the points of both."""
        time = np.union1d(self.time, other.time)
        return Waveform(time, self.at(time) + other.at(time))

    def then(self, other: Waveform) -> Waveform:
        """This waveform followed by `other`, whose time 0 is put at this one's end."""
        moved = other.shifted(self.end)
        time = np.concatenate([self.time, moved.time])
        value = np.concatenate([self.value, moved.value])
        return Waveform.tidied(time, value)

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Waveform)
            and np.array_equal(self.time, other.time)
            and np.array_equal(self.value, other.value)
        )

    def __hash__(self) -> int:
        return hash((self.time.tobytes(), self.value.tobytes()))


def _own(numbers: ArrayLike) -> FloatArray:
    """A copy that nobody else changes; another waveform's is nobody's to change."""
    if (
        isinstance(numbers, np.ndarray)
        and numbers.dtype == np.float64
        and numbers.ndim == 1
        and numbers.base is None
        and not numbers.flags.writeable
    ):
        return numbers
    return np.array(numbers, dtype=np.float64, ndmin=1)
