"""Spikes of many sensors, as columns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Trains:
    """Spike trains of n sensors.

    Attributes:
        count: shape (n,), number of spikes.
        first: shape (n,), s; NaN without spikes.
        last: shape (n,), s.
        times: all spike times, s, sensor after sensor; empty if they were not kept.
    """

    count: NDArray[np.int64]
    first: FloatArray
    last: FloatArray
    times: FloatArray

    @classmethod
    def of_one(cls, times: FloatArray) -> Self:
        """One sensor's, from its spike times, s."""
        first, last = (times[:1], times[-1:]) if times.size else (_NONE, _NONE)
        return cls(np.array([times.size]), first, last, times)

    @property
    def mean_rate(self) -> FloatArray:
        """Intervals per time between first and last spike, Hz; NaN below two spikes."""
        long = np.where(self.count > 1, self.last - self.first, np.nan)
        found: FloatArray = (self.count - 1) / long
        return found

    def rows(self) -> list[FloatArray]:
        """The spike times of each sensor, as views."""
        return np.split(self.times, np.cumsum(self.count)[:-1])


_NONE = np.array([np.nan])
