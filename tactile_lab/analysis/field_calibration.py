"""From teslameter readings on both branches to a dated, hashed calibration file."""

from __future__ import annotations

import datetime
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tactile_lab.analysis.error_budget import ErrorBudget
from tactile_lab.analysis.estimate import Estimate, Line
from tactile_lab.arrays import FloatArray
from tactile_lab.calibration import COIL, HASH, UNCERTAINTY, VALID_UNTIL, table_hash
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.quantity import show

WIDEST_LOOP = 0.05
"""Half-width of the loop over the largest field that is accepted without asking."""
DRIFT = 0.02
"""Drift over the largest field beyond which there is no calibration."""
WARMING = 30.0
"""Warming of the winding beyond which a calibration is doubted, K."""
MANY = 10_000
"""Degrees of freedom of what all readings tell together: a normal distribution's."""
Z90 = 1.6448536269514722
"""Of a normal distribution, 5 % lie above."""
READ_BACK_NOISE = 2e-4
"""Current by which an end may differ from the whole mA it was asked to be, A. The field
is known no better than to what it makes of that."""
VALID = datetime.timedelta(days=180)
"""From the measurement until it has expired."""
HEADER = "current_A,field_T"


@dataclass(frozen=True, kw_only=True)
class FieldStep:
    """The field on one step of one branch.

    Attributes:
        branch: "rising" or "falling"; "again" repeats some of "falling" at the end.
        current: applied, as measured, A.
        field: mean of the readings, T.
        error: standard error of that mean, T.
    """

    branch: Literal["rising", "falling", "again"]
    current: float
    field: float
    error: float


@dataclass(frozen=True, kw_only=True, eq=False)
class FieldCalibration:
    """B2(I) of the electromagnet.

    Attributes:
        current: shape (n,), A, increasing.
        field: shape (n,), mean of both branches, T.
        half_width: half the distance between the branches at 0 A, T.
        half_width_current: the same along the current, A.
        slope: T/A.
        offset: of the straight line at 0 A, T.
        drift: of the field at the same current and history from the begin to the end,
            T; None where no step was repeated.
        warming: of the winding meanwhile, K; None where it is not known. It has no
            interval: a source states none for the resistance that it reads.
        budget: of one field value, T: half of the band that holds 95 % of those that
            came from saturation, which lie at the loop's edge, with what readings and
            drift leave open; all others lie further inside.
        warnings: what to look at before it is used.
    """

    current: FloatArray
    field: FloatArray
    half_width: Estimate
    half_width_current: Estimate
    slope: Estimate
    offset: Estimate
    drift: Estimate | None
    warming: float | None
    budget: ErrorBudget
    warnings: tuple[str, ...]

    @property
    def uncertainty(self) -> float:
        """Half of that band, T."""
        return self.budget.whole


def fit_field(
    steps: Sequence[FieldStep], warming: float | None = None
) -> FieldCalibration:
    """Fit both branches with one slope and a loop between them.

    Args:
        steps: in the order they were read.
        warming: of the winding meanwhile, K, where it is known.

    Raises:
        NotIdentifiableError: a branch is missing or has fewer than 5 steps, the
            branches do not cover 0 A, the field does not follow the current, or it
            drifted by more than 2 % of the largest.
    """
    falling = _branch(steps, "falling")
    rising = _branch(steps, "rising")
    low = _end(max(falling[0].min(), rising[0].min()))
    high = _end(min(falling[0].max(), rising[0].max()))
    if not low <= 0 <= high:
        raise NotIdentifiableError("the branches do not both cover 0 A")
    currents = np.concatenate([falling[0], rising[0], [low, 0.0, high]])
    # what lies beyond an end by noise or rounding is that end, which must not be lost
    current = _apart(np.unique(np.clip(np.round(currents, 4), low, high)))
    upper = np.interp(current, *falling)
    lower = np.interp(current, *rising)
    field = (upper + lower) / 2
    line = Line.through(current, field)
    slope = line.slope.value
    if slope == 0 or abs(slope) * (high - low) < 4 * line.scatter:
        raise NotIdentifiableError("the field does not follow the current")
    half_width = abs(float(np.interp(0.0, current, (upper - lower) / 2)))
    noise = float(np.sqrt(np.mean([step.error**2 for step in steps])))
    # it is half of a difference of two, as the field is half of their sum
    loop = Estimate.of(half_width, noise / math.sqrt(2), MANY)
    warnings = []
    full = float(np.max(np.abs(field)))
    drift = _drift(steps, slope)
    if drift is not None and abs(drift.value) > DRIFT * full:
        raise NotIdentifiableError(
            "the field at the same current drifted by "
            f"{show(drift.value, 'T', 3)} from begin to end "
            f"({100 * abs(drift.value) / full:.1f} % of full scale, limit "
            f"{100 * DRIFT:g} %): clamp the probe, let meter and coil warm up, zero "
            "the meter, and calibrate again"
        )
    if warming is not None and warming > WARMING:
        warnings.append(
            f"the winding became {warming:.0f} K warmer ({WARMING:g} K is much): let "
            "the coil cool, and step faster or to less current"
        )
    if half_width > WIDEST_LOOP * full:
        warnings.append(
            f"the loop is {show(half_width, 'T', 3)} wide to either side, "
            f"{100 * half_width / full:.0f} % of full scale (5 % is usual): "
            "demagnetise again, and approach each force from the same side"
        )
    if np.any(np.diff(field) * slope <= 0):
        warnings.append("the mean curve is not monotonic: read longer on each step")
    return FieldCalibration(
        current=current,
        field=field,
        half_width=loop,
        half_width_current=loop.scaled(1 / abs(slope)),
        slope=line.slope,
        offset=line.offset,
        drift=drift,
        warming=warming,
        budget=_edge(half_width, noise, drift),
        warnings=tuple(warnings),
    )


