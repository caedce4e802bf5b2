"""Sines of rising frequency: the dynamic response within the bench's bandwidth."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator

from tactile_lab.quantity import Force, Pause, Unit
from tactile_lab.stimulus.force import ForceProtocol
from tactile_lab.trial import Trial, Trials
from tactile_lab.waveform import Waveform

Frequency = Annotated[float, Unit("Hz", above=0.0)]
PushForce = Annotated[float, Unit("N", above=0.0)]

POINTS = 24
"""Straight pieces a cycle is drawn with: within 0.9 % of a sine."""


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
