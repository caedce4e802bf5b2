"""What all protocols that push the sensor offer: a clean magnet, F(0), a steady rest.

A subclass writes `presentations`; what comes before and after is said here once.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from tactile_lab.conclusion import Conclusion
from tactile_lab.quantity import Unit, show
from tactile_lab.stimulus.demagnetise import demagnetising
from tactile_lab.trial import Outcome, Protocol, Trial, Trials
from tactile_lab.waveform import Waveform

if TYPE_CHECKING:
    from tactile_lab.measurement import Measurement

Steps = Generator[Trial, Outcome, None]
PushCurrent = Annotated[float, Unit("A", above=0.0)]
SmallVoltage = Annotated[float, Unit("V", above=0.0)]

FORGET = 5.0
"""Pause after demagnetising, s: the alternation itself leaves almost no V_P."""
READING = 1.0
"""Time at 0 A in which the field is read, s."""
AT_ZERO_BEFORE, AT_ZERO_AFTER = "F(0) before", "F(0) after"
"""Labels of the trials in which the field at 0 A is read."""


class ForceProtocol(Protocol):
    """A protocol that pushes the sensor with the electromagnet."""

    demagnetise: bool = Field(
        default=False, description="Demagnetise the core first (decaying alternation)"
    )
    demagnetise_from: PushCurrent = Field(
        default=1.0, description="First amplitude of that alternation"
    )
    force_at_zero: bool = Field(
        default=False,
        description="Read the field at 0 A before and after: the force F(0) it makes",
    )
    drift_limit: SmallVoltage = Field(
        default=0.1,
        description="Drift of the rest V_C1 since the first trial that ends the run",
    )

    def wishes(self) -> tuple[str, ...]:
        """The field, where F(0) is asked for."""
        return ("field",) if self.force_at_zero else ()

    def presentations(self) -> Trials:
        """Yield the trials that push; each ``yield`` returns that trial's outcome."""
        raise NotImplementedError

    def trials(self) -> Trials:
        """Preparation, the presentations, and F(0) once more."""
        if self.demagnetise:
            yield demagnetising(self.demagnetise_from)
            yield pause(FORGET)
        if self.force_at_zero:
            yield _at_zero(AT_ZERO_BEFORE)
        yield from self.presentations()
        if self.force_at_zero:
            yield _at_zero(AT_ZERO_AFTER)


def step(
    level: float, *, ramp: float, hold: float, rest: float = 0.0, label: str = ""
) -> Trial:
    """A push to `level` N and back, s: ramp, hold, ramp, rest.

    Args:
        level: N, either sign.
        ramp: up and down, each, s.
        hold: s.
        rest: at no force afterwards, s.
        label: for people; the level unless given.
    """
    return Trial(
        force=Waveform.pulse(level, ramp=ramp, hold=hold, rest=rest),
        label=label or show(level, "N"),
        level=level,
        hold=(ramp, ramp + hold),
    )


def pause(seconds: float) -> Trial:
    """A planned pause without force, neither streamed nor stored."""
    return Trial(
        force=Waveform.constant(0.0), duration=seconds, label="recovery", pause=True
    )


def _at_zero(label: str) -> Trial:
    return Trial(force=Waveform.constant(0.0), duration=READING, label=label)


def force_at_zero(run: Measurement) -> Conclusion:
    """F(0), the force the core's remanence makes at 0 A, where a run asked for it.

    The drive force is F(I) - F(0); what changes between before and after is an error
    of every force of the run.
    """
    when = {AT_ZERO_BEFORE: "before", AT_ZERO_AFTER: "after"}
    trials = [t for t in run.trials if t.label in when]
    if not trials:
        return Conclusion()
    per_tesla, known = run.newtons_per_tesla, {}
    values: dict[str, float | None] = {}
    for trial in trials:
        name = when[trial.label]
        readings = run.field_between(trial.start, trial.start + trial.duration)
        field = known[name] = float(readings.mean()) if readings.size else None
        values[f"{name}_T"] = field
        if per_tesla is not None:
            values[f"{name}_N"] = None if field is None else field * per_tesla
    fields = {name: field for name, field in known.items() if field is not None}
    if not fields or per_tesla is None:
        said = "F(0), the force at 0 A, is unknown: the bench reads no field."
        return Conclusion((said,), {"force_at_zero": values})
    told = " and ".join(
        f"{show(field, 'T', 3)} or {show(field * per_tesla, 'N', 3)} {name}"
        for name, field in fields.items()
    )
    said = f"F(0), the force at 0 A, by Eq. (2) from the field read: {told}."
    if len(fields) == 2:
        change = (fields["after"] - fields["before"]) * per_tesla
        said += f" It changed by {show(change, 'N', 2)}."
    return Conclusion((said,), {"force_at_zero": values})
