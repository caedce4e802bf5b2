"""How the coil gives one trial's force: by which way, and how nearly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tactile_lab.current_list import CurrentList
from tactile_lab.waveform import Waveform

Way = Literal["set-points", "list", "generator"]
"""How a current is played: sent point by point by this computer's clock, loaded as a
list that the source plays by its own, or as a waveform that the scope's generator plays
into the source's analogue input."""


@dataclass(frozen=True, eq=False)
class Drive:
    """What the coil plays in one trial.

    Attributes:
        current: A against s from 0 to the trial's length, as far as it can follow.
        points: what source or generator plays instead of set-points, or None.
        gain: of the analogue input through which the generator plays, A/V; None for
            the other ways.
        force: N, as the bench believes it comes from `points`; None for set-points,
            whose force depends on what was before.
        stairs: what flows of it by set-points, each from when the source acts on it, A;
            None for the other ways.
        error: largest difference between the force asked for and the one given, N;
            None where the trial asks for a current.
        why: why this way.
        warning: where the coil cannot follow what is asked, or None.
        load: time to load `points`, s.
    """

    current: Waveform
    points: CurrentList | None = None
    gain: float | None = None
    force: Waveform | None = None
    stairs: Waveform | None = None
    error: float | None = None
    why: str = ""
    warning: str | None = None
    load: float = 0.0

    @property
    def way(self) -> Way:
        """By which way."""
        if self.points is None:
            return "set-points"
        return "list" if self.gain is None else "generator"
