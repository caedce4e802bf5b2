"""What a force protocol's preparation tells: the force at 0 A before and after."""

from __future__ import annotations

import math

from tactile_lab.quantity import show
from tactile_lab.report.conclusion import Conclusion
from tactile_lab.report.run_data import RunData, TrialData
from tactile_lab.stimulus.force import AT_ZERO_AFTER, AT_ZERO_BEFORE

WHEN = {AT_ZERO_BEFORE: "before", AT_ZERO_AFTER: "after"}


def force_at_zero(run: RunData) -> Conclusion:
    """F(0), the force the core's remanence makes at 0 A, where a run asked for it.

    The drive force is F(I) - F(0); what changes between before and after is an error
    of every force of the run.
    """
    trials = [t for t in run.trials if t.label in WHEN]
    if not trials:
        return Conclusion()
    found = {WHEN[t.label]: _field(run, t) for t in trials}
    values = {
        "force_at_zero": {
            f"{when}_{what}": None if field is None else field * factor
            for when, field in found.items()
            for what, factor in (("T", 1.0), ("N", run.newtons_per_tesla or math.nan))
            if math.isfinite(factor)
        }
    }
    known = {when: field for when, field in found.items() if field is not None}
    if not known or run.newtons_per_tesla is None:
        return Conclusion(
            ("F(0), the force at 0 A, is unknown: the bench reads no field.",), values
        )
    said = " and ".join(
        f"{show(field, 'T', 3)} or {show(field * run.newtons_per_tesla, 'N', 3)} {when}"
        for when, field in known.items()
    )
    sentence = f"F(0), the force at 0 A, by Eq. (2) from the field read: {said}."
    if len(known) == 2:
        change = (known["after"] - known["before"]) * run.newtons_per_tesla
        sentence += f" It changed by {show(change, 'N', 2)}."
    return Conclusion((sentence,), values)


def _field(run: RunData, trial: TrialData) -> float | None:
    readings = run.field_between(trial.start, trial.start + trial.duration)
    return float(readings.mean()) if readings.size else None
