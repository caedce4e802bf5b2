"""What a plan says of the ways in which the coil plays its trials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tactile_lab.drive import Drive
from tactile_lab.errors import SceneError
from tactile_lab.planning.outcome import Step
from tactile_lab.planning.way import drive_for
from tactile_lab.quantity import count, rounded, show
from tactile_lab.scene.scene import Scene


@dataclass(frozen=True, kw_only=True)
class WayUsed:
    """Trials that the coil plays in the same way.

    Attributes:
        way: "set-points" or "list".
        trials: how many.
        why: of the trial whose force errs most.
        error: its largest difference from the force asked for, N.
        part: the same as a part of that force's range.
        unsure: by how much the force may be off besides, N, as the lags of coil and
            core are known to the bench's `lag_uncertainty` only; None without one.
        load: time to load all their lists, s.
    """

    way: str
    trials: int
    why: str
    error: float
    part: float
    unsure: float | None
    load: float

    def __str__(self) -> str:
        lags = "; how well the lags are known is not stated"
        if self.unsure is not None:
            lags = f", and by {show(self.unsure, 'N', 2)} as lags are not known better"
        return (
            f"{count(self.trials, 'trial')}: {self.why}; the force errs by up to "
            f"{show(self.error, 'N', 2)}, {rounded(100 * self.part)} % of its range"
            f"{lags}"
        )

    def to_dict(self) -> dict[str, Any]:
        """The documented JSON object (docs/json.md)."""
        return {
            "way": self.way,
            "trials": self.trials,
            "why": self.why,
            "error_N": self.error,
            "error_part": self.part,
            "lags_N": self.unsure,
            "load_s": self.load,
        }


def ways_used(
    steps: Sequence[Step], lag_uncertainty: float | None = None
) -> tuple[WayUsed, ...]:
    """The ways of all trials that ask for a force, in the order they come.

    Args:
        steps: of the plan.
        lag_uncertainty: half of the 95 % band of coil's and core's lags together, s.
    """
    found: dict[str, list[tuple[Step, Drive, float]]] = {}
    for step in steps:
        if step.drive is not None and step.drive.error is not None:
            if step.trial.force.peak > 0:
                entry = step, step.drive, step.drive.error
                found.setdefault(step.drive.way, []).append(entry)
    return tuple(_used(way, trials, lag_uncertainty) for way, trials in found.items())


@dataclass(frozen=True, kw_only=True)
class WayInstead:
    """Another way for the trial that set-points follow worst.

    Attributes:
        way: "list" or "generator".
        error: largest difference from the force asked for, N; None where it cannot be.
        part: the same as a part of that force's range.
        load: time to load that trial, s.
        why_not: why it cannot be, "" where it can.
    """

    way: str
    error: float | None = None
    part: float | None = None
    load: float = 0.0
    why_not: str = ""

    def __str__(self) -> str:
        if self.error is None or self.part is None:
            return self.why_not
        return (
            f"the force of that trial would err by up to {show(self.error, 'N', 2)}, "
            f"{rounded(100 * self.part)} % of its range, loaded in "
            f'{show(self.load, "s", 2)} ([coil] way = "{self.way}")'
        )

    def to_dict(self) -> dict[str, Any]:
        """The documented JSON object (docs/json.md)."""
        return {
            "way": self.way,
            "error_N": self.error,
            "error_part": self.part,
            "load_s": self.load,
            "why_not": self.why_not or None,
        }


def ways_instead(scene: Scene, steps: Sequence[Step]) -> tuple[WayInstead, ...]:
    """What list and generator would make of the trial that set-points follow worst.

    Empty where the scene names a way, or nothing is played by set-points.
    """
    errors = {
        k: step.drive.error
        for k, step in enumerate(steps)
        if step.drive is not None
        and step.drive.way == "set-points"
        and step.drive.error
    }
    if scene.coil.way != "auto" or not errors:
        return ()
    k = max(errors, key=lambda one: errors[one])
    last = steps[k - 1].current if k else None
    before = 0.0 if last is None else float(last.value[-1])
    trial, found = steps[k].trial, []
    range_ = float(np.ptp(np.append(trial.force.value, 0.0)))
    for way in ("generator", "list"):
        only = replace(scene, coil=replace(scene.coil, way=way))
        try:
            drive = drive_for(trial, only, before)
        except SceneError as reason:
            found.append(WayInstead(way=way, why_not=str(reason.__cause__ or reason)))
            continue
        error = drive.error or 0.0
        found.append(
            WayInstead(way=way, error=error, part=error / range_, load=drive.load)
        )
    return tuple(found)


def _used(
    way: str, trials: list[tuple[Step, Drive, float]], lag_uncertainty: float | None
) -> WayUsed:
    worst, drive, error = max(trials, key=lambda one: one[2])
    range_ = float(np.ptp(np.append(worst.trial.force.value, 0.0)))
    unsure = None
    if lag_uncertainty is not None:
        steepest = max(step.trial.force.steepest for step, _, _ in trials)
        unsure = min(steepest * lag_uncertainty, range_) if lag_uncertainty else 0.0
    return WayUsed(
        way=way,
        trials=len(trials),
        why=drive.why,
        error=error,
        part=error / range_,
        unsure=unsure,
        load=sum(drive.load for _, drive, _ in trials),
    )
