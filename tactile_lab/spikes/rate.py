"""The firing rate of a spike train, with its silences: one rule wherever it is told.

Times are s, rates Hz. The rate is one over the interval of the last two spikes for as
long as the train may still go on, and 0 in a silence: none is told across one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactile_lab.arrays import FloatArray

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


def rates_between(
    spikes: FloatArray, steps: FloatArray = NEVER
) -> tuple[FloatArray, FloatArray]:
    """1/ISI of each interval of a train, in its middle; none across a silence.

    Args:
        spikes: times, ascending, s.
        steps: when the steps of the run begin, ascending, s.

    Returns:
        Times, s, and rates, Hz, of shape (n,).
    """
    inside = ~begins(spikes, steps)[1:]
    middles = (spikes[1:] + spikes[:-1]) / 2
    return middles[inside], 1.0 / np.diff(spikes)[inside]


def rate_changes(
    spikes: FloatArray, steps: FloatArray = NEVER
) -> tuple[FloatArray, FloatArray]:
    """When the rate changes, and to what: each holds until the next change.

    It changes at each spike from the second of a stretch on, to 1/ISI, and to 0 once
    the train is silent. Before the first change it is 0.

    Args:
        spikes: times, ascending, s.
        steps: when the steps of the run begin, ascending, s.

    Returns:
        Times, s, ascending, and rates, Hz, of shape (n,).
    """
    begun = begins(spikes, steps)
    later = np.flatnonzero(~begun)
    interval = np.maximum(spikes[later] - spikes[later - 1], 1e-9)
    silent = spikes[later] + np.maximum(SILENCE * interval, LEAST_SILENCE)
    following = np.append(spikes, np.inf)[later + 1]
    # the first spike after a silence has no rate yet, however soon it was expected
    ended = (silent < following) | np.append(begun, False)[later + 1]
    falls = np.minimum(silent, following)[ended]
    time = np.concatenate([spikes[later], falls])
    rate = np.concatenate([1.0 / interval, np.zeros(falls.size)])
    order = np.argsort(time, kind="stable")
    return time[order], rate[order]


def rate(spikes: ArrayLike, at: ArrayLike, steps: FloatArray = NEVER) -> FloatArray:
    """The rate at the times `at` (any shape, s), Hz, right-continuous.

    Args:
        spikes: times, ascending, s.
        at: s.
        steps: when the steps of the run begin, ascending, s.
    """
    time, value = rate_changes(np.asarray(spikes, dtype=np.float64), steps)
    seen = np.searchsorted(time, np.asarray(at, dtype=np.float64), side="right")
    found: FloatArray = np.append(0.0, value)[seen]
    return found


def rate_at(spikes: FloatArray, time: float, steps: FloatArray = NEVER) -> float | None:
    """The rate at `time` s as an observer tells it while it goes on, Hz.

    None from the first spike of a stretch on: there is no interval yet.
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
