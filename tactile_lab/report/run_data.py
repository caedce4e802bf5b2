"""What a report is written from: one run as plain, immutable values.

It knows neither how a run is stored nor how it was made; whoever has a run fills it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_lab.magnetics import ForceUncertainty
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.drain_current import Divider
from tactile_lab.model.state import Start
from tactile_lab.signals import Source
from tactile_lab.waveform import Waveform

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class TrialData:
    """One trial of the run.

    Attributes:
        label: for people ("120 mN").
        level: force the result is filed under, N; None where there is no one level.
        start: on the run's time axis, s.
        duration: s.
        spike_times: shape (k,), s from the trial's start.
        onset: when the stimulus begins, s from the trial's start.
        hold: (start, end) of the constant part, s from the trial's start, or None.
        pause: a planned recovery; listed nowhere but in the time axis.
        rest: V_C1 just before the trial, V, or None.
        drift: change of that since the first trial, V, less what the film still
            remembers of the forces; None where it was not judged.
        clock_uncertainty: bound on how far spike times lie from the coil's, s: how well
            the scope's clock is aligned with the host's; None if not known.
    """

    label: str
    level: float | None
    start: float
    duration: float
    spike_times: FloatArray
    onset: float = 0.0
    hold: tuple[float, float] | None = None
    pause: bool = False
    rest: float | None = None
    drift: float | None = None
    clock_uncertainty: float | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Trace:
    """One signal over the run, decimated to a few thousand bins.

    Attributes:
        signal: a name of `tactile_lab.signals`.
        time: shape (n,), middle of each bin, s on the run's time axis; a step more
            than 1.5 times the usual one is drawn as a gap.
        mean: shape (n,), SI.
        low, high: shape (n,), extremes within each bin, SI, or None.
        source: "measured", "derived" or "model".
        scale: unit per volt at the scope's input.
        code: one code of the converter, SI; None where it is not digitised.
    """

    signal: str
    time: FloatArray
    mean: FloatArray
    low: FloatArray | None = None
    high: FloatArray | None = None
    source: Source = "measured"
    scale: float = 1.0
    code: float | None = None


@dataclass(frozen=True, kw_only=True)
class Loss:
    """The loss certificate of a run.

    Attributes:
        samples_produced: by the scope, all channels; None if the run could not say.
        samples_stored: all channels.
        spikes_online: spikes found while the run went on.
        spikes: found by only one of the searches on line and in the stored samples;
            None where the searched channel was not stored.
        covered: time that has samples, s; None for a scope without gaps.
        streamed: time the scope was asked to see, s; None likewise.
        sentence: all of it: "loss: 0 of 72000000 samples, 0 of 47 spikes".
    """

    samples_produced: int | None
    samples_stored: int
    spikes_online: int
    spikes: int | None
    sentence: str
    covered: float | None = None
    streamed: float | None = None

    @property
    def samples(self) -> int | None:
        """Samples lost; None if not known."""
        if self.samples_produced is None:
            return None
        return self.samples_produced - self.samples_stored


@dataclass(frozen=True, kw_only=True, eq=False)
class RunData:
    """One run, ready to be reported.

    Attributes:
        title: the protocol's title.
        protocol: its name.
        scene: name of the scene.
        run: name of the run's folder.
        started: date and time for people.
        status: "complete", "aborted", "faulted" or "recovered".
        simulated: whether the bench's physics was computed.
        bench: its name.
        duration: of the experiment, s.
        took: wall time the run needed, s, or None.
        trials: in order.
        force: N on the run's time axis, as applied (limited and stepped).
        current: applied coil current as read back, shape (n, 2), s and A, or None.
        warming: of the coil's winding from the first to the last look at its
            resistance, K; None where it was not looked at twice.
        force_uncertainty: what calibration and geometry leave open; None where
            neither states any.
        field_per_ampere: B2 over current as assumed or calibrated, T/A, or None.
        newtons_per_tesla: force over B2 by Eq. (2), N/T, or None.
        field: teslameter readings, shape (m, 2), s and T, or None.
        traces: decimated signals; I_DS is derived from V_C1 where it is missing.
        circuit: the sensor as it is believed to be, to compare with, or None.
        start: voltages the circuit began with; None for the equilibrium.
        searched: V_K was searched for spikes.
        divider: parts around node A that I_DS is derived with.
        loss: counters, or None where nothing was acquired.
        accuracy: how accurate the simulation was, one sentence, or "".
        warnings: one sentence each.
        assumptions: one sentence each.
        parameters: the protocol's parameters as text by name.
        sensor: the sensor's parameters as text by name.
        settings: settings read back, by instrument, then by name.
        calibration: calibration of force and field, as text by name.
        conditions: temperature, operator, sensor and notes, as text by name.
        environment: versions and machine, as text by name.
    """

    title: str
    protocol: str
    run: str
    status: str
    simulated: bool
    bench: str
    duration: float
    trials: tuple[TrialData, ...]
    force: Waveform
    scene: str = ""
    started: str = ""
    took: float | None = None
    current: FloatArray | None = None
    warming: float | None = None
    force_uncertainty: ForceUncertainty | None = None
    field_per_ampere: float | None = None
    newtons_per_tesla: float | None = None
    field: FloatArray | None = None
    traces: tuple[Trace, ...] = ()
    circuit: Circuit | None = None
    start: Start | None = None
    searched: bool = True
    divider: Divider = dataclasses.field(default_factory=Divider)
    loss: Loss | None = None
    accuracy: str = ""
    warnings: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()
    parameters: Mapping[str, str] = dataclasses.field(default_factory=dict)
    sensor: Mapping[str, str] = dataclasses.field(default_factory=dict)
    settings: Mapping[str, Mapping[str, str]] = dataclasses.field(default_factory=dict)
    calibration: Mapping[str, str] = dataclasses.field(default_factory=dict)
    conditions: Mapping[str, str] = dataclasses.field(default_factory=dict)
    environment: Mapping[str, str] = dataclasses.field(default_factory=dict)

    def field_between(self, start: float, end: float) -> FloatArray:
        """Field read in [start, end] s of run time, T; empty where none was."""
        trace = self.trace("field")
        if self.field is not None and len(self.field):
            time, value = self.field.T
        elif trace is not None:
            time, value = trace.time, trace.mean
        else:
            return np.empty(0)
        found: FloatArray = value[(time >= start) & (time <= end)]
        return found

    def uncertain(self, force: float | None) -> float | None:
        """Half of the 95 % band of `force` N, N; None where nothing is stated."""
        if force is None or self.force_uncertainty is None:
            return None
        return float(self.force_uncertainty.of(force))

    def trace(self, signal: str, *, model: bool = False) -> Trace | None:
        """The measured or derived trace of `signal`, or the model's; None if none."""
        return next(
            (
                t
                for t in self.traces
                if t.signal == signal and (t.source == "model") == model
            ),
            None,
        )
