"""A run's time with its planned recoveries cut out, and signals cut at their gaps."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.measurement import Measurement


class ClosedTime:
    """A run's time axis that closes up over each pause.

    Where the run has a single trial, its start is 0: what is said of a trial counts
    from there.

    Attributes:
        cuts: where something was cut, s on the closed axis.
        begin, end: of the run, s on the closed axis.
        label: what the axis is called.
    """

    def __init__(self, run: Measurement) -> None:
        pauses = [(t.start, t.start + t.duration) for t in run.trials if t.pause]
        single = run.results if len(run.results) == 1 and not pauses else ()
        self._zero = single[0].start if single else 0.0
        self._begins, self._ends = np.array(pauses or np.empty((0, 2))).T
        self._gone = np.append(0.0, np.cumsum(self._ends - self._begins))
        self.cuts = tuple(float(c) for c in self.closed(self._begins))
        self.begin, self.end = self.at(0.0), self.at(run.duration)
        self.label = "Time" if self._zero == 0 else "Time from the start of the trial"
        if self.cuts:
            self.label = "Time, recoveries left out at dotted lines"

    def closed(self, time: FloatArray) -> FloatArray:
        """Run time, s, on the closed axis; all of a pause falls onto its cut."""
        if not self._begins.size:
            return time - self._zero
        number = np.searchsorted(self._begins, time, side="right")
        last = np.maximum(number - 1, 0)
        still = np.where(number > 0, np.maximum(0.0, self._ends[last] - time), 0.0)
        moved: FloatArray = time - self._gone[number] + still
        return moved

    def at(self, time: float) -> float:
        """One run time on the closed axis, s."""
        return float(self.closed(np.array(time)))

    def shown(self, time: FloatArray) -> NDArray[np.bool_]:
        """Which times lie in no pause."""
        if not self._begins.size:
            return np.ones(time.shape, dtype=bool)
        number = np.searchsorted(self._begins, time, side="right")
        outside = time >= self._ends[np.maximum(number - 1, 0)]
        shown: NDArray[np.bool_] = (number == 0) | outside
        return shown

    def spliced(self, time: FloatArray, *values: FloatArray) -> list[FloatArray]:
        """Closed times and the values at them, without pauses, NaN at each gap."""
        keep = self.shown(time)
        return broken(self.closed(time)[keep], *(v[keep] for v in values))


def stretches(time: FloatArray) -> list[slice]:
    """Runs of points without a gap: no step above 1.5 times the median step."""
    if time.size == 0:
        return []
    step = np.diff(time)
    if step.size == 0:
        return [slice(0, 1)]
    breaks = np.flatnonzero(step > 1.5 * np.median(step)) + 1
    edges = [0, *breaks.tolist(), time.size]
    return [slice(a, b) for a, b in pairwise(edges)]


def broken(time: FloatArray, *values: FloatArray) -> list[FloatArray]:
    """The arrays with a NaN wherever a gap begins."""
    gaps = [piece.start for piece in stretches(time)[1:]]
    return [np.insert(v, gaps, np.nan) for v in (time, *values)]
