"""The critical force, by bisection: each trial decides the next one."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field, model_validator

from tactile_lab.errors import LimitError
from tactile_lab.quantity import Duration, Pause, Unit, show
from tactile_lab.stimulus.force import step
from tactile_lab.stimulus.recovery import Recovering, first_rest
from tactile_lab.trial import Outcome, Trial, Trials

PushForce = Annotated[float, Unit("N", least=0.0)]
Resolution = Annotated[float, Unit("N", above=0.0)]


class ThresholdSearch(Recovering):
    """Bisect for the smallest force that makes the sensor fire.

    The critical force belongs to its ramp and hold: the slower the ramp, the more the
    film adapts meanwhile. Both are stated with the result.
    """

    name: ClassVar[str] = "threshold_search"
    title: ClassVar[str] = "Critical force"

    low: PushForce = Field(default=0.06, description="Force expected to stay silent")
    high: PushForce = Field(default=0.14, description="Force expected to fire")
    resolution: Resolution = Field(default=1e-3, description="Width to end with")
    ramp: Pause = Field(default=0.25, description="Ramp up and ramp down, each")
    hold: Duration = Field(default=1.0, description="Time at each level")

    @model_validator(mode="after")
    def _ordered(self) -> ThresholdSearch:
        if self.low >= self.high:
            raise ValueError(
                f"low {show(self.low, 'N')} must be below high {show(self.high, 'N')}"
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
                f"{show(self.high, 'N')} does not make the sensor fire; raise "
                "protocol.high, or trim V_GS so that it sits nearer to its threshold."
            )
        yield from self.recover(self.high, first)
        outcome = yield self._step(self.low)
        if fired(outcome):
            raise LimitError(
                f"{show(self.low, 'N')} already makes the sensor fire; lower "
                "protocol.low. If it fires at rest, lower V_GS."
            )
        low, high, last = self.low, self.high, self.low
        while high - low > self.resolution * (1 + 1e-9):
            yield from self.recover(last, first)
            last = (low + high) / 2
            outcome = yield self._step(last)
            low, high = (low, last) if fired(outcome) else (last, high)

    def _step(self, level: float) -> Trial:
        return step(level, ramp=self.ramp, hold=self.hold)


def fired(outcome: Outcome) -> bool:
    """Whether the trial gave a spike."""
    return outcome.spike_times.size > 0
