"""The critical force, by bisection: each trial decides the next one."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tactile_lab.analysis.estimate import student_95
from tactile_lab.analysis.rate_force import Bracket, onset
from tactile_lab.conclusion import NOT_SEARCHED, Conclusion
from tactile_lab.errors import LimitError, NotIdentifiableError
from tactile_lab.measurement import MeasuredTrial, Measurement
from tactile_lab.model.circuit import Circuit
from tactile_lab.plot import Guide, Mark, Panel, Plot, Series
from tactile_lab.quantity import Duration, Force, Pause, Unit, show
from tactile_lab.stimulus.force import step
from tactile_lab.stimulus.recovery import Recovering, first_rest
from tactile_lab.trial import Outcome, Trial, Trials
from tactile_lab.waveform import Waveform

Resolution = Annotated[float, Unit("N", above=0.0)]
TOLD = 1e-3
"""Part of V_fire by which it has to scatter to be told."""
NOTED = 0.1
"""Part of half a bracket from which on what the film held is told."""
SCATTER_UNKNOWN = (
    "The intervals in the holds do not tell how far V_fire scatters from spike to "
    "spike: by what a single press may lie off for it is in none of these numbers."
)


class ThresholdSearch(Recovering):
    """Bisect for the smallest force that makes the sensor fire.

    Of pulls, below 0 N, it is the weakest: a sensor may be mounted the other way.
    The critical force belongs to its ramp and hold: the slower the ramp, the more the
    film adapts meanwhile. Both are stated with the result.
    """

    name: ClassVar[str] = "threshold_search"
    title: ClassVar[str] = "Critical force"

    low: Force = Field(default=0.06, description="Force expected to stay silent")
    high: Force = Field(default=0.14, description="Force expected to fire")
    resolution: Resolution = Field(default=1e-3, description="Width to end with")
    ramp: Pause = Field(default=0.25, description="Ramp up and ramp down, each")
    hold: Duration = Field(default=1.0, description="Time at each level")

    @model_validator(mode="after")
    def _ordered(self) -> ThresholdSearch:
        if abs(self.low) >= abs(self.high) or self.low * self.high < 0:
            raise ValueError(
                f"low {show(self.low, 'N')} must be nearer to 0 N than high "
                f"{show(self.high, 'N')}, and of the same sign"
            )
        return self

    def presentations(self) -> Trials:
        """First `high`, then `low`, then halves of what is left.

        Raises:
            LimitError: `high` stays silent, or `low` fires.
        """
        outcome = yield self._step(self.high)
        first = first_rest(outcome)
        if not fired(outcome):
            raise LimitError(
                f"{show(self.high, 'N')} does not make the sensor fire; take "
                "protocol.high farther from 0 N, or trim V_GS so that it sits nearer "
                "to its threshold."
            )
        yield from self.recover(self.high, first)
        outcome = yield self._step(self.low)
        if fired(outcome):
            raise LimitError(
                f"{show(self.low, 'N')} already makes the sensor fire; take "
                "protocol.low nearer to 0 N. If it fires at rest, lower V_GS."
            )
        low, high, last = self.low, self.high, self.low
        while abs(high - low) > self.resolution * (1 + 1e-9):
            yield from self.recover(last, first)
            last = (low + high) / 2
            outcome = yield self._step(last)
            low, high = (low, last) if fired(outcome) else (last, high)

    def _step(self, level: float) -> Trial:
        return step(level, ramp=self.ramp, hold=self.hold)

    def conclude(self, run: Measurement) -> Conclusion:
        """The critical force, and the V_GS that explains it."""
        return critical_force(run, self.ramp, self.hold)

    def plots(self, run: Measurement) -> Iterator[Plot]:
        """Rate against force, with the critical force."""
        yield from rate_against_force(
            run,
            "Highest rate in the hold, where it has two spikes or more, and number of "
            "spikes of each trial against its force; open: too few spikes for a "
            "rate, or none. Grey band: the critical force lies within.",
        )


def fired(outcome: Outcome) -> bool:
    """Whether the trial gave a spike."""
    return outcome.spike_times.size > 0


def critical_force(run: Measurement, ramp: float, hold: float) -> Conclusion:
    """Between which forces the sensor begins to fire, for that ramp and hold, s."""
    if not run.searched:
        return Conclusion(missing=(NOT_SEARCHED,))
    try:
        found = _onset(run.results)
    except NotIdentifiableError as reason:
        return Conclusion(
            (), {"critical_force_N": None}, (f"No critical force: {reason}.",)
        )
    sentence = (
        f"Critical force: between {show(found.silent, 'N')} (silent) and "
        f"{show(found.fires, 'N')} (fires), for a ramp of {ramp:g} s and a hold of "
        f"{hold:g} s."
    )
    told = _scatter_of_V_fire(run)
    noise = told or 0.0
    known, scatter = run.uncertain(found.middle), _moved_by(run, noise)
    left = _left_in_film(run, found)
    values = {
        "critical_force_N": found.middle,
        "critical_force_half_width_N": found.half_width,
        "critical_force_scatter_N_95": scatter,
        "critical_force_left_in_film_N": left,
    }
    whole = math.hypot(found.half_width + abs(left), scatter, known or 0.0)
    parts, said = ["half the bracket"], []
    if abs(left) > NOTED * found.half_width:
        parts.append("what the film held")
        said.append(still_held(left, found.middle))
    if _is_told(run, noise):
        parts.append("V_fire's scatter")
        said.append(
            f"V_fire scatters by ±{show(noise, 'V', 2)} (95 %) from spike to spike, as "
            "the intervals in the holds tell: by as much as "
            f"±{show(scatter, 'N', 2)} a single press may lie beside the others."
        )
    elif told is None:
        said.append(SCATTER_UNKNOWN)
    if known is not None:
        values["critical_force_uncertainty_N_95"] = whole
        stated = run.force_uncertainty
        parts.append(f"what the bench states of forces, {stated and stated.text}")
    if len(parts) > 1:
        *others, last = parts
        said.append(
            f"With {', '.join(others)} and {last}: ±{show(whole, 'N', 2)} (95 %)."
        )
    if known is None:
        said += run.not_stated
    gate = _gate(run, found, math.hypot(left, known or 0.0), noise)
    return Conclusion((sentence, *said), values) + gate


def rate_against_force(run: Measurement, caption: str, *more: Series) -> Iterator[Plot]:
    """Rate and spikes in the hold against the force; none below two trials.

    What gave no rate stands hollow at 0, and spikes of the ramps have marks of their
    own: beyond the force that silences a T1 that saturates only these are left.

    Args:
        run: what was measured.
        caption: of the plot.
        more: further series, below the points.
    """
    trials = [t for t in run.results if t.level is not None]
    if len(trials) < 2:
        return
    force = np.array([t.level for t in trials], dtype=np.float64)
    # one spike has no rate
    rate = np.array([t.response.peak_rate for t in trials], dtype=np.float64)
    ramped = np.array([t.response.ramp_spikes for t in trials])
    held = np.array([t.response.spikes for t in trials]) - ramped
    known = run.force_uncertainty
    error = None if known is None else known.of(force)
    bands: tuple[Guide, ...] = ()
    try:
        found = _onset(trials)
        half = math.hypot(
            found.half_width + abs(_left_in_film(run, found)),
            _moved_by(run, _scatter_of_V_fire(run) or 0.0),
            run.uncertain(found.middle) or 0.0,
        )
        bands = (Guide(at=found.middle - half, to=found.middle + half),)
    except NotIdentifiableError:
        pass  # no band to draw; the conclusion says why

    def points(
        values: NDArray[Any], which: NDArray[np.bool_], mark: Mark, name: str
    ) -> Iterator[Series]:
        if which.any():
            yield Series(
                x=force[which],
                y=values[which],
                name=name,
                mark=mark,
                x_error=None if error is None else error[which],
            )

    known_rate = np.isfinite(rate)
    rated = (
        *points(rate, known_rate, "points", run.origin),
        *points(np.zeros_like(rate), ~known_rate, "open", "fewer than two spikes"),
    )
    counted = (
        *points(held, held > 0, "points", ""),
        *points(held, held == 0, "open", "none in the hold"),
        *points(ramped, ramped > 0, "up", "in the ramps"),
    )
    yield Plot(
        name="summary",
        caption=caption,
        x_label="Force",
        x_unit="N",
        panels=(
            Panel(
                label="Highest rate",
                unit="Hz",
                prefix="",
                series=(*more, *rated),
                guides=bands,
                limits=(0, None),
            ),
            Panel(
                label="Spikes in hold",
                prefix="",
                series=counted,
                guides=bands,
                limits=(0, None),
                height=1.0,
            ),
        ),
    )


def _onset(trials: Sequence[MeasuredTrial]) -> Bracket:
    forces = [float(t.level or 0.0) for t in trials]
    return onset(forces, [t.response.spikes for t in trials])


def _left_in_film(run: Measurement, found: Bracket) -> float:
    """The most that forces before left in the film at the presses of a bracket, N."""
    between = found.silent, found.fires
    return run.left_in_film(t for t in run.results if t.level in between)


def still_held(left: float, level: float) -> str:
    """What it means that the film held `left` N as presses with `level` N began."""
    more = "more" if left * level > 0 else "less"
    return (
        "The film still held a part of the forces before (Eq. (7)): from rest these "
        f"presses are as up to {show(abs(left), 'N', 2)} {more}. protocol.residual "
        "says when the next one begins."
    )


def _gate(
    run: Measurement, found: Bracket, force_error: float, noise: float
) -> Conclusion:
    """V_GS from the applied force of the two trials that bracket the onset."""
    from tactile_lab.analysis.operating_point import V_GS_of_onset

    if run.circuit is None:
        return Conclusion()
    silent, fires = (
        _applied(run, next(t for t in run.results if t.level == level))
        for level in (found.silent, found.fires)
    )
    displaced = list(run.displaced.values())
    if noise:
        displaced.append(_fires_later(run.circuit, noise))
    try:
        low, high = V_GS_of_onset(run.circuit, silent, fires, force_error, displaced)
    except NotIdentifiableError as reason:
        return Conclusion((f"No V_GS is told of the critical force: {reason}.",))
    said = (
        f"By the model, a V_GS of {show((low + high) / 2, 'V', 5)} "
        f"({show(low, 'V', 5)} to {show(high, 'V', 5)}, 95 %, the circuit's other "
        "parameters as believed) explains it; "
        f"{show(run.circuit.V_GS, 'V', 5)} is believed."
    )
    if _is_told(run, noise):
        said += " V_fire's scatter is in it."
    return Conclusion((said,), {"V_GS_low_V": low, "V_GS_high_V": high})


def _scatter_of_V_fire(run: Measurement) -> float | None:
    """How far V_fire of a single press may lie from its mean, V (95 %).

    From the intervals within the holds; None where they do not tell: too few of them,
    or of a T1 that saturates.
    """
    from tactile_lab.analysis.circuit_adaptation import FOLLOWED
    from tactile_lab.analysis.evidence import LONGEST
    from tactile_lab.analysis.identify import identify

    circuit, spikes = run.circuit, run.spike_times
    held = np.zeros(spikes.size, dtype=np.bool_)
    for trial in run.results:
        if trial.held is not None and not trial.uncounted:
            begin, end = trial.held
            held |= (spikes >= begin + FOLLOWED) & (spikes <= end)
    freedom = int(np.count_nonzero(np.diff(spikes[held]) <= LONGEST)) - 1
    if circuit is None or circuit.saturation or freedom < 1:
        return None
    try:
        found = identify(
            circuit, ("V_GS",), run.force, run.duration, spike_times=spikes[held]
        )
    except NotIdentifiableError:
        return None
    return student_95(freedom) * (found.scatter_V_fire or 0.0)


def _fires_later(circuit: Circuit, noise: float) -> Circuit:
    return replace(circuit, V_fire=circuit.fire_voltage + noise)


def _is_told(run: Measurement, noise: float) -> bool:
    return run.circuit is not None and noise > TOLD * run.circuit.fire_voltage


def _moved_by(run: Measurement, noise: float) -> float:
    """How far the critical force lies off, N, where V_fire does by `noise` V."""
    from tactile_lab.model.equations import critical_force as held

    if run.circuit is None or not noise:
        return 0.0
    moved = held(_fires_later(run.circuit, noise)) - held(run.circuit)
    return abs(moved) if math.isfinite(moved) else 0.0


def _applied(run: Measurement, trial: MeasuredTrial) -> Waveform:
    """The force of one trial as it was applied, N against s from its start."""
    start, end = trial.start, trial.start + trial.duration
    time, value = run.force.time, run.force.value
    inside = (time > start) & (time < end)
    return Waveform(
        np.concatenate([[0.0], time[inside] - start, [trial.duration]]),
        np.concatenate([[run.force.at(start)], value[inside], [run.force.at(end)]]),
    )
