"""Sines of rising frequency: the dynamic response within the bench's bandwidth."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from tactile_lab.analysis.response import FEWEST, Gain, gain
from tactile_lab.arrays import FloatArray
from tactile_lab.conclusion import Conclusion, Table
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.measurement import MeasuredTrial, Measurement
from tactile_lab.plot import Panel, Plot, Series
from tactile_lab.quantity import (
    Duration,
    Force,
    Pause,
    Unit,
    plus_minus,
    printed,
)
from tactile_lab.stimulus.force import ForceProtocol
from tactile_lab.stimulus.frequencies import (
    Frequency,
    by_label,
    check_rising,
    spaced,
)
from tactile_lab.stimulus.recovery import TABLE_1_TAU
from tactile_lab.trial import Trial, Trials
from tactile_lab.waveform import Waveform

PushForce = Annotated[float, Unit("N", above=0.0)]

POINTS = 24
"""Straight pieces a cycle is drawn with: within 0.9 % of a sine."""
RAMP = 0.1
"""Time from one frequency's last force to the next one's first, s; less where a sine is
so fast that its film would not be settled then."""
WITHIN = 16
"""Points in a bin at which the force is averaged, as V_C1 and the model's are."""


class SineSweep(ForceProtocol):
    """A sine force at each of some frequencies, with whole cycles of each.

    The film's leak makes V_P a high-pass of force with its corner at 1/(2 pi tau), 18
    mHz: the adaptation itself. Each sine begins at the phase at which the film is
    already settled, so that no cycle is wasted on a transient. A source that is set
    over a serial line follows about 1/20 of its update rate; the plan warns where a
    frequency is beyond that.
    """

    name: ClassVar[str] = "sine_sweep"
    title: ClassVar[str] = "Sine sweep"
    signals: ClassVar[tuple[str, ...]] = ("force", "coil_current", "V_C1", "I_DS")

    amplitude: PushForce = Field(default=0.05, description="Of the sine")
    bias: Force = Field(default=0.0, description="Force the sine swings around")
    lowest: Frequency = Field(default=0.01, description="First frequency")
    highest: Frequency = Field(default=0.8, description="Last frequency")
    count: int = Field(
        default=5, ge=1, le=1000, title="Frequencies", description="Frequencies"
    )
    cycles: int = Field(default=2, ge=2, le=10_000, description="Cycles of each")
    settle: Pause | None = Field(
        default=None, description="Time at the bias first; six tau of the film if empty"
    )
    tau: Duration | None = Field(
        default=None, description="Leakage time of the film; the sensor's if empty"
    )

    @model_validator(mode="after")
    def _rising(self) -> SineSweep:
        check_rising(self.lowest, self.highest)
        return self

    def frequencies(self) -> list[float]:
        """The frequencies, evenly spaced on a logarithmic scale, Hz."""
        return spaced(self.lowest, self.highest, self.count)

    def on_sensor(self, tau: float, volts_per_newton: float) -> Self:
        """With what the scene does not say taken from the sensor."""
        return self if self.tau else self.model_copy(update={"tau": tau})

    def presentations(self) -> Trials:
        """One trial per frequency."""
        last, lead = _Settled(0.0, 0.0), self._settling
        labels = {frequency: label for label, frequency in self._by_label.items()}
        for frequency in self.frequencies():
            ramp = min(RAMP, 1 / (4 * math.pi * frequency))
            first, after = last.onto(frequency, ramp, self._leak)
            force = self._sine(frequency, first, last.force, lead, ramp)
            yield Trial(
                force=force,
                label=labels[frequency],
                hold=(lead + ramp, force.end),
            )
            last, lead = after, 0.0
        end = self.bias + self.amplitude * last.force
        yield Trial(
            force=Waveform.through([(0.0, end), (0.25, 0.0), (0.5, 0.0)]),
            label="back to rest",
        )

    @property
    def _by_label(self) -> dict[str, float]:
        return by_label(self.frequencies(), 3)

    @property
    def _settling(self) -> float:
        """Time before the first sine, s: what a bias leaves of V_P dies away."""
        if self.settle is not None:
            return 0.25 + self.settle
        return 0.25 + 6 * self._leak if self.bias else 0.0

    @property
    def _leak(self) -> float:
        return self.tau or TABLE_1_TAU

    def _sine(
        self, frequency: float, first: float, last: float, lead: float, ramp: float
    ) -> Waveform:
        """From the force `last` of the amplitude onto the sine at phase `first`."""
        points = [(0.0, self.bias + self.amplitude * last)]
        if lead > 0:
            points = [(0.0, 0.0), (0.25, self.bias), (lead, self.bias)]
        phase = np.arange(POINTS * self.cycles + 1) / POINTS
        values = self.bias + self.amplitude * np.sin(2 * np.pi * phase + first)
        values[-1] = values[0]
        times = lead + ramp + phase / frequency
        points += zip(times.tolist(), values.tolist(), strict=True)
        return Waveform.through(points)

    def conclude(self, run: Measurement) -> Conclusion:
        """Gain and phase of V_C1 per frequency, and how far the model's gain is off."""
        if run.trace("V_C1") is None:
            return Conclusion(missing=("No gain: V_C1 was not recorded.",))
        labels = self._by_label
        found = _gains(run, labels)
        expected = _gains(run, labels, model=True)
        known = {g.frequency for g in found}
        missing = tuple(
            f"No gain at {t.label}: {_why_none(run, t.held)}"
            for t in run.results
            if t.held is not None and t.label in labels
            if labels[t.label] not in known
        )
        if not found:
            none = ("No gain: no frequency was completed.",)
            return Conclusion(missing=missing or none)
        said = [_summary(found)]
        said += run.not_stated
        beside = {e.frequency: e for e in expected}
        pairs = [(g, beside[g.frequency]) for g in found if g.frequency in beside]
        if pairs:
            off = max(abs(g.gain.value / e.gain.value - 1) for g, e in pairs)
            said.append(f"The model's gain differs by {100 * off:.2g} % at most.")
        values = [
            {
                "frequency_Hz": g.frequency,
                "gain_V_per_N": g.gain,
                "phase_rad": g.phase,
            }
            for g in found
        ]
        table = Table(
            title="Gain and phase of V_C1 over force",
            headings=("Frequency", "Gain, V/N", "Phase, °", "Model", "Model, °"),
            rows=tuple(_row(g, beside.get(g.frequency)) for g in found),
            note="± are 95 % intervals; the model's are of the same force.",
        )
        return Conclusion(
            tuple(said), {"V_C1_over_force": values}, missing, tables=(table,)
        )

    def plots(self, run: Measurement) -> Iterator[Plot]:
        """Gain and phase against frequency."""
        found = _gains(run, self._by_label)
        expected = _gains(run, self._by_label, model=True)
        if len(found) < 2:
            return
        at = tuple(g.frequency for g in found)
        measured: Any = {"x": at, "mark": "points", "colour": "V_C1"}
        model: Any = {
            "x": [g.frequency for g in expected], "mark": "dashed", "colour": "model",
        }  # fmt: skip
        yield Plot(
            name="summary",
            title="gain and phase",
            caption="V_C1 against force at each frequency: gain and phase with their "
            "95 % intervals. Dashed: the model under the same force.",
            x_label="Frequency",
            x_unit="Hz",
            x_prefix="",
            x_log=True,
            x_ticks=at,
            panels=(
                Panel(
                    label="Gain",
                    unit="V/N",
                    series=(
                        Series(
                            y=[g.gain.value for g in found],
                            y_error=[g.gain.half for g in found],
                            name=run.origin,
                            **measured,
                        ),
                        Series(
                            y=[g.gain.value for g in expected], name="model", **model
                        ),
                    ),
                    log=True,
                    limits=_powers([g.gain.value for g in (*found, *expected)]),
                    height=1.8,
                ),
                Panel(
                    label="Phase",
                    unit="°",
                    series=(
                        Series(
                            y=[_degrees(g.phase.value) for g in found],
                            y_error=[math.degrees(g.phase.half) for g in found],
                            **measured,
                        ),
                        Series(y=[_degrees(g.phase.value) for g in expected], **model),
                    ),
                    height=1.55,
                ),
            ),
        )


