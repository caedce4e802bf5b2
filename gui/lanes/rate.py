"""The firing rate as it is drawn and read: one over the interval, with silences."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_lab.trace import FloatArray, Trace

SILENCE = 3.0
"""Times the intervals beside it from which on a pause between spikes is a silence."""

LEAST_SILENCE = 0.5
"""Shortest silence, s."""


NEVER = np.empty(0)


def begins(spikes: FloatArray, steps: FloatArray = NEVER) -> NDArray[np.bool_]:
    """Which spikes begin a stretch of firing: the first, and those after a silence.

    The pause before such a spike is no interval of a train and gives no rate. A pause
    is a silence where it is longer than `LEAST_SILENCE` and a step of the run began
    in it, or it is longer than `SILENCE` times the shorter of the intervals beside it.
    So slow but regular firing is none, and neither is firing on from step to step.

    Args:
        spikes: times, ascending, s.
        steps: when the steps of the run begin, ascending, s.
    """
    first = np.ones(spikes.size, np.bool_)
    if spikes.size > 1:
        between = np.diff(spikes)
        beside = np.full(between.size + 2, np.inf)
        beside[1:-1] = between
        usual = np.minimum(beside[:-2], beside[2:])
        usual[np.isinf(usual)] = 0.0
        parted = np.diff(np.searchsorted(steps, spikes, side="right")) > 0
        silent = parted | (between > SILENCE * usual)
        first[1:] = silent & (between > LEAST_SILENCE)
    return first


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
    first, last = np.searchsorted(spikes, [start, end])
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


def rate_at(spikes: FloatArray, time: float, steps: FloatArray = NEVER) -> float | None:
    """The rate at `time` s as an observer tells it, Hz.

    One over the last interval, for as long as the train may still go on; 0 where it is
    silent: before the first spike, or `LEAST_SILENCE` and `SILENCE` intervals after
    the last. None from the first spike of a stretch on: there is no interval yet.
    """
    seen = int(np.searchsorted(spikes, time, side="right"))
    if seen == 0:
        return 0.0
    near = spikes[max(0, seen - 3) : seen + 1]
    at = min(seen, 3) - 1
    begun = bool(begins(near, steps)[at])
    interval = 0.0 if begun else max(float(near[at] - near[at - 1]), 1e-9)
    if time - near[at] > max(SILENCE * interval, LEAST_SILENCE):
        return 0.0
    return None if begun else 1 / interval
