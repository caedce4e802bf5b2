"""What one run measured, as plain values: what a protocol concludes from and draws.

It knows neither how a run is stored nor how it was made; whoever has a run fills it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tactile_lab.analysis.adaptation import Adaptation, fit_adaptation
from tactile_lab.analysis.carried_over import Begun, remembered
from tactile_lab.analysis.converter import step_bias
from tactile_lab.analysis.estimate import standard_error
from tactile_lab.analysis.spike_train import Response, respond
from tactile_lab.arrays import FloatArray
from tactile_lab.conclusion import GEOMETRY_NOT_STATED, NOT_STATED
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.lag import Lag
from tactile_lab.magnetics import ForceUncertainty
from tactile_lab.model.circuit import Circuit
from tactile_lab.quantity import count
from tactile_lab.signals import DAGGER, Source
from tactile_lab.waveform import Waveform

if TYPE_CHECKING:
    from tactile_lab.analysis.circuit_adaptation import CircuitAdaptation


CUT_OFF = "spikes could not be told all of the time: their channel left its range"
BETWEEN_SAMPLES = "spikes are missed: one fits between two samples of V_K"
TOO_FAST = "spikes come faster than the circuit can fire; raise the threshold"
"""Why a trial has no latency, rate or fit: its spikes are not all counted, or are not
the circuit's."""
NOT_HELD = "no one force is held"
"""Why a trial has no adaptation: without a level its force changes all the time."""

SETTLING = 0.3
"""Time after a late set-point until the field read is that of its current, s."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedSignal:
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
        overrange: stretches in which it left its channel's range, shape (k, 2), s.
        samples: of the converter in a bin.
    """

    signal: str
    time: FloatArray
    mean: FloatArray
    low: FloatArray | None = None
    high: FloatArray | None = None
    source: Source = "measured"
    scale: float = 1.0
    code: float | None = None
    overrange: FloatArray = dataclasses.field(default_factory=lambda: np.empty((0, 2)))
    samples: float = 1.0

    @cached_property
    def within_range(self) -> NDArray[np.bool_]:
        """Which bins, shape (n,), hold nothing that was cut off at the range's end."""
        half = float(np.median(np.diff(self.time))) / 2 if self.time.size > 1 else 0.0
        inside = np.ones(self.time.size, np.bool_)
        for start, end in self.overrange:
            inside &= (self.time + half <= start) | (self.time - half >= end)
        return inside


