"""The paper's pulses: a force ramped up, held, ramped down, for each of some levels."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from tactile_lab.quantity import Duration, Force, Pause
from tactile_lab.stimulus.force import step
from tactile_lab.stimulus.levels import Levels
from tactile_lab.trial import Trials


class Pulses(Levels):
    """One pulse per level, each followed by a rest at no force (Fig. 4a-c)."""

    name: ClassVar[str] = "pulses"
    title: ClassVar[str] = "Pulses"

    levels: tuple[Force, ...] = Field(
        default=(0.08, 0.12, 0.16, 0.2), min_length=1, description="Force held"
    )
    ramp: Pause = Field(default=0.25, description="Ramp up and ramp down, each")
    hold: Duration = Field(default=2.0, description="Time at each level")
    rest: Pause = Field(default=2.0, description="Time at no force after each pulse")

    def presentations(self) -> Trials:
        """One trial per level."""
        for level in self.ordered():
            yield step(level, ramp=self.ramp, hold=self.hold, rest=self.rest)
