"""The twin: the model driven by what the coil really did, beside what was measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactile_lab.errors import ParameterError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import Result, Start, simulate
from tactile_lab.waveform import Waveform

FloatArray = NDArray[np.float64]

WITHIN = 0.5
"""A pair of spikes may lie apart by this part of the interval around it."""


@dataclass(frozen=True, eq=False)
class Measured:
    """One measured voltage, decimated.

    Attributes:
        signal: "V_C1" or "V_C2".
        time: shape (n,), middle of each bin, s.
        value: shape (n,), mean of each bin, V.
    """

    signal: str
    time: FloatArray
    value: FloatArray


@dataclass(frozen=True, eq=False)
class Residual:
    """Measured less predicted.

    Attributes:
        signal: which.
        time: shape (n,), s.
        predicted: shape (n,), V.
        difference: shape (n,), V; not a number where a spike falls into the bin.
    """

    signal: str
    time: FloatArray
    predicted: FloatArray
    difference: FloatArray

    @property
    def offset(self) -> float:
        """Mean difference, V."""
        return float(np.nanmean(self.difference))

    @property
    def rms(self) -> float:
        """Root mean square of the difference, V."""
        return float(np.sqrt(np.nanmean(self.difference**2)))

    @property
    def band(self) -> float:
        """95 % of the differences are smaller in magnitude than this, V."""
        return float(np.nanpercentile(np.abs(self.difference), 95))


@dataclass(frozen=True, eq=False)
class Matched:
    """Measured spikes paired with predicted ones.

    Attributes:
        measured: shape (k,), times of the pairs' measured spikes, s.
        offsets: shape (k,), measured less predicted, s.
        missed: predicted spikes without a measured one.
        extra: measured spikes without a predicted one.
        rate_error: shape (j,), relative error of 1/ISI where two neighbours on both
            sides are paired: measured over predicted less 1.
    """

    measured: FloatArray
    offsets: FloatArray
    missed: int
    extra: int
    rate_error: FloatArray

    @property
    def sentence(self) -> str:
        """For a person: "26 of 26 spikes matched, median offset 1.2 ms"."""
        measured = self.measured.size + self.extra
        text = f"{self.measured.size} of {measured} spikes matched"
        if self.missed:
            text += f", {self.missed} predicted ones missing"
        if self.offsets.size:
            middle = f"{np.median(self.offsets) * 1e3:.2g}".replace("-", "−")
            largest = np.max(np.abs(self.offsets)) * 1e3
            text += f", offset {middle} ms (median), {largest:.2g} ms at most"
        if self.rate_error.size:
            middle = f"{np.median(self.rate_error) * 100:.2g}".replace("-", "−")
            text += f", rate error {middle} % (median)"
        return text


@dataclass(frozen=True, eq=False)
class Twin:
    """The model beside one run.

    Attributes:
        result: of the simulation.
        residuals: per measured voltage.
        spikes: matched, or None where none were measured.
    """

    result: Result
    residuals: tuple[Residual, ...]
    spikes: Matched | None

    def residual(self, signal: str) -> Residual | None:
        """That signal's residual, or None."""
        return next((r for r in self.residuals if r.signal == signal), None)


def twin(
    circuit: Circuit,
    force: Waveform,
    duration: float,
    *,
    voltages: Sequence[Measured] = (),
    spike_times: ArrayLike | None = None,
    pauses: Sequence[tuple[float, float]] = (),
    start: Start | None = None,
) -> Twin:
    """Run the model beside measured data.

    Args:
        circuit: the sensor as it is believed to be.
        force: N on the run's time axis, from the measured coil current; planned pauses
            are integrated through.
        duration: of the run, s.
        voltages: measured voltages to compare.
        spike_times: detected spikes, s; None leaves the firing stage out.
        pauses: (start, end) in which nothing was streamed, s: spikes the model has
            there are not missed.
        start: voltages at time 0; equilibrium if None.

    Raises:
        ParameterError: nothing to compare with, or times beyond the run.
    """
    keep = [trace.signal for trace in voltages]
    if spike_times is not None or "V_C2" in keep:
        keep.append("spikes")
    if not keep:
        raise ParameterError("A twin needs a measured voltage or spikes to compare.")
    result = simulate(circuit, force, keep=tuple(keep), until=duration, start=start)
    predicted = result.spike_times
    matched = None
    if spike_times is not None and predicted is not None:
        seen = predicted
        for begin, end in pauses:
            seen = seen[(seen < begin) | (seen >= end)]
        matched = match(spike_times, seen)
    measured_spikes = np.empty(0) if spike_times is None else np.asarray(spike_times)
    jumps = measured_spikes if predicted is None else np.r_[measured_spikes, predicted]
    residuals = tuple(_residual(result, trace, np.sort(jumps)) for trace in voltages)
    return Twin(result, residuals, matched)


def _residual(result: Result, trace: Measured, jumps: FloatArray) -> Residual:
    inside = (trace.time >= 0) & (trace.time <= result.duration)
    time, value = trace.time[inside], trace.value[inside]
    predicted = result.sample(trace.signal, time)
    difference = value - predicted
    if trace.signal == "V_C2" and jumps.size and time.size > 1:
        half = float(np.median(np.diff(time)))
        after = np.searchsorted(jumps, time - half)
        near = np.minimum(after, jumps.size - 1)
        hit = (after < jumps.size) & (jumps[near] <= time + half)
        difference = np.where(hit, np.nan, difference)
    return Residual(trace.signal, time, predicted, difference)


def match(measured: ArrayLike, predicted: ArrayLike) -> Matched:
    """Pair spikes that are each other's nearest and near enough.

    Near enough is half the shorter of the intervals around either spike, so that a
    pair never reaches across a neighbour.
    """
    ours = np.asarray(measured, dtype=np.float64)
    theirs = np.asarray(predicted, dtype=np.float64)
    if ours.size == 0 or theirs.size == 0:
        nothing = np.empty(0)
        return Matched(nothing, nothing, theirs.size, ours.size, nothing)
    to_theirs = _nearest(ours, theirs)
    to_ours = _nearest(theirs, ours)
    mutual = to_ours[to_theirs] == np.arange(ours.size)
    offsets = ours - theirs[to_theirs]
    room = WITHIN * np.minimum(_interval(ours), _interval(theirs)[to_theirs])
    paired = mutual & (np.abs(offsets) <= room)
    index = np.flatnonzero(paired)
    both = paired[1:] & paired[:-1] & (np.diff(to_theirs) == 1)
    rate_error = np.diff(theirs[to_theirs])[both] / np.diff(ours)[both] - 1
    return Matched(
        ours[index],
        offsets[index],
        int(theirs.size - index.size),
        int(ours.size - index.size),
        rate_error,
    )


def _nearest(of: FloatArray, among: FloatArray) -> NDArray[np.intp]:
    after = np.clip(np.searchsorted(among, of), 0, among.size - 1)
    before = np.maximum(after - 1, 0)
    closer = np.abs(among[before] - of) <= np.abs(among[after] - of)
    return np.where(closer, before, after)


def _interval(times: FloatArray) -> FloatArray:
    """The shorter interval beside each spike; endless for a lone one."""
    gaps = np.diff(times)
    before = np.append(np.inf, gaps)
    after = np.append(gaps, np.inf)
    shorter: FloatArray = np.minimum(before, after)
    return shorter
