"""Protocols that try several force levels: their order, and a clean magnet to start."""

from __future__ import annotations

import random
from typing import Literal

from pydantic import Field

from protocols._demagnetise import demagnetised
from protocols._recovery import Recovering, Steps, first_rest
from tactile_lab.quantity import Duration, Force, Pause
from tactile_lab.trial import Trial
from tactile_lab.waveform import Waveform


class Levels(Recovering):
    """Separate steps from rest, one per level, with recovery between them."""

    levels: tuple[Force, ...] = Field(min_length=1, description="Force held")
    order: Literal["given", "rising", "falling", "random"] = Field(
        default="given", description="Order of the levels"
    )
    seed: int = Field(default=1, ge=0, description="Of the random order")
    ramp: Pause = Field(default=0.25, description="Ramp up and ramp down, each")
    hold: Duration = Field(default=2.0, description="Time at each level")
    demagnetise: bool = Field(
        default=False, description="Demagnetise the core before the first level"
    )

    def ordered(self) -> list[float]:
        """The levels in the order asked for, N."""
        levels = list(self.levels)
        if self.order == "random":
            random.Random(self.seed).shuffle(levels)
        elif self.order != "given":
            levels.sort(reverse=self.order == "falling")
        return levels

    def steps(self) -> Steps:
        """One trial per level, recovery after each but the last."""
        if self.demagnetise:
            yield from demagnetised()
            yield from self.recover(max(self.levels, key=abs), None)
        first, levels = None, self.ordered()
        for number, level in enumerate(levels):
            outcome = yield self.step(level)
            if number == 0:
                first = first_rest(outcome)
            if number + 1 < len(levels):
                yield from self.recover(level, first)

    def step(self, level: float) -> Trial:
        """One step to `level` N and back."""
        return Trial(
            force=Waveform.pulse(level, ramp=self.ramp, hold=self.hold),
            label=f"{level * 1e3:g} mN",
            level=level,
            hold=(self.ramp, self.ramp + self.hold),
        )
