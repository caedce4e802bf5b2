"""Protocols that try several force levels, and the order they come in."""

from __future__ import annotations

import random
from typing import Literal

from pydantic import Field

from tactile_lab.quantity import Force
from tactile_lab.stimulus.force import ForceProtocol


class Levels(ForceProtocol):
    """A force protocol with one presentation per level."""

    levels: tuple[Force, ...] = Field(min_length=1, description="Force held")
    order: Literal["given", "rising", "falling", "random"] = Field(
        default="given", description="Order of the levels"
    )
    seed: int = Field(default=1, ge=0, description="Of the random order")

    def ordered(self) -> list[float]:
        """The levels in the order asked for, N."""
        levels = list(self.levels)
        if self.order == "random":
            random.Random(self.seed).shuffle(levels)
        elif self.order != "given":
            levels.sort(reverse=self.order == "falling")
        return levels