def _edge(half_width: float, noise: float, drift: Estimate | None) -> ErrorBudget:
    """What is not known of one field, T, where the loop's edge lies so far from it.

    A third of the readings' variance is left in a field between two steps of both
    branches, and half of it in the loop at 0 A. What drifted, beyond what the readings
    make of nothing, lies evenly within that (GUM 4.3.7).
    """
    moved = 0.0
    if drift is not None:
        moved = max(0.0, drift.value**2 - drift.error**2) / 3
    read = noise**2 * (1 / 3 + 1 / 2)
    parts = {
        "loop": half_width,
        "readings": Z90 * math.sqrt(read),
        "drift": None if drift is None else Z90 * math.sqrt(moved),
        "meter": None,  # nobody states its error
    }
    # an edge is left to one side only
    return ErrorBudget("T", parts, half_width + Z90 * math.sqrt(read + moved))


def _drift(steps: Sequence[FieldStep], slope: float) -> Estimate | None:
    """Mean change of the field on the repeated steps, T."""
    first = [s for s in steps if s.branch == "falling"]
    changes, errors = [], []
    for again in (s for s in steps if s.branch == "again"):
        once = min(first, key=lambda s: abs(s.current - again.current))
        changes.append(
            again.field - once.field - slope * (again.current - once.current)
        )
        errors += [again.error, once.error]
    if not changes:
        return None
    error = math.sqrt(sum(error**2 for error in errors)) / len(changes)
    return Estimate.of(float(np.mean(changes)), error, MANY)


def _branch(steps: Sequence[FieldStep], name: str) -> tuple[FloatArray, FloatArray]:
    found = sorted((s.current, s.field) for s in steps if s.branch == name)
    if len(found) < 5:
        raise NotIdentifiableError(
            f"the {name} branch has {len(found)} steps, 5 are needed"
        )
    values = np.array(found)
    return values[:, 0], values[:, 1]


def _end(current: float) -> float:
    """An end of the range, A: what was asked for, where only noise is between."""
    asked = round(current, 3)
    return asked if abs(asked - current) <= READ_BACK_NOISE else current


def _apart(current: FloatArray) -> FloatArray:
    """Without currents that differ by read-back noise only; 0 A and both ends stay."""
    nearest = 0.2 * (current[-1] - current[0]) / current.size
    kept = sorted({0.0, float(current[0]), float(current[-1])})
    for value in current[np.argsort(np.abs(current))]:
        if min(abs(value - other) for other in kept) > nearest:
            kept.append(float(value))
    return np.array(sorted(kept))


def calibration_text(
    calibration: FieldCalibration,
    *,
    coil: str,
    date: datetime.date,
    temperature: str = "not known",
) -> str:
    """The file a bench's ``[magnet] calibration`` names: head, hash and table.

    Args:
        calibration: what to write.
        coil: the coil or source it belongs to, as the bench names it.
        date: day of the measurement.
        temperature: of the room meanwhile, and who says so.
    """
    moved = calibration.drift
    rows = "\n".join(
        f"{i:.6g},{b:.9g}"
        for i, b in zip(calibration.current, calibration.field, strict=True)
    )
    body = f"{HEADER}\n{rows}\n"
    head = {
        COIL: coil,
        "date": date.isoformat(),
        VALID_UNTIL: (date + VALID).isoformat(),
        "slope T/A": f"{calibration.slope.value:.6g} ({calibration.slope.low:.6g} to "
        f"{calibration.slope.high:.6g})",
        "loop half-width T": f"{calibration.half_width.value:.3g}",
        "drift T": _known(None if moved is None else moved.value),
        "temperature": temperature,
        "winding warmed by K": _known(calibration.warming),
        UNCERTAINTY["T"]: f"{calibration.uncertainty:.3g}",
    }
    told = "".join(f"# {name}: {value}\n" for name, value in head.items()) + body
    return f"# {HASH}: {table_hash(told)}\n{told}"


def _known(value: float | None) -> str:
    return "not known" if value is None else f"{value:.3g}"
