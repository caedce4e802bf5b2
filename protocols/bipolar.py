"""Pushing and pulling: the drain current under positive and negative forces."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from tactile_lab.analysis.decay import fit_decay
from tactile_lab.analysis.estimate import Estimate
from tactile_lab.conclusion import NOT_STATED, Conclusion
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.measurement import Measurement
from tactile_lab.model.drain_current import BOXCAR_3DB
from tactile_lab.quantity import Duration, Force, Pause, show
from tactile_lab.stimulus.force import step
from tactile_lab.stimulus.levels import Levels
from tactile_lab.trial import Trials

LATE = 0.15
"""A coil set over a serial line is late: the first part of a hold still rises, s."""


class Bipolar(Levels):
    """Forces of both signs: I_DS rises with one and falls with the other (Fig. 2c)."""

    name: ClassVar[str] = "bipolar"
    title: ClassVar[str] = "Positive and negative forces"
    signals: ClassVar[tuple[str, ...]] = ("force", "coil_current", "V_C1", "I_DS")

    levels: tuple[Force, ...] = Field(
        default=(0.05, -0.05, 0.1, -0.1), min_length=1, description="Force held"
    )
    ramp: Pause = Field(default=0.25, description="Ramp up and ramp down, each")
    hold: Duration = Field(default=5.0, description="Time at each level")
    rest: Pause = Field(default=5.0, description="Time at no force after each")

    def presentations(self) -> Trials:
        """One trial per level."""
        for level in self.ordered():
            yield step(level, ramp=self.ramp, hold=self.hold, rest=self.rest)

    def conclude(self, run: Measurement) -> Conclusion:
        """What each force does to the drain current, and tau of the film."""
        if run.trace("I_DS") is None:
            return Conclusion(missing=("No drain current: V_C1 was not recorded.",))
        changes: list[dict[str, Any]] = []
        told = []
        margin = BOXCAR_3DB / 20
        for trial in run.results:
            if trial.held is None:
                continue
            start, begin = trial.start, trial.held[0]
            before = run.mean("I_DS", start - 0.1, start + margin)
            during = run.mean("I_DS", begin, begin + 0.1)
            if math.isnan(before) or math.isnan(during):
                continue
            changes.append(_change(run, trial.level, during - before))
            told.append(
                f"{trial.label}: I_DS from {show(before, 'A', 3)} to "
                f"{show(during, 'A', 3)}"
            )
        if not changes:
            return Conclusion(missing=("No drain current: no force was completed.",))
        said = ["; ".join(told) + "."]
        per_force = [_sensitivity(c) for c in changes if c["level_N"]]
        if per_force:
            said.append(f"Per force: {'; '.join(per_force)}.")
        if run.force_uncertainty is None:
            said.append(NOT_STATED)
        values: dict[str, Any] = {"I_DS_changes": changes}
        try:
            tau = values["tau_s"] = _tau(run)
        except NotIdentifiableError as reason:
            return Conclusion(tuple(said), values, (f"No tau: {reason}.",))
        said.append(f"The decay gives tau = {tau.text('s')}.")
        return Conclusion(tuple(said), values)


def _change(run: Measurement, level: float | None, change: float) -> dict[str, Any]:
    """What a force did to I_DS, and per force."""
    known = run.uncertain(level)
    slope = change / level if level else None
    spread = None
    if level and slope is not None and known is not None:
        spread = abs(slope * known / level)
    return {
        "level_N": level,
        "level_uncertainty_N_95": known,
        "change_A": change,
        "sensitivity_A_per_N": slope,
        "sensitivity_uncertainty_A_per_N_95": spread,
    }


def _sensitivity(change: dict[str, Any]) -> str:
    value = change["sensitivity_A_per_N"] * 1e6
    known = change["sensitivity_uncertainty_A_per_N_95"]
    spread = "" if known is None else f" ± {known * 1e6:.2g}"
    return f"{show(change['level_N'], 'N')} {value:.3g}{spread} nA/mN"


def _tau(run: Measurement) -> Estimate:
    """Tau from the strongest trial, its end known from the rest before the first."""
    trace, first = run.trace("I_DS"), run.results[0]
    rest = run.mean("I_DS", first.start - 0.2, first.start + 0.02)
    held = [t for t in run.results if t.held is not None]
    if trace is None or math.isnan(rest) or not held:
        raise NotIdentifiableError("the current at rest is not known")
    strongest = max(held, key=lambda t: abs(t.level or 0.0))
    start, end = strongest.held or (0.0, 0.0)
    averaged = 2 * float(np.median(np.diff(trace.time)))
    window = (start + LATE, end)
    return fit_decay(trace.time, trace.mean, window, averaged=averaged, rest=rest).tau
