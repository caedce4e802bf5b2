"""Field of the electromagnet against current, both branches of its hysteresis."""

from __future__ import annotations

import datetime
from collections.abc import Iterator
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from tactile_lab.analysis.estimate import standard_error
from tactile_lab.analysis.field_calibration import (
    FieldCalibration,
    FieldStep,
    calibration_text,
    fit_field,
)
from tactile_lab.conclusion import Conclusion
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.magnetics import ROUGH
from tactile_lab.measurement import Measurement
from tactile_lab.plot import Panel, Plot, Series
from tactile_lab.quantity import Duration, Pause, plus_minus, printed, show
from tactile_lab.stimulus.demagnetise import demagnetising
from tactile_lab.stimulus.force import PushCurrent
from tactile_lab.trial import Protocol, Trial, Trials
from tactile_lab.waveform import Waveform

BEYOND, LEAST_BEYOND = 0.2, 0.2
"""The current turns outside the range by this part of it, at least by so many A: twice
the half-width of a soft core's loop, so that both branches are settled in the range."""
REPEATED = 3
"""Steps of the falling branch that are read again at the end."""
BRANCHES: dict[str, Literal["rising", "falling", "again"]] = {
    "rising": "rising", "falling": "falling", "again": "again",
}  # fmt: skip
"""First words of the labels of steps."""
HALF_A_DIGIT = 5e-6
"""Error of a field read off a display that shows 0.01 mT, T."""
RAMP = 0.5
"""Time in which the current goes from one step to the next, s: it never overshoots."""


class CalibrateField(Protocol):
    """Demagnetise, condition, then step the current down and up and read the field.

    At the end the first steps are read again: the drift. The winding's resistance tells
    how much it warmed. Take the NdFeB magnet away first: it adds 163 mT. Each step
    keeps the direction it is approached from, because the two branches differ. The run
    keeps the calibration file that is made of the readings.
    """

    name: ClassVar[str] = "calibrate_field"
    title: ClassVar[str] = "Field calibration"
    signals: ClassVar[tuple[str, ...]] = ("coil_current", "field")
    checks: ClassVar[Literal["field"]] = "field"

    most: PushCurrent = Field(
        default=1.0, title="Largest current", description="Largest calibrated current"
    )
    points: int = Field(
        default=21, ge=5, le=401, description="Steps on each branch, ends included"
    )
    settle: Pause = Field(default=0.3, description="Wait after each step")
    dwell: Duration = Field(default=1.0, description="Reading time on each step")
    loops: int = Field(default=2, ge=0, le=10, description="Conditioning loops")

    def trials(self) -> Trials:
        """Pauses for preparation, then one trial per step."""
        turn = self.most + max(BEYOND * self.most, LEAST_BEYOND)
        yield demagnetising(turn)
        quarter = 2.0
        loop = Waveform(
            np.array([0.0, 1.0, 3.0, 4.0]) * quarter, np.array([0.0, turn, -turn, 0.0])
        )
        for number in range(self.loops):
            yield self._move(f"conditioning {number + 1}", loop)
        up, last = np.linspace(-self.most, self.most, self.points), 0.0
        for branch, levels, start in (
            ("falling", up[::-1], turn),
            ("rising", up, -turn),
        ):
            yield self._move("turn", Waveform.through([(0.0, last), (2.0, start)]))
            last = start
            for level in levels.tolist():
                yield self._step(last, level, branch)
                last = level
        # the first steps once more, by the same way: what differs is drift
        yield self._move("turn", Waveform.through([(0.0, last), (2.0, turn)]))
        last = turn
        for level in up[::-1][:REPEATED].tolist():
            yield self._step(last, level, "again")
            last = level
        yield self._move("back to 0 A", Waveform.through([(0.0, last), (2.0, 0.0)]))

    def _move(self, label: str, current: Waveform) -> Trial:
        """A move of the current that is neither streamed nor stored."""
        nothing = Waveform.constant(0.0)
        return Trial(force=nothing, current=current, label=label, pause=True)

    def _step(self, last: float, level: float, branch: str) -> Trial:
        begin = RAMP + self.settle
        end = begin + self.dwell
        return Trial(
            force=Waveform.constant(0.0),
            current=Waveform.through([(0.0, last), (RAMP, level), (end, level)]),
            label=printed(f"{branch} {level * 1e3:.0f} mA"),
            hold=(begin, end),
        )

    def conclude(self, run: Measurement) -> Conclusion:
        """Slope, loop and uncertainty of B2(I), and the calibration file."""
        try:
            found = fit_field(_steps(run), run.warming)
        except NotIdentifiableError as reason:
            return Conclusion((f"No calibration: {reason}.",))
        slope, loop, along = found.slope, found.half_width, found.half_width_current
        sentences = (
            f"B2 rises by {plus_minus(slope.value, slope.half, 'T')}/A, from "
            f"{plus_minus(found.offset.value, found.offset.half, 'T')} at 0 A (95 %).",
            f"The loop is {plus_minus(loop.value, loop.half, 'T')} or "
            f"{plus_minus(along.value, along.half, 'A')} to either side (95 %); one "
            f"field is known to ±{show(found.uncertainty, 'T', 3)} (of those that "
            "come from saturation, at the loop's edge, 95 %; others lie within).",
            *_unlike_the_bench(found.slope.value, run.field_per_ampere),
            *_steady(found),
            *(f"{warning[0].upper()}{warning[1:]}." for warning in found.warnings),
        )
        values = {
            "slope_T_per_A": slope.value,
            "slope_low_95": slope.low,
            "slope_high_95": slope.high,
            "offset_T": found.offset.value,
            "half_width_T": loop.value,
            "half_width_uncertainty_T_95": loop.half,
            "half_width_A": along.value,
            "uncertainty_T": found.uncertainty,
            "drift_T": found.drift and found.drift.value,
            "drift_uncertainty_T_95": found.drift and found.drift.half,
            "warming_K": found.warming,
            "current_A": found.current.tolist(),
            "field_T": found.field.tolist(),
        }
        budgets = {"one field": found.budget}
        return Conclusion(sentences, values, files=_file(run, found), budgets=budgets)

    def plots(self, run: Measurement) -> Iterator[Plot]:
        """Both branches of B2(I), and what the straight line leaves of them."""
        try:
            steps = _steps(run)
            fit = fit_field(steps)
        except NotIdentifiableError:
            return  # the conclusion says why
        fields, left = [], []
        for branch, colour, mark in (
            ("rising", "V_C1", "up"),
            ("falling", "force", "down"),
        ):
            here = [s for s in steps if s.branch == branch]
            current = np.array([s.current for s in here])
            field = np.array([s.field for s in here])
            line = fit.slope.value * current + fit.offset.value
            look: Any = {"mark": mark, "colour": colour}
            fields.append(Series(x=current, y=field, name=branch, **look))
            left.append(Series(x=current, y=field - line, **look))
        yield Plot(
            name="figure",
            caption="Field of the electromagnet against current. Upper: both branches. "
            "Lower: each branch less the straight line of the mean curve.",
            x_label="Coil current",
            x_unit="A",
            panels=(
                Panel(label="B_2", unit="T", series=tuple(fields)),
                Panel(label="B_2 less line", unit="T", series=tuple(left), height=1.35),
            ),
        )


