"""Traces computed from traces: shown units, means, rate, residual."""

from __future__ import annotations

import numpy as np

from gui.lanes.decimate import Drawn, FloatArray, line_between

SILENCE = 3.0
"""Times the interval before from which on a pause between spikes is a silence."""

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


def rate_of(spikes: FloatArray, start: float, end: float, count: int) -> Drawn:
    """Instantaneous rate at each spike around [start, end] s; 0 at the first, Hz.

    After a silence a new line begins. More than 4 `count` spikes become about `count`
    columns.
    """
    first, last = np.searchsorted(spikes, [start, end])
    first, last = max(0, first - 3), min(spikes.size, last + 1)
    times = spikes[first:last]
    if times.size < 2:
        return Drawn.nothing()
    rate = np.zeros(times.size)
    rate[1:] = 1 / np.maximum(np.diff(times), 1e-9)
    if first > 0:
        times, rate = times[1:], rate[1:]
    if times.size > 4 * count:
        return line_between(times, rate, start, end, count)
    gap = np.zeros(times.size, np.bool_)
    gap[0] = True
    between = np.diff(times)
    gap[2:] = between[1:] > np.maximum(SILENCE * between[:-1], LEAST_SILENCE)
    return Drawn(times, rate, rate, rate, gap)


def rate_at(spikes: FloatArray, time: float) -> float:
    """1/ISI of the last two spikes at or before `time` s; 0 before the second, Hz."""
    last = int(np.searchsorted(spikes, time, side="right"))
    return (
        1 / max(float(spikes[last - 1] - spikes[last - 2]), 1e-9) if last > 1 else 0.0
    )


def difference(measured: Drawn, model: Drawn) -> Drawn:
    """Measured less model, at the measured times that the model covers.

    A measured column is a mean over its width; so is what is taken from it, or every
    ramp would leave a difference where the columns of the two do not fall together.
    """
    if measured.empty or model.time.size < 2:
        return Drawn.nothing()
    inside = measured.time <= model.time[-1]
    time = measured.time[inside]
    step = np.diff(measured.time, append=np.inf)
    typical = float(np.median(step[:-1])) if step.size > 1 else 0.0
    ends = np.minimum(time + np.minimum(step[inside], typical), model.time[-1])
    area = np.concatenate([[0.0], np.cumsum(np.diff(model.time) * model.mean[:-1])])
    over = np.interp(ends, model.time, area) - np.interp(time, model.time, area)
    plain = np.interp(time, model.time, model.mean)
    width = ends - time
    expected = np.divide(over, width, out=plain, where=width > 0)
    rest = measured.mean[inside] - expected
    return Drawn(time, rest, rest, rest, measured.gap[inside])
