"""The critical force followed through time and temperature, up and down by one step."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field, model_validator

from tactile_lab.analysis.estimate import Estimate, Line
from tactile_lab.arrays import FloatArray
from tactile_lab.conclusion import NOT_SEARCHED, Conclusion
from tactile_lab.measurement import MeasuredTrial, Measurement
from tactile_lab.plot import Panel, Plot, Series
from tactile_lab.quantity import Duration, Force, Pause, Unit, count, show
from tactile_lab.stimulus.force import step
from tactile_lab.stimulus.recovery import Recovering
from tactile_lab.trial import Trials

Step = Annotated[float, Unit("N", above=0.0)]

FEWEST = 4
"""Critical forces below which no line is drawn through them."""

HOUR = 3600.0


class ThresholdDrift(Recovering):
    """Press after press a step less where it fired and a step more where it did not.

    Once the critical force is reached the presses go up and down around it and follow
    it. Each press that fired and a silent one beside it hold it between them. A sensor
    that fires when pulled is pulled: more is then farther below 0 N.
    """

    name: ClassVar[str] = "threshold_drift"
    title: ClassVar[str] = "Drift of the critical force"
    needs: ClassVar[tuple[str, ...]] = ("spikes",)
    as_wired: ClassVar[bool] = True

    begin: Force = Field(default=0.1, description="Force of the first press")
    step: Step = Field(default=1e-3, description="Change from press to press")
    presses: int = Field(default=40, ge=4, le=5000, description="How many presses")
    ramp: Pause = Field(default=0.25, description="Ramp up and ramp down, each")
    hold: Duration = Field(default=1.0, description="Time at each force")

    @model_validator(mode="after")
    def _within_reach(self) -> ThresholdDrift:
        if self.step >= abs(self.begin):
            raise ValueError(
                f"step must be smaller than begin, {show(self.begin, 'N')}"
            )
        return self

    def wishes(self) -> tuple[str, ...]:
        """The temperature, where the bench reads it."""
        return (*super().wishes(), "temperature")

    def presentations(self) -> Trials:
        """Each press decides the next one."""
        size, way = abs(self.begin), math.copysign(1.0, self.begin)
        for left in reversed(range(self.presses)):
            outcome = yield step(way * size, ramp=self.ramp, hold=self.hold)
            fires = outcome.spike_times.size > 0
            if left:
                yield from self.recover(size, None)
            size = max(size - self.step, self.step) if fires else size + self.step

    def conclude(self, run: Measurement) -> Conclusion:
        """How the critical force moved, by hour and by kelvin."""
        if not run.searched:
            return Conclusion(missing=(NOT_SEARCHED,))
        found = brackets(run)
        values: dict[str, Any] = {
            "critical_forces": [
                {"time_s": b.time, "force_N": b.middle, "half_width_N": b.half,
                 "uncertainty_N_95": _alone(run, b), "temperature_K": b.kelvin}
                for b in found
            ]
        }  # fmt: skip
        if len(found) < FEWEST:
            said = (
                f"{count(len(found), 'pair')} of presses held the critical force "
                f"between them, no press counted twice; {FEWEST} are needed. Begin "
                "nearer to it, or press more often."
            )
            return Conclusion((), values, (said,))
        forces = np.array([b.middle for b in found])
        sentences = [
            f"The critical force lay between {show(forces.min(), 'N')} and "
            f"{show(forces.max(), 'N')}, each known to ±{show(found[0].half, 'N', 2)} "
            f"({len(found)} values).",
            *_stated(run, found, float(forces.mean())),
        ]
        by_time = _slope(found, np.array([b.time for b in found]) / HOUR)
        values["drift_N_per_h"] = by_time
        if by_time is not None:
            sentences.append(f"It drifted by {by_time.text('mN/h', 1e3)}.")
        kelvin = _temperatures(found)
        by_kelvin = None if kelvin is None else _slope(found, kelvin)
        values["drift_N_per_K"] = by_kelvin
        if kelvin is None:
            sentences.append("No temperature was read beside it.")
        elif by_kelvin is None:
            sentences.append("The temperature did not change.")
        else:
            sentences.append(
                f"With temperature, {show(kelvin.min(), 'K', 5)} to "
                f"{show(kelvin.max(), 'K', 5)}, it changed by "
                f"{by_kelvin.text('mN/K', 1e3)}. That two things move together does "
                "not tell which of them moves the other."
            )
        if by_time is not None:
            sentences.append(
                "The intervals hold the scatter about a straight line and, besides, "
                "one step over the whole range."
            )
        return Conclusion(tuple(sentences), values)

    def plots(self, run: Measurement) -> Iterator[Plot]:
        """The critical force against temperature, or against time without one."""
        found = brackets(run)
        if len(found) < 2:
            return
        kelvin = _temperatures(found)
        time = np.array([b.time for b in found])
        x, label, unit = (
            (time, "Time", "s") if kelvin is None else (kelvin, "Temperature", "K")
        )
        forces = np.array([b.middle for b in found])
        points = Series(
            x=x,
            y=forces,
            name=run.origin,
            mark="points",
            y_error=np.array([b.half for b in found]),
        )
        lines = []
        if len(found) >= FEWEST and _slope(found, x) is not None:
            line, ends = Line.through(x, forces), np.array([x.min(), x.max()])
            fitted = line.offset.value + line.slope.value * ends
            lines = [Series(x=ends, y=fitted, name="line", mark="line", colour="quiet")]
        yield Plot(
            name="summary",
            caption=f"Critical force against {label.lower()}; bars: half the bracket "
            "of a press that fired and a silent one.",
            x_label=label,
            x_unit=unit,
            x_prefix="",
            panels=(Panel(label="Critical force", unit="N", series=(points, *lines)),),
        )


@dataclass(frozen=True)
class ForceBracket:
    """A press that fired and a silent one that followed each other.

    Attributes:
        time: of the middle between the two, s.
        middle, half: of the critical force, N.
        kelvin: mean temperature of the two, K; None where it was not read in both.
    """

    time: float
    middle: float
    half: float
    kelvin: float | None


def brackets(run: Measurement) -> list[ForceBracket]:
    """What holds the critical force between two presses; no press is used twice."""
    pressed = [t for t in run.results if t.level is not None and t.complete]
    found, i = [], 0
    while i + 1 < len(pressed):
        one, other = pressed[i], pressed[i + 1]
        if bool(one.response.spikes) == bool(other.response.spikes):
            i += 1
            continue
        found.append(_bracket(run, one, other))
        i += 2
    return found


def _bracket(
    run: Measurement, one: MeasuredTrial, other: MeasuredTrial
) -> ForceBracket:
    forces = [float(t.level or 0.0) for t in (one, other)]
    warm = [run.temperature_in(t) for t in (one, other)]
    known = [kelvin for kelvin in warm if kelvin is not None]
    return ForceBracket(
        time=(one.start + other.start + other.duration) / 2,
        middle=sum(forces) / 2,
        half=abs(forces[0] - forces[1]) / 2,
        kelvin=sum(known) / 2 if len(known) == 2 else None,
    )


def _alone(run: Measurement, bracket: ForceBracket) -> float | None:
    """95 % of one critical force, N, by its bracket and what is stated of forces."""
    known = run.uncertain(bracket.middle)
    return None if known is None else math.hypot(bracket.half, known)


def _stated(
    run: Measurement, found: list[ForceBracket], force: float
) -> tuple[str, ...]:
    """What calibration and geometry leave open of all forces together, and of each."""
    known = run.uncertain(force)
    if known is None:
        return run.not_stated
    alone = max(_alone(run, bracket) or known for bracket in found)
    said = (
        f"All of them together may be off by {show(known, 'N', 2)} (95 %), by what "
        "calibration and geometry leave open; each by itself, with half its bracket, "
        f"by {show(alone, 'N', 2)}."
    )
    return (said, *run.not_stated)


def _temperatures(found: list[ForceBracket]) -> FloatArray | None:
    known = [b.kelvin for b in found if b.kelvin is not None]
    return np.array(known) if len(known) == len(found) else None


def _slope(found: list[ForceBracket], x: FloatArray) -> Estimate | None:
    """Change of the critical force with `x`, N per its unit; None where x stands still.

    A force that moves by less than a step may not be seen at all: a step over the range
    of x is part of the interval.
    """
    reach = float(np.ptp(x))
    if reach <= 0:
        return None
    line = Line.through(x, np.array([b.middle for b in found]))
    return line.slope.widened(2 * found[0].half / reach)
