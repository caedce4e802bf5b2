"""The twin: the model driven by what the coil really did, beside what was measured."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.analysis.belief import PART
from tactile_lab.analysis.spike_pairs import Matched, by_cause, match, together
from tactile_lab.arrays import FloatArray
from tactile_lab.deviation import DrivenCircuit
from tactile_lab.errors import ParameterError
from tactile_lab.long_waveform import AnyWaveform
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import ErrorEstimate
from tactile_lab.model.slices import Samples, slices
from tactile_lab.model.state import Start

NARROW = 1e-3
"""A signal hardly bends within bins narrower than this, s."""
LONGEST, MOST = 10e-3, 32
"""In others the model's mean is that of parts, none longer than this, s: a vibration of
100 Hz has one period in it. At most so many in a bin."""
NODES, WEIGHTS = (found / 2 for found in np.polynomial.legendre.leggauss(8))
"""Where in a part the model is asked, from its middle, and what each counts."""


@dataclass(frozen=True, eq=False)
class Measured:
    """One measured voltage, decimated.

    Attributes:
        signal: "V_C1" or "V_C2".
        time: shape (n,), middle of each bin, s.
        value: shape (n,), mean of each bin, V.
        resolution: one code of the channel, V; what its mean may be off by.
        offset: half of the 95 % band of its follower's offset, V.
        steps: how far the mean of a bin may be off by the converter's steps, V.
        width: of a bin, s; 0 for values at an instant.
    """

    signal: str
    time: FloatArray
    value: FloatArray
    resolution: float = 0.0
    offset: float = 0.0
    steps: float = 0.0
    width: float = 0.0

    def samples(self, duration: float) -> Samples:
        """Takes of the model, over `duration` s, what its mean in each bin is of."""
        if self.width < NARROW:
            return Samples(self.signal, self.time[:, None], duration)
        parts = self._parts
        middles = (np.arange(parts) + 0.5) / parts - 0.5
        within = np.add.outer(middles, NODES / parts).ravel() * self.width
        at = np.clip(self.time[:, None] + within, 0.0, duration)
        return Samples(self.signal, at, duration)

    def means(self, taken: Samples) -> FloatArray:
        """Of the model in each bin, shape (n,), V, by what `samples` took."""
        if self.width < NARROW:
            return taken.value[:, 0]
        parts = self._parts
        return taken.value @ (np.tile(WEIGHTS, parts) / parts)

    def staircase(self, voltage: FloatArray) -> FloatArray:
        """What the converter's steps may put bins of that mean off by, V; (n, 2).

        The first term of the staircase's Fourier series, a sine of the voltage with one
        code for its period: its sine and its cosine, as large as without any noise. In
        a bin that passes over codes less of it is left.
        """
        if self.resolution == 0 or voltage.size < 2:
            return np.zeros((voltage.size, 2))
        codes = voltage / self.resolution
        passed = np.gradient(codes, self.time) * self.width
        left = self.resolution / math.pi * np.sinc(passed)
        phase = 2 * np.pi * codes
        return np.column_stack([left * np.sin(phase), left * np.cos(phase)])

    @property
    def _parts(self) -> int:
        return min(max(math.ceil(self.width / LONGEST), 1), MOST)


@dataclass(frozen=True, eq=False)
class Residual:
    """Measured less predicted.

    Attributes:
        signal: which.
        time: shape (n,), s.
        predicted: shape (n,), V.
        difference: shape (n,), V; not a number where a spike falls into the bin.
        open: shape (n,) each, V: what each cause of uncertainty leaves open, either
            sign, by its name.
    """

    signal: str
    time: FloatArray
    predicted: FloatArray
    difference: FloatArray
    open: Mapping[str, FloatArray]

    @property
    def tolerance(self) -> FloatArray:
        """Shape (n,), V: what all causes leave open together, either sign."""
        return together(self.open, self.time.size)

    @property
    def within(self) -> float:
        """Part of the bins whose difference lies within the tolerance, 0 to 1."""
        told = np.isfinite(self.difference)
        inside = np.abs(self.difference[told]) <= self.tolerance[told]
        return float(np.mean(inside)) if inside.size else float("nan")

    @property
    def offset(self) -> float:
        """Mean difference, V."""
        return float(np.mean(self._told)) if self._told.size else float("nan")

    @property
    def rms(self) -> float:
        """Root mean square of the difference, V."""
        return float(np.sqrt(np.mean(self._told**2))) if self._told.size else np.nan

    @property
    def band(self) -> float:
        """95 % of the differences are smaller in magnitude than this, V."""
        if not self._told.size:
            return float("nan")
        return float(np.percentile(np.abs(self._told), 95))

    @property
    def _told(self) -> FloatArray:
        told: FloatArray = self.difference[np.isfinite(self.difference)]
        return told


@dataclass(frozen=True, eq=False)
class Twin:
    """The model beside one run.

    Attributes:
        error: largest that the simulation estimates of itself.
        residuals: per measured voltage.
        spikes: matched, or None where none were measured.
    """

    error: ErrorEstimate
    residuals: tuple[Residual, ...]
    spikes: Matched | None

    def residual(self, signal: str) -> Residual | None:
        """That signal's residual, or None."""
        return next((r for r in self.residuals if r.signal == signal), None)


