"""A list of currents that a source plays by its own clock, and how one is made."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import LimitError
from tactile_lab.quantity import show
from tactile_lab.waveform import Waveform

FINEST = 0.005
"""Step of a list as a part of the current's range, below which finer points add only
time to load them."""

HALVINGS = 40
"""Bisections for the smallest step that fits into a source's memory."""


@dataclass(frozen=True, kw_only=True)
class ListCapability:
    """What lists a source plays.

    Attributes:
        points: the memory holds.
        shortest, longest: dwell of a point, s.
        resolution: what a dwell is rounded to, s.
        load_fixed, load_point: time to load a list, and each of its points, s.
    """

    points: int
    shortest: float
    longest: float
    resolution: float
    load_fixed: float
    load_point: float

    def load_time(self, points: int) -> float:
        """Time to load a list of so many points, s."""
        return self.load_fixed + points * self.load_point

    def following(self, wave: Waveform, digits: int = 5) -> CurrentList:
        """The list that follows `wave` most closely.

        Points lie where the current moves: it changes by the same small step in each,
        unless the shortest dwell is too long for that. Each holds the mean of its time.

        Args:
            wave: A against s from 0, without jumps; it begins and ends at 0 A.
            digits: decimals of a current on the wire.

        Raises:
            LimitError: it is longer than the source can play.
        """
        moved = np.abs(np.diff(wave.value))
        lasts = np.diff(wave.time)
        range_ = float(np.ptp(np.append(wave.value, 0.0)))
        shortest = self.shortest + self.resolution  # rounding may take as much away
        # half, for a point may be nearly twice as long as its share
        least = np.minimum(lasts / (self.longest / 2), lasts / shortest)

        def points_of(step: float) -> FloatArray:
            """Points that each piece of the wave gets; parts of one count, too."""
            return np.clip(moved / step, least, lasts / shortest)

        room = self.points - 1
        if least.sum() > room:
            raise LimitError(
                f"{show(wave.end, 's')} are longer than {self.points} points of "
                f"{show(self.longest / 2, 's')} each. Ask for a shorter trial."
            )
        step = max(FINEST * range_, 10.0**-digits)
        if points_of(step).sum() > room:
            low, high = step, max(range_, step) * wave.time.size
            for _ in range(HALVINGS):
                step = (low * high) ** 0.5
                low, high = (
                    (step, high) if points_of(step).sum() > room else (low, step)
                )
            step = high
        share = points_of(step)
        reached = np.concatenate([[0.0], np.cumsum(share)])
        points = max(1, int(reached[-1] * (1 + 1e-12)))
        edges = np.interp(np.linspace(0, reached[-1], points + 1), reached, wave.time)
        edges = np.round(edges / self.resolution) * self.resolution
        means = np.diff(wave.integral(edges)) / np.diff(edges)
        currents = np.append(np.round(means, digits) + 0.0, 0.0)
        dwells = np.append(np.diff(edges), self.shortest)
        return CurrentList(
            currents, np.round(dwells / self.resolution) * self.resolution
        )


@dataclass(frozen=True, eq=False)
class CurrentList:
    """Currents, each held for its dwell.

    Args:
        currents: shape (n,), A.
        dwells: shape (n,), s.
    """

    currents: FloatArray
    dwells: FloatArray

    def __len__(self) -> int:
        return int(self.currents.size)

    @cached_property
    def starts(self) -> FloatArray:
        """When each point starts, s after the list; shape (n,)."""
        return np.concatenate([[0.0], np.cumsum(self.dwells)[:-1]])

    @property
    def duration(self) -> float:
        """Length of the whole list, s."""
        return float(self.dwells.sum())

    @property
    def steepest(self) -> float:
        """Largest step over the time from the middle of its point to the next, A/s.

        The first step leads from 0 A.
        """
        step = np.abs(np.diff(self.currents, prepend=0.0))
        half = self.dwells / 2
        return float(np.max(step / (half + np.concatenate([half[:1], half[:-1]]))))

    def at(self, time: ArrayLike) -> FloatArray:
        """Current, A, `time` s (any shape) after the list's start; 0 before it."""
        t = np.asarray(time, dtype=np.float64)
        point = np.searchsorted(self.starts, t, side="right") - 1
        return np.where(point < 0, 0.0, self.currents[np.clip(point, 0, None)])

    @property
    def wave(self) -> Waveform:
        """The currents one after the other, A against s from its start.

        From a second at 0 A to a second at the last, in which what lags behind settles.
        """
        time = np.append(-1.0, self.starts)
        steps = np.column_stack([time, np.append(0.0, self.currents)])
        return Waveform.stairs(steps, self.duration + 1.0)

    def mean(self, start: FloatArray, width: float) -> FloatArray:
        """Mean current, A, over `width` s from each `start` (s after its start)."""
        knots = np.append(self.starts, self.duration)
        flowed = np.concatenate([[0.0], np.cumsum(self.currents * self.dwells)])
        ends = np.interp(start + width, knots, flowed)
        return np.asarray((ends - np.interp(start, knots, flowed)) / width)

    def between(self, start: float, end: float) -> tuple[float, float]:
        """Least and largest current, A, from `start` to `end` s after its start."""
        inside = (self.starts > start) & (self.starts <= end)
        values = np.concatenate([self.at([start, end]), self.currents[inside]])
        return float(values.min()), float(values.max())

    def same_as(self, other: CurrentList | None) -> bool:
        """Whether both play the same."""
        return (
            other is not None
            and np.array_equal(self.currents, other.currents)
            and np.array_equal(self.dwells, other.dwells)
        )
