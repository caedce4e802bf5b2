"""Traces computed from traces: shown units, means, rate, residual."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gui.lanes.decimate import Drawn, FloatArray, thinned

BAND = 0.05
"""Residual, V, up to which the model is in step with the run."""

SILENCE = 3.0
"""Times the intervals beside it from which on a pause between spikes is a silence."""

LEAST_SILENCE = 0.5
"""Shortest silence, s."""


def scaled(drawn: Drawn, by: float) -> Drawn:
    """The trace in shown units."""
    if by == 1.0 or drawn.empty:
        return drawn
    return Drawn(
        drawn.time, drawn.low * by, drawn.high * by, drawn.mean * by, drawn.gap
    )


def averaged(drawn: Drawn) -> Drawn:
    """The means alone."""
    return Drawn(drawn.time, drawn.mean, drawn.mean, drawn.mean, drawn.gap)


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
) -> Drawn:
    """Instantaneous rate, Hz, at each spike around [start, end] s: 1/ISI.

    The spike that begins a stretch of firing has no point; the next begins a new line.
    More than 4 `count` points become about `count` columns.
    """
    first, last = np.searchsorted(spikes, [start, end])
    # one more on either side to join to, and what tells whether it begins a stretch
    low, high = max(0, first - 3), min(spikes.size, last + 3)
    times = spikes[low:high]
    if times.size < 2:
        return Drawn.nothing()
    begun = begins(times, steps)[1:]
    rate = 1 / np.maximum(np.diff(times), 1e-9)
    fresh = np.append(True, begun[:-1])
    wanted = ~begun
    wanted[: max(0, first - 2 - low)] = False
    wanted[last - low :] = False
    return thinned(times[1:][wanted], rate[wanted], fresh[wanted], count)


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


def difference(measured: Drawn, model: Drawn) -> Drawn:
    """Measured less model, at the measured times that the model covers.

    A measured column is a mean over its width; so is what is taken from it, or every
    ramp would leave a difference where the columns of the two do not fall together.
    """
    if measured.empty or model.time.size < 2:
        return Drawn.nothing()
    reach = float(model.time[-1]) + model.column
    inside = (measured.time >= model.time[0]) & (measured.time < reach)
    column = measured.column
    if measured.time.size > 2:
        # the last column before a gap is cut short: nobody knows over what it is a mean
        inside &= ~np.append(measured.gap[1:], True)
    time = measured.time[inside]
    step = np.diff(measured.time, append=np.inf)[inside]
    ends = np.minimum(time + np.minimum(step, column), model.time[-1])
    area = np.concatenate([[0.0], np.cumsum(np.diff(model.time) * model.mean[:-1])])
    over = np.interp(ends, model.time, area) - np.interp(time, model.time, area)
    plain = np.interp(time, model.time, model.mean)
    width = ends - time
    expected = np.divide(over, width, out=plain, where=width > 0)
    rest = measured.mean[inside] - expected
    gap = measured.gap[inside]
    gap[:1] = True
    return Drawn(time, rest, rest, rest, gap)


def less(one: Drawn, other: Drawn, grid: FloatArray) -> Drawn:
    """One trace less another at the times in `grid` at which both have data."""
    value = _on(one, grid) - _on(other, grid)
    known = np.isfinite(value)
    gap = np.diff(known, prepend=False)[known]
    return Drawn(grid[known], value[known], value[known], value[known], gap)


def _on(drawn: Drawn, grid: FloatArray) -> FloatArray:
    """Means at the times in `grid`; nan outside the trace and in its gaps."""
    if drawn.empty:
        return np.full(grid.size, np.nan)
    after = np.searchsorted(drawn.time, grid, side="right")
    missing = (after == 0) | ((after == drawn.time.size) & (grid > drawn.time[-1]))
    missing |= drawn.gap[np.minimum(after, drawn.time.size - 1)] & (
        grid < drawn.time[-1]
    )
    return np.where(missing, np.nan, np.interp(grid, drawn.time, drawn.mean))
