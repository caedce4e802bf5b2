"""The firing rate as it is drawn: a point per interval, nothing across a silence."""

from __future__ import annotations

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.spikes.rate import NEVER, begins
from tactile_lab.trace import Trace


def rate_of(
    spikes: FloatArray,
    start: float,
    end: float,
    count: int,
    steps: FloatArray = NEVER,
) -> Trace:
    """Instantaneous rate, Hz, at each spike around [start, end] s: 1/ISI.

    The spike that begins a stretch of firing has no point; the next begins a new line.
    More than 4 `count` points become about `count` columns.
    """
    first, last = spikes.searchsorted((start, end)).tolist()
    # one more on either side to join to, and what tells whether it begins a stretch
    low, high = max(0, first - 3), min(spikes.size, last + 3)
    times = spikes[low:high]
    if times.size < 2:
        return Trace.nothing()
    begun = begins(times, steps)[1:]
    rate = 1 / np.maximum(np.diff(times), 1e-9)
    fresh = np.append(True, begun[:-1])
    wanted = ~begun
    wanted[: max(0, first - 2 - low)] = False
    wanted[last - low :] = False
    return Trace.line(times[1:][wanted], rate[wanted], fresh[wanted]).thin(count)