@dataclass(frozen=True)
class _Settled:
    """Where a sine has ended: its force, and V_P/k_F, as parts of the amplitude."""

    force: float
    film: float

    def onto(self, frequency: float, ramp: float, tau: float) -> tuple[float, _Settled]:
        """Phase at which to begin after a `ramp`, s, rad, and where that sine ends.

        The film passes on i w tau/(1 + i w tau) = cos(a) exp(i a) of a sine: at its
        phase p it is settled where V_P/k_F is cos(a) sin(p + a), Eq. (7).
        """
        lead = math.atan(1 / (2 * math.pi * frequency * tau))
        left = math.exp(-ramp / tau)
        passed = tau / ramp * (1 - left)
        wanted = passed * self.force - self.film * left
        one, two = passed - math.cos(lead) ** 2, math.cos(lead) * math.sin(lead)
        reach = min(1.0, max(-1.0, wanted / math.hypot(one, two)))
        first = math.atan2(two, one) + math.asin(reach)
        film = math.cos(lead) * math.sin(first + lead)
        return first, _Settled(math.sin(first), film)


def _gains(
    run: Measurement, labels: Mapping[str, float], *, model: bool = False
) -> list[Gain]:
    """Gain of V_C1 over the force, V/N, for each trial of a frequency, by its label."""
    trace, found = run.trace("V_C1", model=model), []
    steps = 0.0 if model else run.step_bias("V_C1")
    code = None if trace is None or model else trace.code
    leak = None if run.circuit is None else run.circuit.tau
    for trial in run.results:
        frequency = labels.get(trial.label)
        if trace is None or frequency is None or trial.held is None:
            continue
        if run.left_range("V_C1", *trial.held):
            continue
        inside = (trace.time >= trial.held[0]) & (trace.time <= trial.held[1])
        time = trace.time[inside]
        force = _averaged(run.force, time)
        try:
            answer = gain(time, force, trace.mean[inside], frequency, steps, code, leak)
        except NotIdentifiableError:
            continue  # it was cut short
        found.append(answer if model else _known(run, trial, answer))
    return found


