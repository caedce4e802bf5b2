"""V_GS trimmed until the critical force is the one wanted, by bisection."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from protocols.threshold_search import NOTED, still_held
from tactile_lab.analysis.error_budget import ErrorBudget
from tactile_lab.analysis.rate_force import Bracket
from tactile_lab.conclusion import NOT_SEARCHED, Conclusion
from tactile_lab.errors import LimitError, NotIdentifiableError
from tactile_lab.measurement import MeasuredTrial, Measurement
from tactile_lab.plot import Guide, Mark, Panel, Plot, Series
from tactile_lab.quantity import Duration, Force, Pause, Unit, Voltage, plus_minus, show
from tactile_lab.stimulus.force import pause, step
from tactile_lab.stimulus.recovery import Recovering
from tactile_lab.trial import Outcome, Trial, Trials

Margin = Annotated[float, Unit("N", least=0.0)]
Width = Annotated[float, Unit("V", above=0.0)]


class ThresholdTrim(Recovering):
    """Find the V_GS at which the sensor begins to fire under just the force wanted.

    Each trial presses with that force at another V_GS, which a source meter of the
    bench holds: a spike means that V_GS is too high, silence that it is too low. At the
    end it is pressed a little less and a little more at the V_GS found, as a check. A
    force below 0 N is of a sensor that fires when pulled.
    """

    name: ClassVar[str] = "threshold_trim"
    title: ClassVar[str] = "Trim of V_GS"
    sets: ClassVar[tuple[str, ...]] = ("V_GS",)
    needs: ClassVar[tuple[str, ...]] = ("spikes",)
    as_wired: ClassVar[bool] = True

    wanted: Force = Field(default=0.09, description="Critical force to have")
    low: Voltage = Field(default=1.38, description="V_GS expected to stay silent")
    high: Voltage = Field(default=1.45, description="V_GS expected to fire")
    resolution: Width = Field(default=5e-4, description="Width of V_GS to end with")
    margin: Margin = Field(
        default=2e-3, description="Less and more force that checks it; 0 for no check"
    )
    ramp: Pause = Field(default=0.25, description="Ramp up and ramp down, each")
    hold: Duration = Field(default=1.0, description="Time at the force")

    @model_validator(mode="after")
    def _ordered(self) -> ThresholdTrim:
        if self.low >= self.high:
            raise ValueError(
                f"low {show(self.low, 'V')} must be below high {show(self.high, 'V')}"
            )
        if self.margin >= abs(self.wanted):
            raise ValueError(
                f"margin must be smaller than wanted, {show(self.wanted, 'N')}"
            )
        return self

    @property
    def _around(self) -> tuple[float, float]:
        """A little less and a little more than what is wanted, N."""
        margin = math.copysign(self.margin, self.wanted)
        return self.wanted - margin, self.wanted + margin

    def presentations(self) -> Trials:
        """First at `high`, then at `low`, then at halves of what is left; a check.

        Raises:
            LimitError: it stays silent at `high`, or fires at `low`: between them no
                V_GS gives the critical force wanted.
        """
        wanted, low, high = show(self.wanted, "N"), self.low, self.high
        outcome = yield self._press(high)
        if not outcome.spike_times.size:
            raise LimitError(
                f"At V_GS = {show(high, 'V', 5)} the sensor stays silent under "
                f"{wanted}, so its critical force lies farther from 0 N for every V_GS "
                "allowed. Raise protocol.high, within the source's limits, or want "
                "more force."
            )
        outcome = yield from self._after_rest(low)
        if outcome.spike_times.size:
            raise LimitError(
                f"At V_GS = {show(low, 'V', 5)} the sensor fires under {wanted}, so "
                "its critical force lies nearer to 0 N for every V_GS allowed. Lower "
                "protocol.low, within the source's limits, or want less force."
            )
        while high - low > self.resolution * (1 + 1e-9):
            middle = (low + high) / 2
            outcome = yield from self._after_rest(middle)
            fires = outcome.spike_times.size > 0
            low, high = (low, middle) if fires else (middle, high)
        if self.margin:
            found = (low + high) / 2
            for force in self._around:
                yield from self._after_rest(found, force)

    def _after_rest(
        self, volts: float, force: float | None = None
    ) -> Generator[Trial, Outcome, Outcome]:
        """Press at `volts`, V, once the film has forgotten the press before.

        The source is set as the recovery begins, so that the circuit settles in it.
        """
        recovery = self.recovery_time(self._around[1])
        yield replace(pause(recovery), voltages={"V_GS": volts})
        return (yield self._press(volts, force))

    def _press(self, volts: float, force: float | None = None) -> Trial:
        level = self.wanted if force is None else force
        pressed = step(level, ramp=self.ramp, hold=self.hold)
        label = f"{show(level, 'N')} at {show(volts, 'V', 6)}"
        return replace(pressed, label=label, voltages={"V_GS": volts})

    def conclude(self, run: Measurement) -> Conclusion:
        """The V_GS found, how well it and the critical force are known, the check."""
        if not run.searched:
            return Conclusion(missing=(NOT_SEARCHED,))
        try:
            found = self._found(run)
        except NotIdentifiableError as reason:
            return Conclusion((), {"V_GS_V": None}, (f"No V_GS found: {reason}.",))
        return found.conclusion(run, self) + self._check(run, found)

    def plots(self, run: Measurement) -> Iterator[Plot]:
        """Spikes against V_GS."""
        pressed = self._pressed(run)
        if len(pressed) < 2:
            return
        volts = np.array([at for at, _ in pressed])
        spikes = np.array([trial.response.spikes for _, trial in pressed])
        error = run.source_error("V_GS", float(volts.mean()))
        bands: tuple[Guide, ...] = ()
        try:
            found = self._found(run)
            bands = (Guide(at=found.silent, to=found.fires),)
        except NotIdentifiableError:
            pass  # no band to draw; the conclusion says why

        def points(name: str, mark: Mark, which: NDArray[np.bool_]) -> Series:
            size = None if error is None else np.full(which.sum(), error)
            at = volts[which], spikes[which]
            return Series(x=at[0], y=at[1], name=name, mark=mark, x_error=size)

        series = [points(run.origin, "points", spikes > 0)] if spikes.any() else []
        if not spikes.all():
            series.append(points("silent", "open", spikes == 0))
        yield Plot(
            name="summary",
            caption=f"Spikes of each press with {show(self.wanted, 'N')} against V_GS "
            "as its source was read back, bars: the source's error; open: silent. Grey "
            "band: the V_GS that gives this critical force lies within.",
            x_label="V_GS",
            x_unit="V",
            x_prefix="",
            panels=(
                Panel(
                    label="Spikes",
                    prefix="",
                    series=tuple(series),
                    guides=bands,
                    limits=(0, None),
                ),
            ),
        )

    def _pressed(self, run: Measurement) -> list[tuple[float, MeasuredTrial]]:
        """V_GS as read back, V, and the trial, of each press with the force wanted."""
        trials = [t for t in run.results if t.level == self.wanted and t.complete]
        held = [(run.source_read("V_GS", trial), trial) for trial in trials]
        return [(volts, trial) for volts, trial in held if volts is not None]

    def left_in_film(self, run: Measurement, found: Bracket) -> float:
        """The most that presses before left in the film at those of a bracket, N."""
        between = found.silent, found.fires
        return run.left_in_film(t for v, t in self._pressed(run) if v in between)

    def _found(self, run: Measurement) -> TrimmedGate:
        pressed = self._pressed(run)
        silent = [volts for volts, trial in pressed if not trial.response.spikes]
        fires = [volts for volts, trial in pressed if trial.response.spikes]
        if not silent or not fires:
            raise NotIdentifiableError(
                "it did not both fire and stay silent under the force wanted"
            )
        if max(silent) >= min(fires):
            raise NotIdentifiableError(
                f"it fired at {show(min(fires), 'V', 6)} and was silent at "
                f"{show(max(silent), 'V', 6)}: V_GS, temperature or the film drifted "
                "meanwhile, or noise decides; repeat it, or allow a coarser resolution"
            )
        return TrimmedGate(max(silent), min(fires))

    def _check(self, run: Measurement, found: TrimmedGate) -> Conclusion:
        """Whether a little less force leaves it silent and a little more fires it."""
        less, more = (_spikes(run.results, force) for force in self._around)
        if not self.margin or less is None or more is None:
            return Conclusion(values={"checked": None})
        good = less == 0 and more > 0
        below, above = (show(force, "N") for force in self._around)
        told = (
            f"Checked at {show(found.middle, 'V', 6)}: {below} gives "
            f"{less or 'no'} spikes, {above} {more or 'none'}"
        )
        if good:
            return Conclusion((told + ".",), {"checked": True})
        return Conclusion(
            (),
            {"checked": False},
            (
                f"{told}: the critical force is not within {show(self.margin, 'N')} of "
                f"{show(self.wanted, 'N')}. Something drifted meanwhile; repeat it.",
            ),
        )


@dataclass(frozen=True)
class TrimmedGate(Bracket):
    """The V_GS wanted lies between these two, V, as the source was read back."""

    def conclusion(self, run: Measurement, asked: ThresholdTrim) -> Conclusion:
        """What it means, in sentences and values."""
        wanted = asked.wanted
        film, slope = asked.left_in_film(run, self), 0.0
        if run.circuit is not None:
            slope = abs(run.circuit.k_F)
        half = self.half_width + slope * abs(film)
        values: dict[str, float | None] = {
            "V_GS_V": self.middle,
            "V_GS_half_width_V": self.half_width,
            "critical_force_N": wanted,
            "critical_force_left_in_film_N": film,
        }
        sentences = [
            f"V_GS = {plus_minus(self.middle, half, 'V')}, as "
            f"its source reads it, puts the critical force at {show(wanted, 'N')} for "
            f"a ramp of {asked.ramp:g} s and a hold of {asked.hold:g} s: silent at "
            f"{show(self.silent, 'V', 6)}, fires at {show(self.fires, 'V', 6)}. To use "
            f'it, write [sensor] V_GS = "{self.middle:.5f} V" and sourced = ["V_GS"].'
        ]
        if slope * abs(film) > NOTED * self.half_width:
            sentences.append(still_held(film, wanted) + " That is in the ±.")
        error = run.source_error("V_GS", self.middle)
        parts = {"resolution": half, "source": error}
        budgets = {"V_GS": ErrorBudget("V", parts)}
        whole = budgets["V_GS"].whole
        values["V_GS_uncertainty_V"] = None if error is None else whole
        if error is not None:
            sentences.append(
                f"By another voltmeter it is known to ±{show(whole, 'V', 2)}: the "
                "bound that the source's maker gives for its reading is in it."
            )
        if run.circuit is not None:
            values["critical_force_half_width_N"] = self.half_width / slope
            left = half / slope
            known = run.uncertain(wanted)
            budget = ErrorBudget("N", {"resolution": left, "force": known})
            budgets["critical force"] = budget
            told = f"The critical force is within ±{show(left, 'N', 2)} of that"
            if known is None:
                sentences.append(f"{told} (k_F of Eqs. (3)-(6)).")
            else:
                both = budget.whole
                values["critical_force_uncertainty_N_95"] = both
                sentences.append(
                    f"{told} (k_F of Eqs. (3)-(6)); with the calibration's "
                    f"uncertainty ±{show(both, 'N', 2)} (95 %)."
                )
            sentences += run.not_stated
        return Conclusion(tuple(sentences), values, budgets=budgets)


def _spikes(trials: Sequence[MeasuredTrial], level: float) -> int | None:
    """Spikes of the press with that force, N; None where there was none."""
    at = [t.response.spikes for t in trials if t.level == level and t.complete]
    return at[0] if at else None
