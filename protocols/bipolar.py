"""Pushing and pulling: the drain current under positive and negative forces."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from tactile_lab.quantity import Duration, Force, Pause
from tactile_lab.stimulus.force import step
from tactile_lab.stimulus.levels import Levels
from tactile_lab.trial import Trials


class Bipolar(Levels):
    """Forces of both signs: I_DS rises with one and falls with the other (Fig. 2c)."""

    name: ClassVar[str] = "bipolar"
    title: ClassVar[str] = "Positive and negative forces"
    signals: ClassVar[tuple[str, ...]] = ("force", "coil_current", "V_C1", "I_DS")

    levels: tuple[Force, ...] = Field(
        default=(0.05, -0.05, 0.1, -0.1), min_length=1, description="Force held"
    )
    ramp: Pause = Field(default=0.25, description="Ramp up and ramp down, each")
    hold: Duration = Field(default=5.0, description="Time at each level")
    rest: Pause = Field(default=5.0, description="Time at no force after each")

    def presentations(self) -> Trials:
        """One trial per level."""
        for level in self.ordered():
            yield step(level, ramp=self.ramp, hold=self.hold, rest=self.rest)
