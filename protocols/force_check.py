"""Eq. (2) against an independent force reading."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from tactile_lab.analysis.error_budget import ErrorBudget
from tactile_lab.analysis.estimate import Estimate, student_95
from tactile_lab.arrays import FloatArray
from tactile_lab.conclusion import Conclusion
from tactile_lab.measurement import SETTLING, MeasuredTrial, Measurement
from tactile_lab.quantity import ROUNDING, Duration, Force, Pause, plus_minus, show
from tactile_lab.stimulus.force import ForceProtocol, pause, step
from tactile_lab.trial import Trials

HALF_A_DIGIT = 5e-6
"""Error of a field read off a display that shows 0.01 mT, T."""
LATE = 0.5
"""Part of a hold after which its field is read."""


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
    checks: ClassVar[Literal["force"]] = "force"

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

    def conclude(self, run: Measurement) -> Conclusion:
        """F(I) - F(0) by Eq. (2) from current and field, and independent readings."""
        trials = run.results
        by_field = [_force_by_field(run, t) for t in trials]
        budgets = [_budget(run, t, f) for t, f in zip(trials, by_field, strict=True)]
        bands = [None if budget is None else budget.whole for budget in budgets]
        values: dict[str, Any] = {
            "F_minus_F0_by_field_N": by_field,
            "F_minus_F0_uncertainty_N_95": bands,
        }
        known = [
            f"{t.label} as "
            + (show(force, "N", 3) if band is None else plus_minus(force, band, "N"))
            for t, force, band in zip(trials, by_field, bands, strict=True)
            if force is not None
        ]
        missing = _unsettled(run)
        field = Conclusion(values=values, missing=missing)
        if known:
            said = (
                f"F(I) − F(0) by Eq. (2) from the field read, F(0) in the second "
                f"before each trial: {', '.join(known)} (95 %: scatter of the "
                "readings, and what the bench states of Eq. (2))."
            )
            field = Conclusion((said,), values, missing, budgets=_widest(budgets))
            field += Conclusion(run.not_stated)
        return field + self._read_over_eq2(run)

    def _read_over_eq2(self, run: Measurement) -> Conclusion:
        """The readings over what Eq. (2) gives for the levels."""
        levels = np.array([t.level or 0.0 for t in run.results])
        readings = np.array(self.readings)
        if readings.size != levels.size:
            said = (
                "No independent readings: enter F(I) − F(0) of each level with "
                "protocol.readings to check Eq. (2)."
            )
            return Conclusion((said,))
        strength = float(np.sum(levels**2))
        if strength == 0:
            return Conclusion(("All levels are 0 N: nothing to compare.",))
        scale = float(np.sum(levels * readings) / strength)
        left = readings - scale * levels
        freedom = max(1, levels.size - 1)
        error = float(np.sqrt(np.sum(left**2) / freedom / strength))
        scattered = error > ROUNDING * abs(scale)
        half = Estimate.of(scale, error, freedom).half if scattered else None
        parts = {"readings": half, "force": None}
        known = show(scale, "", 3) if half is None else plus_minus(scale, half)
        said = (
            f"The force read is {known}{' (95 %)' * scattered} times that of Eq. (2)."
        )
        if not scattered:
            alike = "Readings without scatter tell" if levels.size > 1 else "One tells"
            said += f" {alike} nothing of how far they are off."
        if 0.05 < scale < 0.2:
            said += (
                " A factor near 0.1 is the area A2: Table 1 prints 2.25e-3 m², a core "
                "of 15 mm x 15 mm has 2.25e-4 m²."
            )
        found: dict[str, float | None] = {
            "read_over_eq2": scale,
            "standard_error": error if scattered else None,
            "read_over_eq2_uncertainty_95": half,
        }
        if run.force_uncertainty is not None:
            shared = run.force_uncertainty
            offset = shared.absolute * abs(float(levels.sum())) / strength
            open_ = scale * math.hypot(shared.relative, offset)
            found["eq2_uncertainty_95"] = parts["force"] = open_
            said += (
                " What calibration and geometry leave open in Eq. (2) adds "
                f"±{open_:.2g} (95 %)."
            )
        budget = ErrorBudget("", parts)
        budgets = {"force read over Eq. (2)": budget} if budget.whole else {}
        return Conclusion((said,), found, budgets=budgets)


def _unsettled(run: Measurement) -> tuple[str, ...]:
    """Which forces a field that was read tells nothing of: not once it stood."""
    unread = [t.label for t in run.results if t.held and not run.field_held(t).size]
    if not unread or not run.field_between(0.0, run.duration).size:
        return ()
    return (
        f"No F(I) of {', '.join(unread)}: the field was not read once it had settled, "
        f"{SETTLING:g} s after the current came; make protocol.hold longer.",
    )


def _widest(budgets: Sequence[ErrorBudget | None]) -> dict[str, ErrorBudget]:
    """That of the force by the field that is known least."""
    known = [budget for budget in budgets if budget is not None]
    if not known:
        return {}
    return {"F(I) − F(0) at most": max(known, key=lambda budget: budget.whole)}


def _budget(
    run: Measurement, trial: MeasuredTrial, force: float | None
) -> ErrorBudget | None:
    """What is not known of a force by the field, N; nobody states the meter's error."""
    if force is None or run.newtons_per_tesla is None:
        return None
    scatter = 0.0
    for read in run.field_held(trial, LATE), _before(run, trial):
        # readings that are all alike tell no more than their last digit
        scatters = read.size > 1 and np.ptp(read) > 0
        one = float(read.std(ddof=1)) if scatters else HALF_A_DIGIT
        scatter = math.hypot(scatter, student_95(read.size - 1) * one / read.size**0.5)
    stated, read_ = run.uncertain(force), scatter * run.newtons_per_tesla
    return ErrorBudget("N", {"force": stated, "readings": read_, "meter": None})


def _force_by_field(run: Measurement, trial: MeasuredTrial) -> float | None:
    """F(I) - F(0) of a trial from the field in its hold and before it, N."""
    if run.newtons_per_tesla is None:
        return None
    held, before = run.field_held(trial, LATE), _before(run, trial)
    if not (held.size and before.size):
        return None
    return float(held.mean() - before.mean()) * run.newtons_per_tesla


def _before(run: Measurement, trial: MeasuredTrial) -> FloatArray:
    """Field read in the second before a trial, T."""
    return run.field_between(trial.start - 1.0, trial.start)
