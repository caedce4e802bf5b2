"""Conclusions of the protocols that check and calibrate the bench."""

from __future__ import annotations

import datetime
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tactile_lab.analysis.field_calibration import (
    FieldCalibration,
    FieldStep,
    fit_field,
    write_calibration,
)
from tactile_lab.errors import NotIdentifiableError, QuantityError
from tactile_lab.quantity import parse, show
from tactile_lab.report.conclusion import Conclusion
from tactile_lab.report.run_data import RunData, TrialData
from tactile_lab.report.trial_finding import TrialFinding

FloatArray = NDArray[np.float64]
BRANCHES: dict[str, Literal["rising", "falling", "again"]] = {
    "rising": "rising", "falling": "falling", "again": "again",
}  # fmt: skip

HALF_A_DIGIT = 5e-6
"""Error of a field read off a display that shows 0.01 mT, T."""


def calibrate_field(run: RunData, trials: Sequence[TrialFinding]) -> Conclusion:
    """Slope, loop and uncertainty of B2(I)."""
    try:
        found = fit_field(field_steps(run, [t.trial for t in trials]), run.warming)
    except NotIdentifiableError as reason:
        return Conclusion((f"No calibration: {reason}.",))
    sentences = (
        f"B2 rises by {show(found.slope.value, 'T')}/A "
        f"(±{show((found.slope.high - found.slope.low) / 2, 'T', 2)}/A, 95 %), from "
        f"{show(found.offset.value, 'T', 3)} at 0 A.",
        f"The loop is {show(found.half_width, 'T', 3)} or "
        f"{show(found.half_width_current, 'A', 3)} to either side; one field value is "
        f"known to ±{show(found.uncertainty, 'T', 3)} (95 %).",
        *_steady(found),
        *(f"{warning[0].upper()}{warning[1:]}." for warning in found.warnings),
    )
    values = {
        "slope_T_per_A": found.slope.value,
        "slope_low_95": found.slope.low,
        "slope_high_95": found.slope.high,
        "offset_T": found.offset.value,
        "half_width_T": found.half_width,
        "half_width_A": found.half_width_current,
        "uncertainty_T": found.uncertainty,
        "drift_T": found.drift,
        "warming_K": found.warming,
        "current_A": found.current.tolist(),
        "field_T": found.field.tolist(),
    }
    return Conclusion(sentences, values)


def _steady(found: FieldCalibration) -> Iterator[str]:
    """What the checks of drift and temperature gave."""
    if found.drift is not None:
        yield (
            f"At the same current and history the field changed by "
            f"{show(found.drift, 'T', 2)} from begin to end."
        )
    if found.warming is not None:
        yield f"The winding became {found.warming:.0f} K warmer (by its resistance)."


def write_calibration_file(folder: Path, run: RunData) -> Path | None:
    """The calibration of a `calibrate_field` run as calibration.csv; None if no use.

    A file that is there already stays: calibrations are never changed.
    """
    path = folder / "calibration.csv"
    if run.protocol != "calibrate_field" or path.exists():
        return None
    try:
        found = fit_field(field_steps(run, run.trials), run.warming)
        date = datetime.date.fromisoformat(run.started[:10])
    except (NotIdentifiableError, ValueError):
        return None  # the report's own sentence says why
    coil = run.settings.get("coil", {}).get("identity", run.bench)
    temperature = run.conditions.get("temperature", "not known")
    return write_calibration(path, found, coil=coil, date=date, temperature=temperature)


def field_steps(run: RunData, trials: Sequence[TrialData]) -> list[FieldStep]:
    """Mean reading and mean current of each step of a `calibrate_field` run.

    Raises:
        NotIdentifiableError: the run has no readings.
    """
    if run.field is None or not len(run.field) or run.current is None:
        raise NotIdentifiableError("the run has no teslameter readings or no current")
    steps = []
    for trial in trials:
        if trial.hold is None or trial.pause:
            continue
        branch = BRANCHES.get(trial.label.partition(" ")[0])
        if branch is None:
            continue
        start, end = trial.start + trial.hold[0], trial.start + trial.hold[1]
        time, value = run.field.T
        readings = value[(time >= start) & (time <= end)]
        before = run.current[:, 0] <= end
        if not readings.size or not before.any():
            continue
        applied = float(run.current[before][-1, 1])
        error = HALF_A_DIGIT
        if readings.size > 1:
            error = float(readings.std(ddof=1) / np.sqrt(readings.size))
        steps.append(
            FieldStep(
                branch=branch,
                current=applied,
                field=float(readings.mean()),
                error=error,
            )
        )
    return steps


