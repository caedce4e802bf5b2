"""A plain staircase of forces, each step on top of the one before."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from tactile_lab.quantity import Duration, Force, Pause, show
from tactile_lab.stimulus.levels import Levels
from tactile_lab.trial import Trial, Trials
from tactile_lab.waveform import Waveform

RETURN = 0.25
"""Shortest ramp back to no force, s."""


class Staircase(Levels):
    """Forces one after another without a return to rest.

    This is not the rate-force curve of Fig. 4d: V_P is a high-pass of force (tau is
    8.69 s), so after seconds on one level the next acts as less than its value. Use
    `rate_force` for that curve.
    """

    name: ClassVar[str] = "staircase"
    title: ClassVar[str] = "Staircase (no rate-force curve)"

    levels: tuple[Force, ...] = Field(
        default=(0.05, 0.1, 0.15, 0.2, 0.15, 0.1, 0.05, 0.0),
        min_length=1,
        description="Force of each step",
    )
    ramp: Pause = Field(default=0.25, description="Ramp from step to step")
    hold: Duration = Field(default=2.0, description="Time on each step")

    def presentations(self) -> Trials:
        """One trial per step; the coil holds between trials."""
        last = 0.0
        for level in self.ordered():
            end = self.ramp + self.hold
            points = [(0.0, last), (self.ramp, level), (end, level)]
            yield Trial(
                force=Waveform.through(points),
                label=show(level, "N"),
                level=level,
                hold=(self.ramp, end),
            )
            last = level
        if last != 0:
            yield Trial(
                force=Waveform.through([(0.0, last), (max(self.ramp, RETURN), 0.0)]),
                label="back to rest",
            )
