"""Eq. (2) against an independent force reading."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field, model_validator

from tactile_lab.quantity import Duration, Force, Pause
from tactile_lab.stimulus.force import ForceProtocol, pause, step
from tactile_lab.trial import Trials


class ForceCheck(ForceProtocol):
    """Some forces by Eq. (2), held long enough to read a balance or a deflection.

    Enter what was read in `readings`, one per level, to have them compared; the force
    without current belongs to neither. Table 1's A2 is very probably ten times too
    large, and this shows it.
    """

    name: ClassVar[str] = "force_check"
    title: ClassVar[str] = "Force check"
    signals: ClassVar[tuple[str, ...]] = ("force", "coil_current", "field")
    as_wired: ClassVar[bool] = True

    levels: tuple[Force, ...] = Field(
        default=(0.05, 0.1, 0.0, -0.05), min_length=1, description="Force by Eq. (2)"
    )
    readings: tuple[Force, ...] = Field(
        default=(), description="F(I) - F(0) read independently, one per level"
    )
    ramp: Pause = Field(default=0.5, description="Ramp up and ramp down, each")
    hold: Duration = Field(default=5.0, description="Time at each level")
    gap: Pause = Field(default=2.0, description="Pause without current after each")

    @model_validator(mode="after")
    def _one_reading_each(self) -> ForceCheck:
        if self.readings and len(self.readings) != len(self.levels):
            raise ValueError(
                f"{len(self.readings)} readings for {len(self.levels)} levels; give "
                "one per level or none"
            )
        return self

    def presentations(self) -> Trials:
        """One trial per level."""
        for level in self.levels:
            yield step(level, ramp=self.ramp, hold=self.hold)
            if self.gap > 0:
                yield pause(self.gap)