def _steps(run: Measurement) -> list[FieldStep]:
    """Mean reading and mean current of each step.

    Raises:
        NotIdentifiableError: the run has no readings.
    """
    if run.field is None or not len(run.field) or run.current is None:
        raise NotIdentifiableError("the run has no teslameter readings or no current")
    steps = []
    for trial in run.results:
        branch = BRANCHES.get(trial.label.partition(" ")[0])
        if branch is None or trial.held is None:
            continue
        readings = run.field_held(trial)
        applied = run.current_at(trial.held[1])
        if not readings.size or applied is None:
            continue
        error = standard_error(readings) if readings.size > 1 else HALF_A_DIGIT
        field = float(readings.mean())
        steps.append(
            FieldStep(branch=branch, current=applied, field=field, error=error)
        )
    return steps


def _unlike_the_bench(slope: float, believed: float | None) -> Iterator[str]:
    """What to look at where the slope, T/A, is not what the bench file supposes."""
    if not believed or not slope:
        return
    ratio = slope / believed
    said = (
        f"That is {printed(f'{ratio:.2g}')} times what the bench file had until now: "
    )
    if ratio < 0:
        yield (
            f"{said}the coil's leads or the probe are the other way round than it "
            "says. Turn what is wrong and calibrate again: with a probe that lies, "
            "each force would have the other sign."
        )
    elif not 1 / ROUGH <= ratio <= ROUGH:
        yield (
            f"{said}check the probe's place, the meter's unit and range, and both "
            "windings of the coil before it is used."
        )


def _steady(found: FieldCalibration) -> Iterator[str]:
    """What the checks of drift and temperature gave."""
    if found.drift is not None:
        yield (
            "At the same current and history the field changed by "
            f"{plus_minus(found.drift.value, found.drift.half, 'T')} from begin to end "
            "(95 %)."
        )
    if found.warming is not None:
        yield (
            f"The winding became {found.warming:.0f} K warmer by its resistance (no "
            "interval: sources state none for what they read)."
        )


def _file(run: Measurement, found: FieldCalibration) -> dict[str, str]:
    """The calibration file a bench may name; none for a run without a date."""
    try:
        date = datetime.date.fromisoformat(run.started[:10])
    except ValueError:
        return {}
    text = calibration_text(
        found,
        coil=run.settings.get("coil", {}).get("identity", run.bench),
        date=date,
        temperature=run.conditions.get("temperature", "not known"),
    )
    return {"calibration.csv": text}