def twin(
    circuit: Circuit,
    force: AnyWaveform,
    duration: float,
    *,
    voltages: Sequence[Measured] = (),
    spike_times: ArrayLike | None = None,
    pauses: Sequence[tuple[float, float]] = (),
    start: Start | None = None,
    displaced: Iterable[tuple[str, DrivenCircuit]] = (),
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
        displaced: circuit and force moved by `PART` of the 95 % band of each
            independent cause of uncertainty, and its name: what the model makes of
            them is the tolerance.

    Raises:
        ParameterError: nothing to compare with, or times beyond the run.
    """
    keep = [trace.signal for trace in voltages]
    if spike_times is not None or "V_C2" in keep:
        keep.append("spikes")
    if not keep:
        raise ParameterError("A twin needs a measured voltage or spikes to compare.")
    compared = [_within(trace, duration) for trace in voltages]

    def seen(driven: DrivenCircuit) -> _Seen:
        errors, spikes = [], []
        samples = [trace.samples(duration) for trace in compared]
        for part in slices(*driven, keep=tuple(keep), until=duration, start=start):
            errors.append(ErrorEstimate.of(part))
            spikes.append(part.spike_times)
            for taken in samples:
                taken.take(part)
        return _Seen(
            ErrorEstimate.largest(errors),
            np.concatenate(spikes) if "spikes" in keep else None,
            [t.means(taken) for t, taken in zip(compared, samples, strict=True)],
        )

    found = seen(DrivenCircuit(circuit, force))
    causes = [(name, seen(moved)) for name, moved in displaced]
    predicted = found.spikes
    matched = None
    if spike_times is not None and predicted is not None:
        matched = match(
            spike_times,
            _streamed(predicted, pauses),
            [(name, _streamed(other.spikes, pauses)) for name, other in causes],
        )
    measured_spikes = np.empty(0) if spike_times is None else np.asarray(spike_times)
    jumps = measured_spikes if predicted is None else np.r_[measured_spikes, predicted]
    residuals = tuple(
        _residual(
            trace,
            found.values[i],
            [(name, other.values[i]) for name, other in causes],
            np.sort(jumps),
        )
        for i, trace in enumerate(compared)
    )
    return Twin(found.error, residuals, matched)


@dataclass(frozen=True, eq=False)
class _Seen:
    """What is compared of one solution: its own error, spikes, means of the bins."""

    error: ErrorEstimate
    spikes: FloatArray | None
    values: Sequence[FloatArray]


def _within(trace: Measured, duration: float) -> Measured:
    """The bins of the run."""
    inside = (trace.time >= 0) & (trace.time <= duration)
    return replace(trace, time=trace.time[inside], value=trace.value[inside])


def _streamed(
    spikes: FloatArray | None, pauses: Sequence[tuple[float, float]]
) -> FloatArray:
    """The spikes outside the pauses."""
    seen = np.empty(0) if spikes is None else spikes
    for begin, end in pauses:
        seen = seen[(seen < begin) | (seen >= end)]
    return seen


def _residual(
    trace: Measured,
    predicted: FloatArray,
    causes: Sequence[tuple[str, FloatArray]],
    jumps: FloatArray,
) -> Residual:
    time = trace.time
    difference = trace.value - predicted
    if trace.signal == "V_C2" and jumps.size and time.size > 1:
        half = float(np.median(np.diff(time)))
        after = np.searchsorted(jumps, time - half)
        near = np.minimum(after, jumps.size - 1)
        hit = (after < jumps.size) & (jumps[near] <= time + half)
        difference = np.where(hit, np.nan, difference)
    moved = ((name, (other - predicted) / PART) for name, other in causes)
    channel = (
        (name, np.full(time.size, volts))
        for name, volts in (("follower", trace.offset), ("codes", trace.resolution))
        if volts > 0
    )
    return Residual(
        trace.signal, time, predicted, difference, by_cause((*channel, *moved))
    )
