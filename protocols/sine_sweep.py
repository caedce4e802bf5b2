"""Sines of rising frequency: the dynamic response within the bench's bandwidth."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field, model_validator

from tactile_lab.analysis.estimate import Estimate
from tactile_lab.analysis.response import Gain, gain
from tactile_lab.conclusion import NOT_STATED, Conclusion
from tactile_lab.errors import NotIdentifiableError, QuantityError
from tactile_lab.measurement import Measurement
from tactile_lab.plot import Panel, Plot, Series
from tactile_lab.quantity import Force, Pause, Unit, parse, printed
from tactile_lab.stimulus.force import ForceProtocol
from tactile_lab.trial import Trial, Trials
from tactile_lab.waveform import Waveform

Frequency = Annotated[float, Unit("Hz", above=0.0)]
PushForce = Annotated[float, Unit("N", above=0.0)]

POINTS = 24
"""Straight pieces a cycle is drawn with: within 0.9 % of a sine."""
LARGE = 1000
"""Degrees of freedom of a gain: hundreds of bins a cycle."""


class SineSweep(ForceProtocol):
    """A sine force at each of some frequencies, with whole cycles of each.

    A source that is set over a serial line follows about 1/20 of its update rate; the
    plan warns where a frequency is beyond that.
    """

    name: ClassVar[str] = "sine_sweep"
    title: ClassVar[str] = "Sine sweep"
    signals: ClassVar[tuple[str, ...]] = ("force", "coil_current", "V_C1", "I_DS")

    amplitude: PushForce = Field(default=0.05, description="Of the sine")
    bias: Force = Field(default=0.0, description="Force the sine swings around")
    lowest: Frequency = Field(default=0.1, description="First frequency")
    highest: Frequency = Field(default=0.8, description="Last frequency")
    count: int = Field(default=5, ge=1, le=1000, description="Frequencies")
    cycles: int = Field(default=3, ge=1, le=10_000, description="Cycles of each")
    settle: Pause = Field(default=2.0, description="Time at the bias before each")

    @model_validator(mode="after")
    def _rising(self) -> SineSweep:
        if self.highest < self.lowest:
            raise ValueError(
                f"highest {self.highest:g} Hz must not be below lowest "
                f"{self.lowest:g} Hz"
            )
        return self

    def frequencies(self) -> list[float]:
        """The frequencies, evenly spaced on a logarithmic scale, Hz."""
        return [float(f) for f in np.geomspace(self.lowest, self.highest, self.count)]

    def presentations(self) -> Trials:
        """One trial per frequency."""
        last = 0.0
        for frequency in self.frequencies():
            yield Trial(
                force=self._sine(frequency, last),
                label=f"{frequency:.3g} Hz",
                hold=(self._lead, self._lead + self.cycles / frequency),
            )
            last = self.bias
        yield Trial(
            force=Waveform.through([(0.0, last), (0.25, 0.0), (0.5, 0.0)]),
            label="back to rest",
        )

    @property
    def _lead(self) -> float:
        return 0.25 + self.settle

    def _sine(self, frequency: float, last: float) -> Waveform:
        points = [(0.0, last), (0.25, self.bias)]
        if self.settle > 0:
            points.append((self._lead, self.bias))
        phase = np.arange(1, POINTS * self.cycles + 1) / POINTS
        values = self.bias + self.amplitude * np.sin(2 * np.pi * phase)
        values[-1] = self.bias  # exactly: the next trial starts there
        times = self._lead + phase / frequency
        points += zip(times.tolist(), values.tolist(), strict=True)
        return Waveform.through(points)

    def conclude(self, run: Measurement) -> Conclusion:
        """Gain and phase of V_C1 per frequency, and how far the model's gain is off."""
        if run.trace("V_C1") is None:
            return Conclusion(missing=("No gain: V_C1 was not recorded.",))
        found, expected = _gains(run), _gains(run, model=True)
        if not found:
            return Conclusion(missing=("No gain: no frequency was completed.",))
        known = [(g, _known(run, g)) for g in found]
        told = "; ".join(
            f"{g.frequency:.3g} Hz {u.value:.3g} ± {u.half:.2g} V/N at "
            f"{_degrees(g.phase):.0f}°"
            for g, u in known
        )
        said = [printed(f"V_C1 answers force with {told} (95 %).")]
        if run.force_uncertainty is None:
            said.append(NOT_STATED)
        if len(expected) == len(found):
            pairs = zip(found, expected, strict=True)
            off = max(abs(g.gain / e.gain - 1) for g, e in pairs)
            said.append(f"The model's gain differs by {100 * off:.2g} % at most.")
        values = [
            {"frequency_Hz": g.frequency, "gain_V_per_N": u, "phase_rad": g.phase}
            for g, u in known
        ]
        return Conclusion(tuple(said), {"V_C1_over_force": values})

    def plots(self, run: Measurement) -> Iterator[Plot]:
        """Gain and phase against frequency."""
        found, expected = _gains(run), _gains(run, model=True)
        if len(found) < 2:
            return
        at = tuple(g.frequency for g in found)
        known = [_known(run, g) for g in found]
        measured: Any = {"x": at, "mark": "points", "colour": "V_C1"}
        model: Any = {
            "x": [g.frequency for g in expected], "mark": "dashed", "colour": "model",
        }  # fmt: skip
        yield Plot(
            name="summary",
            title="gain and phase",
            caption="V_C1 against force at each frequency: gain with its 95 % "
            "interval, and phase. Dashed: the model under the same force.",
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
                            y=[g.value for g in known], y_error=[g.half for g in known],
                            name=run.origin, **measured,
                        ),
                        Series(y=[g.gain for g in expected], name="model", **model),
                    ),
                    limits=(0, None),
                    height=1.8,
                ),
                Panel(
                    label="Phase",
                    unit="°",
                    series=(
                        Series(y=[_degrees(g.phase) for g in found], **measured),
                        Series(y=[_degrees(g.phase) for g in expected], **model),
                    ),
                    height=1.55,
                ),
            ),
        )  # fmt: skip


def _gains(run: Measurement, *, model: bool = False) -> list[Gain]:
    """Gain of V_C1 over the force, V/N, for each trial named by a frequency."""
    trace, found = run.trace("V_C1", model=model), []
    for trial in run.results:
        if trace is None or trial.held is None:
            continue
        inside = (trace.time >= trial.held[0]) & (trace.time <= trial.held[1])
        time = trace.time[inside]
        try:
            frequency = parse(trial.label, "Hz")
            found.append(gain(time, run.force.at(time), trace.mean[inside], frequency))
        except (QuantityError, NotIdentifiableError):
            continue  # another trial, or one that was cut short
    return found


def _degrees(phase: float) -> float:
    """Between -360 and 0: V_C1 falls when the force rises, and lags."""
    return float(np.degrees(phase)) - (360.0 if phase > 0 else 0.0)


def _known(run: Measurement, found: Gain) -> Estimate:
    """The gain with its noise and the force's uncertainty."""
    estimate = Estimate.of(found.gain, found.error, LARGE)
    if run.force_uncertainty is None:
        return estimate
    part = float(run.force_uncertainty.of(found.amplitude)) / found.amplitude
    return estimate.widened(found.gain * part)
