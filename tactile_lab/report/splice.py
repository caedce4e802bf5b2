"""A run without its planned recoveries, so that a figure shows what was measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tactile_lab.report.run_data import RunData, Trace
from tactile_lab.waveform import Waveform

FloatArray = NDArray[np.float64]


class Axis:
    """A run's time with its planned recoveries cut out.

    Attributes:
        cuts: where something was cut, s on the closed axis.
    """

    def __init__(self, run: RunData) -> None:
        pauses = [(t.start, t.start + t.duration) for t in run.trials if t.pause]
        self._begins, self._ends = np.array(pauses or np.empty((0, 2))).T
        self._gone = np.append(0.0, np.cumsum(self._ends - self._begins))
        self.cuts = tuple(float(c) for c in self.closed(self._begins))

    def closed(self, time: FloatArray) -> FloatArray:
        """Run time, s, on the closed axis; all of a pause falls onto its cut."""
        if not self._begins.size:
            return time
        number = np.searchsorted(self._begins, time, side="right")
        last = np.maximum(number - 1, 0)
        still = np.where(number > 0, np.maximum(0.0, self._ends[last] - time), 0.0)
        moved: FloatArray = time - self._gone[number] + still
        return moved

    def shown(self, time: FloatArray) -> NDArray[np.bool_]:
        """Which times lie in no pause."""
        if not self._begins.size:
            return np.ones(time.shape, dtype=bool)
        number = np.searchsorted(self._begins, time, side="right")
        outside = time >= self._ends[np.maximum(number - 1, 0)]
        shown: NDArray[np.bool_] = (number == 0) | outside
        return shown


def spliced(run: RunData) -> tuple[RunData, tuple[float, ...]]:
    """The run with its pauses cut out, and the times at which something was cut.

    Returns:
        A run whose time axis closes up over each pause, and the cuts on that axis, s.
        The run itself and no cuts where there is no pause.
    """
    axis = Axis(run)
    if not axis.cuts:
        return run, ()
    trials = tuple(
        replace(t, start=float(axis.closed(np.array(t.start))))
        for t in run.trials
        if not t.pause
    )
    return (
        replace(
            run,
            trials=trials,
            traces=tuple(_cut(t, axis) for t in run.traces),
            force=_joined(axis.closed(run.force.time), run.force.value),
            duration=float(axis.closed(np.array(run.duration))),
        ),
        axis.cuts,
    )


def _cut(trace: Trace, axis: Axis) -> Trace:
    keep = axis.shown(trace.time)
    return replace(
        trace,
        time=axis.closed(trace.time)[keep],
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