def unlike_asked(*, complete: bool, skipped: int) -> str:
    """What stands behind a trial that was not played as asked for; "" if it was."""
    cut = "" if complete else ", cut short"
    return f"{cut}, {count(skipped, 'set-point')} skipped" if skipped else cut


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredTrial:
    """One trial of the run.

    Attributes:
        label: for people ("120 mN").
        level: force the result is filed under, N; None where there is no one level.
        start: on the run's time axis, s.
        duration: s.
        spike_times: shape (k,), s from the trial's start.
        onset: when the force begins to change, s from the trial's start; None where it
            never does.
        hold: (start, end) of the constant part, s from the trial's start, or None: from
            when the force applied was there to when it began to leave, no earlier than
            asked.
        pause: a planned recovery; listed nowhere but in the time axis.
        rest: V_C1 just before the trial, V, or None.
        drift: change of that since the first trial, V, less what the film still
            remembers of the forces; None where it was not judged.
        complete: it came to its end; what was cut short has the spikes it gave, and
            the part of its hold that was held.
        clock_uncertainty: bound on how far spike times lie from the coil's, s: how well
            the scope's clock is aligned with the host's; None if not known.
        uncounted: why its spikes are no count, `CUT_OFF`, `BETWEEN_SAMPLES` or
            `TOO_FAST`: those seen are told, and no latency, rate or fit. "" where they
            are one.
        skipped: the coil's set-points that came too late: its force was not all that
            was asked for.
    """

    label: str
    level: float | None
    start: float
    duration: float
    spike_times: FloatArray
    onset: float | None = 0.0
    hold: tuple[float, float] | None = None
    pause: bool = False
    rest: float | None = None
    drift: float | None = None
    complete: bool = True
    clock_uncertainty: float | None = None
    uncounted: str = ""
    skipped: int = 0

    @property
    def name(self) -> str:
        """What its protocol calls it, whether it came to its end, and as asked for."""
        return self.label + unlike_asked(complete=self.complete, skipped=self.skipped)

    @property
    def came(self) -> float:
        """Time the force took to be there, s; 0 without a hold."""
        return 0.0 if self.hold is None else self.hold[0] - (self.onset or 0.0)

    @property
    def held(self) -> tuple[float, float] | None:
        """(start, end) of the constant part on the run's time axis, s, or None."""
        if self.hold is None:
            return None
        return self.start + self.hold[0], self.start + self.hold[1]

    @cached_property
    def response(self) -> Response:
        """Its spikes described: count, latency, highest and final rate, fall."""
        found = respond(self.spike_times, onset=self.onset, hold=self.hold)
        return found.counted if self.uncounted else found

    @property
    def seen(self) -> str:
        """How many spikes were seen, marked by † where they are not all counted."""
        return f"{self.spike_times.size}{DAGGER if self.uncounted else ''}"

    @property
    def adaptation(self) -> Adaptation | None:
        """The decay of the rate in the hold; None where `why_not` says why."""
        return self._fitted[0]

    @property
    def why_not(self) -> str:
        """Why there is no `adaptation`; "" where there is one."""
        return self._fitted[1]

    @cached_property
    def _fitted(self) -> tuple[Adaptation | None, str]:
        if self.uncounted:
            return None, self.uncounted
        if self.response.spikes == 0:
            return None, "no spikes"
        if self.hold is None:
            return None, "no hold"
        if self.level is None:
            return None, NOT_HELD
        try:
            return fit_adaptation(self.spike_times, self.hold), ""
        except NotIdentifiableError as error:
            return None, f"not identifiable: {error}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Measurement:
    """What one run measured, and under which conditions.

    Attributes:
        simulated: whether the bench's physics was computed.
        bench: its name.
        started: date and time as "2026-11-21 12:27:20", or "".
        duration: of the experiment, s.
        trials: in order, pauses included.
        force: N on the run's time axis, as applied (limited and stepped).
        current: applied coil current as read back, shape (n, 2), s and A, or None.
        warming: of the coil's winding from the first to the last look at its
            resistance, K; None where it was not looked at twice.
        force_uncertainty: what calibration and geometry leave open; None where
            neither states any.
        field_per_ampere: B2 over current as assumed or calibrated, T/A, or None.
        newtons_per_tesla: force over B2 by Eq. (2), N/T, or None.
        field: teslameter readings, shape (m, 2), s and T, or None.
        temperature: of the sensor as it was read, shape (m, 2), s and K, or None.
        voltages: what source meters were read back to hold, by the circuit's voltage,
            shape (m, 2), s and V.
        traces: decimated signals, the derived I_DS and the model's V_C1 among them.
        circuit: the sensor as it is believed to be, to compare with, or None.
        listed: whether the current was played as a waveform, not as set-points.
        displaced: by cause, "follower" or "temperature", the circuit with what is not
            known of it at the end of its 95 % band.
        lag: of the force behind the set-point.
        lag_uncertainty: half of the 95 % band of both of its lags together, s; None
            where the bench does not state it.
        searched: whether spikes were looked for.
        settings: settings read back, by instrument, then by name.
        conditions: temperature, operator, sensor and notes, as text by name.
    """

    simulated: bool
    bench: str
    duration: float
    trials: tuple[MeasuredTrial, ...]
    force: Waveform
    started: str = ""
    current: FloatArray | None = None
    warming: float | None = None
    force_uncertainty: ForceUncertainty | None = None
    field_per_ampere: float | None = None
    newtons_per_tesla: float | None = None
    field: FloatArray | None = None
    temperature: FloatArray | None = None
    voltages: Mapping[str, FloatArray] = dataclasses.field(default_factory=dict)
    traces: tuple[RecordedSignal, ...] = ()
    circuit: Circuit | None = None
    displaced: Mapping[str, Circuit] = dataclasses.field(default_factory=dict)
    listed: bool = False
    lag: Lag = dataclasses.field(default_factory=Lag)
    lag_uncertainty: float | None = None
    searched: bool = True
    settings: Mapping[str, Mapping[str, str]] = dataclasses.field(default_factory=dict)
    conditions: Mapping[str, str] = dataclasses.field(default_factory=dict)

    @cached_property
    def results(self) -> tuple[MeasuredTrial, ...]:
        """Trials with something to say: no pauses, no silent looks at the rest."""
        played = tuple(trial for trial in self.trials if not trial.pause)
        telling = tuple(
            t
            for t in played
            if t.level is not None or t.hold is not None or t.spike_times.size
        )
        return telling or played

    @property
    def clock_uncertainty(self) -> float | None:
        """How well sample clock and coil are aligned, s; None if not known."""
        known = [t.clock_uncertainty for t in self.results if t.clock_uncertainty]
        return max(known, default=None)

    def late(self, force: Waveform) -> Waveform:
        """Some of the force if its lags are at the end of their 95 % band, N.

        As it is where the bench does not state how well they are known.
        """
        later = self.lag_uncertainty
        return self.lag.late(force, later) if later else force

    def turned(self, frequency: float) -> complex:
        """A sine of that force over the force believed, at a frequency in Hz."""
        return self.lag.turned(frequency, self.lag_uncertainty or 0.0)

    def left_in_film(self, trials: Iterable[MeasuredTrial]) -> float:
        """The most that forces before left in the film as some trials began, as N.

        Of those that begin under no force; 0 without a circuit, which has the film.
        """
        if self.circuit is None:
            return 0.0
        pressed = [Begun(t.label, t.start, t.level) for t in self.results if t.level]
        starts = {trial.start for trial in trials}
        held = [
            left
            for one, left in remembered(self.circuit, self.force, pressed)
            if one.start in starts
        ]
        return max(held, key=abs, default=0.0)

    def circuit_adaptation(
        self, trial: MeasuredTrial
    ) -> tuple[CircuitAdaptation | None, str]:
        """The circuit's own law fitted to a trial's hold, or None and why not.

        The hold counts from when node A had followed the force applied.
        """
        if trial.start not in self._circuit_fits:
            self._circuit_fits[trial.start] = self._fit_circuit(trial)
        return self._circuit_fits[trial.start]

    @cached_property
    def _circuit_fits(self) -> dict[float, tuple[CircuitAdaptation | None, str]]:
        return {}

    def _fit_circuit(
        self, trial: MeasuredTrial
    ) -> tuple[CircuitAdaptation | None, str]:
        if trial.uncounted:
            return None, trial.uncounted
        if trial.hold is not None and trial.level is None:
            return None, NOT_HELD
        if self.circuit is None or trial.hold is None:
            return None, "no hold, or no circuit to compare with"
        from tactile_lab.analysis.circuit_adaptation import (
            fit_circuit_adaptation,
            followed,
        )

        hold = trial.hold[0] + followed(self.circuit, trial.came), trial.hold[1]
        try:
            found = fit_circuit_adaptation(
                self.circuit, trial.spike_times, hold, self.displaced.values()
            )
        except NotIdentifiableError as error:
            return None, str(error)
        return found, ""

    @property
    def origin(self) -> str:
        """For legends: "simulated bench" or "measured"."""
        return "simulated bench" if self.simulated else "measured"

    @property
    def spike_times(self) -> FloatArray:
        """All spikes outside pauses, shape (k,), s on the run's time axis."""
        played = [t.spike_times + t.start for t in self.trials if not t.pause]
        return np.concatenate(played or [np.empty(0)])

    def trace(self, signal: str, *, model: bool = False) -> RecordedSignal | None:
        """The measured or derived trace of `signal`, or the model's; None if none."""
        return next(
            (
                t
                for t in self.traces
                if t.signal == signal and (t.source == "model") == model
            ),
            None,
        )

    def mean(
        self, signal: str, start: float, end: float, *, cut_off: bool = False
    ) -> float:
        """Mean of a signal in [start, end] s, SI.

        Not a number where it has none there, or left its channel's range; with
        `cut_off` the mean of what was shown all the same.
        """
        trace = self.trace(signal)
        if trace is None or (not cut_off and self.left_range(signal, start, end)):
            return float("nan")
        inside = (trace.time >= start) & (trace.time <= end)
        return float(trace.mean[inside].mean()) if inside.any() else float("nan")

    def error_of_mean(self, signal: str, start: float, end: float) -> float:
        """Standard error of a signal's mean in [start, end] s by its scatter, SI.

        0 with fewer than two values there. A hum, a ramp or steps count as scatter.
        """
        trace = self.trace(signal)
        if trace is None:
            return 0.0
        return standard_error(trace.mean[(trace.time >= start) & (trace.time <= end)])

    def left_range(self, signal: str, start: float, end: float) -> bool:
        """Whether a signal left its channel's range within [start, end] s."""
        trace = self.trace(signal)
        if trace is None:
            return False
        begins, ends = trace.overrange.T
        return bool(np.any((begins <= end) & (ends >= start)))

    def step_bias(
        self, signal: str, start: float = -math.inf, end: float = math.inf
    ) -> float:
        """How far means of a signal may be off by its converter's steps, SI.

        By its noise in [start, end] s, of the whole run unless given.
        """
        trace = self.trace(signal)
        if trace is None or trace.code is None:
            return 0.0
        inside = (trace.time >= start) & (trace.time <= end)
        extent = None
        if trace.low is not None and trace.high is not None:
            extent = (trace.high - trace.low)[inside]
        return step_bias(trace.mean[inside], trace.code, trace.samples, extent)

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

    def field_held(self, trial: MeasuredTrial, after: float = 0.0) -> FloatArray:
        """Field read in a trial's hold, T; empty where it has none, or none was read.

        What was read until the current had settled is none of that hold. A trial
        without a level has its own time for it, and only a set-point that came after
        the hold's start, an answer of the source having been lost, needs more.

        Args:
            trial: of the run.
            after: part of the hold that is left out at its beginning, 0 to 1.
        """
        if trial.held is None:
            return np.empty(0)
        start, end = trial.held
        since, until = start, end
        if trial.level is not None:  # the force came before the middle, and to stay
            since, until = trial.start, (start + end) / 2
        steps = np.empty(0) if self.current is None else self.current[:, 0]
        late = steps[(steps > since) & (steps <= until)]
        begin = max([start + after * (end - start), *late[-1:] + SETTLING])
        return self.field_between(begin, end)

    def source_read(self, name: str, trial: MeasuredTrial) -> float | None:
        """Mean of what the source of a voltage read in a trial, V; None if nothing."""
        return _mean_in(trial, self.voltages.get(name))

    def temperature_in(self, trial: MeasuredTrial) -> float | None:
        """Mean temperature read in a trial, K; None where none was."""
        return _mean_in(trial, self.temperature)

    def source_error(self, name: str, volts: float) -> float | None:
        """Bound on the error of what the source of `name` reads, V; None: not known."""
        told = self.settings.get(f"source of {name}", {})
        try:
            return float(told["error_V"]) + float(told["error_part"]) * abs(volts)
        except (KeyError, ValueError):
            return None

    def current_at(self, time: float) -> float | None:
        """Applied coil current at `time` s, A; None before the first set-point."""
        if self.current is None:
            return None
        before = self.current[:, 0] <= time
        return float(self.current[before][-1, 1]) if before.any() else None

    def left_open(
        self, circuit: Circuit, of: Callable[[Circuit], float]
    ) -> dict[str, float | None]:
        """What is not known of `circuit` leaves open of a number, by cause.

        That is half of the 95 % band, in the number's unit; None where the scene does
        not state how well the temperature is known.
        """
        here = of(circuit)
        found: dict[str, float | None] = {
            cause: abs(of(other) - here) for cause, other in self.displaced.items()
        }
        found.setdefault("temperature", None)
        return found

    @property
    def not_stated(self) -> tuple[str, ...]:
        """What to say where no uncertainty of force, or not all, is carried along."""
        if self.force_uncertainty is None:
            return (NOT_STATED,)
        return (GEOMETRY_NOT_STATED,) if self.force_uncertainty.unstated else ()

    def uncertain(self, force: float | None) -> float | None:
        """Half of the 95 % band of `force` N, N; None where nothing is stated."""
        if force is None or self.force_uncertainty is None:
            return None
        return float(self.force_uncertainty.of(force))


def _mean_in(trial: MeasuredTrial, readings: FloatArray | None) -> float | None:
    """Mean of readings, shape (n, 2), s and SI, within a trial; None without any."""
    if readings is None:
        return None
    since = readings[:, 0] - trial.start
    inside = (since >= 0) & (since < trial.duration)
    return float(readings[inside, 1].mean()) if inside.any() else None
