"""Rate against force: separate steps from rest, with recovery between them."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from protocols._levels import Levels
from tactile_lab.quantity import Duration, Force
from tactile_lab.trial import Trials


class RateForce(Levels):
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
    hold: Duration = Field(default=1.0, description="Time at each level")

    def trials(self) -> Trials:
        """One step per level."""
        yield from self.steps()