def _why_none(run: Measurement, held: tuple[float, float]) -> str:
    """Why there is no gain of a trial, held from and to, s."""
    if run.left_range("V_C1", *held):
        return "V_C1 left its channel's range."
    return (
        f"fewer than {FEWEST} cycles of it are left from where the force is on its "
        "sine. Ask for more with protocol.cycles."
    )


def _summary(found: Sequence[Gain]) -> str:
    """Gain and phase from the lowest frequency to the highest, in a sentence."""
    first, last = (_row(gain, None) for gain in (found[0], found[-1]))
    if len(found) == 1:
        return (
            f"At {first[0]} the gain of V_C1 over force is {first[1]} V/N, its phase "
            f"{first[2]}° (95 %)."
        )
    return (
        f"From {first[0]} to {last[0]} the gain of V_C1 over force goes from "
        f"{first[1]} to {last[1]} V/N, its phase from {first[2]}° to {last[2]}° (95 %)."
    )


def _row(found: Gain, model: Gain | None) -> tuple[str, ...]:
    """One frequency of the table."""
    cells = [
        f"{found.frequency:.3g} Hz",
        plus_minus(found.gain.value, found.gain.half),
        plus_minus(_degrees(found.phase.value), math.degrees(found.phase.half)),
    ]
    if model is None:
        cells += ["—", "—"]
    else:
        # to the digit to which the bench's are known, so that they can be compared
        size = plus_minus(model.gain.value, found.gain.half)
        phase = plus_minus(_degrees(model.phase.value), math.degrees(found.phase.half))
        cells += [text.partition(" ±")[0] for text in (size, phase)]
    return tuple(printed(cell) for cell in cells)


def _powers(values: list[float]) -> tuple[float, float]:
    """The powers of ten on either side of all values, as a Bode plot has them."""
    low, high = np.log10(min(values)), np.log10(max(values))
    return 10.0 ** math.floor(low), 10.0 ** (math.floor(high) + 1)


def _averaged(force: Waveform, time: FloatArray) -> FloatArray:
    """Mean force in bins around `time`: steps of the source are no longer than they."""
    width = float(np.median(np.diff(time))) if time.size > 1 else 0.0
    within = ((np.arange(WITHIN) + 0.5) / WITHIN - 0.5) * width
    mean: FloatArray = force.at(time[:, None] + within).mean(axis=1)
    return mean


def _degrees(phase: float) -> float:
    """Between -360 and 0: V_C1 falls when the force rises, and lags."""
    return float(np.degrees(phase)) - (360.0 if phase > 0 else 0.0)


def _known(run: Measurement, trial: MeasuredTrial, found: Gain) -> Gain:
    """Force and lag on the gain, clocks and lag on the phase."""
    size, phase, late = found.gain, found.phase, run.turned(found.frequency)
    if run.force_uncertainty is not None:
        part = float(run.force_uncertainty.of(found.amplitude)) / found.amplitude
        size = size.widened(size.value * part)
    clock = 2 * math.pi * found.frequency * (trial.clock_uncertainty or 0.0)
    return replace(
        found,
        gain=size.widened(size.value * (1 / abs(late) - 1)),
        phase=phase.widened(clock, cmath.phase(late)),
    )
