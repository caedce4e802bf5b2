"""A run without its planned recoveries, so that a figure shows what was measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tactile_lab.report.run_data import RunData, Trace
from tactile_lab.waveform import Waveform

FloatArray = NDArray[np.float64]


def spliced(run: RunData) -> tuple[RunData, tuple[float, ...]]:
    """The run with its pauses cut out, and the times at which something was cut.

    Returns:
        A run whose time axis closes up over each pause, and the cuts on that axis, s.
        The run itself and no cuts where there is no pause.
    """
    pauses = [(t.start, t.start + t.duration) for t in run.trials if t.pause]
    if not pauses:
        return run, ()
    begins, ends = np.array(pauses).T
    gone = np.cumsum(ends - begins)

    def closed(time: FloatArray) -> FloatArray:
        """Time on the closed axis; all of a pause falls onto its cut."""
        number = np.searchsorted(begins, time, side="right")
        before = np.append(0.0, gone)[number]
        last = np.maximum(number - 1, 0)
        still = np.where(number > 0, np.maximum(0.0, ends[last] - time), 0.0)
        moved: FloatArray = time - before + still
        return moved

    cuts = tuple(float(c) for c in closed(begins))
    trials = tuple(
        replace(t, start=float(closed(np.array(t.start))))
        for t in run.trials
        if not t.pause
    )
    return (
        replace(
            run,
            trials=trials,
            traces=tuple(_cut(t, begins, ends, closed(t.time)) for t in run.traces),
            force=_joined(closed(run.force.time), run.force.value),
            duration=float(closed(np.array(run.duration))),
        ),
        cuts,
    )


def _cut(
    trace: Trace, begins: FloatArray, ends: FloatArray, moved: FloatArray
) -> Trace:
    number = np.searchsorted(begins, trace.time, side="right")
    last = np.maximum(number - 1, 0)
    keep = (number == 0) | (trace.time >= ends[last])
    return replace(
        trace,
        time=moved[keep],
        mean=trace.mean[keep],
        low=None if trace.low is None else trace.low[keep],
        high=None if trace.high is None else trace.high[keep],
    )


def _joined(time: FloatArray, value: FloatArray) -> Waveform:
    """A waveform of points of which many may share one instant: first and last stay."""
    time = np.maximum.accumulate(time)  # closing up rounds
    keep = np.ones(time.size, dtype=bool)
    keep[1:-1] = (time[2:] != time[1:-1]) | (time[1:-1] != time[:-2])
    return Waveform(time[keep], value[keep])
