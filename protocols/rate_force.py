"""Rate against force: separate steps from rest, with recovery between them."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from tactile_lab.quantity import Duration, Force, Pause
from tactile_lab.stimulus.force import step
from tactile_lab.stimulus.levels import Levels
from tactile_lab.stimulus.recovery import Recovering, first_rest
from tactile_lab.trial import Trials


class RateForce(Recovering, Levels):
    """The highest rate of a step from rest, per force (Fig. 4d), and its onset.

    A staircase would not do: V_P is a high-pass of force, so each step of a staircase
    acts as less than its value.
    """

    name: ClassVar[str] = "rate_force"
    title: ClassVar[str] = "Rate against force"

    levels: tuple[Force, ...] = Field(
        default=(0.085, 0.095, 0.1, 0.11, 0.125, 0.15, 0.175, 0.2),
        min_length=1,
        description="Force of each step",
    )
    ramp: Pause = Field(default=0.25, description="Ramp up and ramp down, each")
    hold: Duration = Field(default=1.0, description="Time at each level")

    def presentations(self) -> Trials:
        """One step per level, recovery after each but the last."""
        first, levels = None, self.ordered()
        for number, level in enumerate(levels):
            outcome = yield step(level, ramp=self.ramp, hold=self.hold)
            if number == 0:
                first = first_rest(outcome)
            if number + 1 < len(levels):
                yield from self.recover(level, first)
