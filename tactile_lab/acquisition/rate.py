"""Instantaneous rate of a spike train while it comes in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class Rate:
    """Instantaneous rate on the fly: 1/ISI of the last two spikes, 0 before the second.

    Attributes:
        value: Hz, after the last spike fed.
    """

    def __init__(self) -> None:
        self.value = 0.0
        self._last: float | None = None

    def feed(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rate right after each spike, Hz, for spike times in s, increasing."""
        if times.size == 0:
            return np.empty(0)
        before = times[:1] if self._last is None else np.array([self._last])
        intervals = np.diff(times, prepend=before)
        rates = np.zeros(times.size)
        np.divide(1.0, intervals, out=rates, where=intervals > 0)
        self._last, self.value = float(times[-1]), float(rates[-1])
        return rates
