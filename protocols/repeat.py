"""The same force again and again: how the response falls from one to the next."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from tactile_lab.quantity import Duration, Force, Pause
from tactile_lab.stimulus.force import ForceProtocol, step
from tactile_lab.trial import Trials


class Repeat(ForceProtocol):
    """Successive equal presentations (Fig. 1d, 5d right)."""

    name: ClassVar[str] = "repeat"
    title: ClassVar[str] = "Repeated presentations"

    level: Force = Field(default=0.16, description="Force held")
    count: int = Field(default=8, ge=2, le=10_000, description="Presentations")
    ramp: Pause = Field(default=0.25, description="Ramp up and ramp down, each")
    hold: Duration = Field(default=1.0, description="Time at the level")
    gap: Pause = Field(default=1.0, description="Time at no force after each")

    def presentations(self) -> Trials:
        """One trial per presentation."""
        for number in range(self.count):
            yield step(
                self.level,
                ramp=self.ramp,
                hold=self.hold,
                rest=self.gap,
                label=f"no. {number + 1}",
            )
