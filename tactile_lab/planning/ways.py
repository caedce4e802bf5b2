"""What a plan says of the ways in which the coil plays its trials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tactile_lab.drive import Drive
from tactile_lab.planning.outcome import Step
from tactile_lab.quantity import count, show


@dataclass(frozen=True, kw_only=True)
class WayUsed:
    """Trials that the coil plays in the same way.

    Attributes:
        way: "set-points" or "list".
        trials: how many.
        why: of the trial whose force errs most.
        error: its largest difference from the force asked for, N.
        part: the same as a part of that force's range.
        load: time to load all their lists, s.
    """

    way: str
    trials: int
    why: str
    error: float
    part: float
    load: float

    def __str__(self) -> str:
        return (
            f"{count(self.trials, 'trial')}: {self.why}; the force errs by up to "
            f"{show(self.error, 'N', 2)}, {100 * self.part:.2g} % of its range"
        )

    def to_dict(self) -> dict[str, Any]:
        """The documented JSON object (docs/json.md)."""
        return {
            "way": self.way,
            "trials": self.trials,
            "why": self.why,
            "error_N": self.error,
            "error_part": self.part,
            "load_s": self.load,
        }


def ways_used(steps: Sequence[Step]) -> tuple[WayUsed, ...]:
    """The ways of all trials that ask for a force, in the order they come."""
    found: dict[str, list[tuple[Step, Drive, float]]] = {}
    for step in steps:
        if step.drive is not None and step.drive.error is not None:
            if step.trial.force.peak > 0:
                entry = step, step.drive, step.drive.error
                found.setdefault(step.drive.way, []).append(entry)
    return tuple(_used(way, trials) for way, trials in found.items())


def _used(way: str, trials: list[tuple[Step, Drive, float]]) -> WayUsed:
    worst, drive, error = max(trials, key=lambda one: one[2])
    return WayUsed(
        way=way,
        trials=len(trials),
        why=drive.why,
        error=error,
        part=error / float(np.ptp(np.append(worst.trial.force.value, 0.0))),
        load=sum(drive.load for _, drive, _ in trials),
    )
