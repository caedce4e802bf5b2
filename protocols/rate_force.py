"""Rate against force: separate steps from rest, with recovery between them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from pydantic import Field

from protocols.threshold_search import critical_force, rate_against_force
from tactile_lab.analysis.circuit_adaptation import followed
from tactile_lab.analysis.estimate import Estimate
from tactile_lab.analysis.rate_force import eq15_rate, fit_rate_law
from tactile_lab.analysis.spike_train import within
from tactile_lab.conclusion import Conclusion
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.measurement import MeasuredTrial, Measurement
from tactile_lab.plot import Plot, Series
from tactile_lab.quantity import Duration, Force, Pause, plus_minus, show
from tactile_lab.stimulus.force import step
from tactile_lab.stimulus.levels import Levels
from tactile_lab.stimulus.recovery import Recovering, first_rest
from tactile_lab.trial import Trials


class RateForce(Recovering, Levels):
    """The highest rate of a step from rest, per force (Fig. 4d), and its onset.

    A staircase would not do: V_P is a high-pass of force, so each step of a staircase
    acts as less than its value.
    """

    name: ClassVar[str] = "rate_force"
    title: ClassVar[str] = "Rate against force"

    levels: tuple[Force, ...] = Field(
        default=(0.085, 0.095, 0.1, 0.11, 0.125, 0.15, 0.175, 0.2),
        min_length=1,
        description="Force of each step",
    )
    ramp: Pause = Field(default=0.25, description="Ramp up and ramp down, each")
    hold: Duration = Field(default=1.0, description="Time at each level")

    def presentations(self) -> Trials:
        """One step per level, recovery after each but the last."""
        first, levels = None, self.ordered()
        for number, level in enumerate(levels):
            outcome = yield step(level, ramp=self.ramp, hold=self.hold)
            if number == 0:
                first = first_rest(outcome)
            if number + 1 < len(levels):
                yield from self.recover(level, first)

    def conclude(self, run: Measurement) -> Conclusion:
        """The critical force, the slope above it, and the rates beside Eq. (15)."""
        found = critical_force(run, self.ramp, self.hold)
        if not run.searched:
            return found
        return found + _slope(run, self.ramp) + _beside_eq15(run, self.ramp)

    def plots(self, run: Measurement) -> Iterator[Plot]:
        """Rate against force, and Eq. (15)."""
        forces = [t.level for t in run.results if t.level is not None]
        expected: tuple[Series, ...] = ()
        if run.circuit is not None and forces:
            low, high = min(forces), max(forces)
            low, high = (
                low * (0.9 if low > 0 else 1.03),
                high * (1.03 if high > 0 else 0.9),
            )
            swept = np.linspace(low, high, 400)
            rate = [eq15_rate(run.circuit, float(f), self.ramp) for f in swept]
            expected = (
                Series(x=swept, y=rate, name="Eq. (15)", mark="dashed", colour="I_DS"),
            )
        yield from rate_against_force(
            run,
            "Highest rate in the hold of each step from rest against its force, as in "
            "Fig. 4d, and the spikes in it. Line: Eq. (15) with the current at the "
            f"end of the ramp; it knows {_unknown(run)}. Grey band: the critical force "
            "lies within.",
            *expected,
        )


def _slope(run: Measurement, ramp: float) -> Conclusion:
    """The local slope of rate over force by Eq. (15), at the least and largest force.

    V_GS and the force's scale are fitted to the intervals in the holds.
    """
    from tactile_lab.model.simulate import simulate

    rated = [
        t for t in run.results
        if t.level is not None and t.hold is not None
        and t.response.peak_rate is not None
    ]  # fmt: skip
    if run.circuit is None or not rated:
        why = "No slope: at no force were two spikes detected within a hold."
        return Conclusion((), {"slopes": None}, (why,))
    trains = []
    for t in rated:
        begin, end = t.held or (0.0, 0.0)
        begin += followed(run.circuit, t.came)
        trains.append(within(t.spike_times + t.start, (begin, end)))
    believed = simulate(run.circuit, run.force, keep=("V_P",), until=run.duration)
    try:
        law = fit_rate_law(
            run.circuit, lambda time: believed.sample("V_P", time), trains,
            run.displaced.values(),
        )  # fmt: skip
    except NotIdentifiableError as reason:
        return Conclusion((), {"slopes": None}, (f"No slope: {reason}.",))
    found: list[tuple[float, Estimate]] = []
    levels = [_level(t) for t in rated]
    for level in sorted({min(levels), max(levels)}):  # one where all are equal
        slope, known = law.slope(level, ramp), run.uncertain(level)
        if known is not None:  # the force is another there, and so is a newton
            off = 1 + known / level
            other = law.slope(level * off, ramp).value * off
            slope = slope.widened(abs(other - slope.value))
        found.append((level, slope))
    told = " and ".join(
        f"{slope.text('Hz/mN', 1e-3)} at {show(level, 'N')}" for level, slope in found
    )
    said = (
        f"The rate at the end of the ramp rises by {told}: the slope of Eq. (15) with "
        f"a V_GS of {plus_minus(law.V_GS.value, law.V_GS.half, 'V')} and "
        f"{plus_minus(law.scale.value, law.scale.half)} of the stated force, fitted to "
        f"the {law.intervals} intervals in the holds once node A had followed (the "
        "circuit's other parameters as believed)."
    )
    values = {
        "slopes": [
            {"force_N": level, "slope_Hz_per_N": slope} for level, slope in found
        ],
        "rate_law_V_GS_V": law.V_GS, "rate_law_scale": law.scale,
    }  # fmt: skip
    return Conclusion((said,), values)


def _unknown(run: Measurement) -> str:
    """What Eq. (15) leaves out of the rate of a step."""
    if run.circuit is not None and run.circuit.saturation:
        return "neither adaptation nor that T1 saturates"
    return "no adaptation"


def _level(trial: MeasuredTrial) -> float:
    return trial.level or 0.0


def _beside_eq15(run: Measurement, ramp: float) -> Conclusion:
    """The highest rates over those of Eq. (15)."""
    ratios = [
        t.response.peak_rate / expected
        for t in run.results
        if run.circuit is not None
        and t.response.peak_rate is not None
        and t.hold is not None
        and t.level is not None
        and (expected := eq15_rate(run.circuit, t.level, ramp)) > 0
    ]
    if not ratios:
        return Conclusion()
    told = f"The highest rate is {ratios[0]:.2f}"
    if len(ratios) > 1:
        told = f"The highest rates are {min(ratios):.2f} to {max(ratios):.2f}"
    said = (
        f"{told} of what Eq. (15) gives for the current at the end of the ramp, which "
        f"knows {_unknown(run)}."
    )
    return Conclusion((said,), {"peak_rate_over_eq15": ratios})