def force_check(run: RunData, trials: Sequence[TrialFinding]) -> Conclusion:
    """F(I) - F(0) by Eq. (2) from current and field, and independent readings."""
    levels = np.array([t.trial.level or 0.0 for t in trials])
    by_field = [_force_by_field(run, t.trial) for t in trials]
    bands = [run.uncertain(force) for force in by_field]
    sentences = []
    values: dict[str, object] = {
        "F_minus_F0_by_field_N": by_field,
        "F_minus_F0_uncertainty_N_95": bands,
    }
    known = [
        f"{t.trial.label} as {show(force, 'N', 3)}"
        + ("" if band is None else f" ± {show(band, 'N', 2)}")
        for t, force, band in zip(trials, by_field, bands, strict=True)
        if force is not None
    ]
    if known:
        sentences.append(
            f"F(I) − F(0) by Eq. (2) from the field read: {', '.join(known)}."
        )
    text = run.parameters.get("readings", "")
    try:
        readings = np.array([parse(p, "N") for p in text.split(", ") if p])
    except QuantityError as reason:
        said = f"The readings cannot be used: {reason}"
        return Conclusion((*sentences, said), values)
    if readings.size != levels.size:
        said = (
            "No independent readings: enter F(I) − F(0) of each level with "
            '--set protocol.readings=["...", ...] to check Eq. (2).'
        )
        return Conclusion((*sentences, said), values)
    strength = float(np.sum(levels**2))
    if strength == 0:
        return Conclusion((*sentences, "All levels are 0 N: nothing to compare."))
    scale = float(np.sum(levels * readings) / strength)
    left = readings - scale * levels
    freedom = max(1, levels.size - 1)
    error = float(np.sqrt(np.sum(left**2) / freedom / strength))
    said = f"The force read is {scale:.3g} ± {2 * error:.2g} times that of Eq. (2)."
    if 0.05 < scale < 0.2:
        said += (
            " A factor near 0.1 is the area A2: Table 1 prints 2.25e-3 m², a core of "
            "15 mm x 15 mm has 2.25e-4 m²."
        )
    found = {**values, "read_over_eq2": scale, "standard_error": error}
    if run.force_uncertainty is not None:
        shared = run.force_uncertainty
        offset = shared.absolute * abs(float(levels.sum())) / strength
        open_ = scale * math.hypot(shared.relative, offset)
        found["eq2_uncertainty_95"] = open_
        said += (
            " What calibration and geometry leave open in Eq. (2) adds "
            f"±{open_:.2g} (95 %)."
        )
    return Conclusion((*sentences, said), found)


def _force_by_field(run: RunData, trial: TrialData) -> float | None:
    """F(I) - F(0) of a trial from the field in its hold and before it, N."""
    if trial.hold is None or run.newtons_per_tesla is None:
        return None
    start, end = trial.hold
    held = run.field_between(trial.start + (start + end) / 2, trial.start + end)
    before = run.field_between(trial.start - 1.0, trial.start)
    if not (held.size and before.size):
        return None
    return float(held.mean() - before.mean()) * run.newtons_per_tesla


def monitor(run: RunData, trials: Sequence[TrialFinding]) -> Conclusion:
    """How far the sensor sits from its threshold."""
    trace = run.trace("V_C1")
    if run.circuit is None or trace is None or not trace.time.size:
        return Conclusion()
    last = trace.mean[trace.time >= trace.time[-1] - 1.0]
    distance = float(last.mean()) - run.circuit.critical_V_C1
    where = "above" if distance > 0 else "below"
    said = (
        f"V_C1 ended {show(abs(distance), 'V', 3)} {where} the critical "
        f"{show(run.circuit.critical_V_C1, 'V')}: the sensor "
        f"{'is silent' if distance > 0 else 'fires'} at rest."
    )
    return Conclusion((said,), {"distance_to_threshold_V": distance})
