"""A small safe step: is each channel what the bench file says it is?"""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from tactile_lab.quantity import Duration, Unit
from tactile_lab.trial import Protocol, Trial, Trials
from tactile_lab.waveform import Waveform

SmallForce = Annotated[float, Unit("N", above=0.0, most=0.1)]


class WiringCheck(Protocol):
    """Rest, a small push, rest: `analysis.wiring` judges each channel.

    The push must lower V_C1 and raise V_C2; the shunt and the teslameter must show the
    current's sign and size.
    """

    name: ClassVar[str] = "wiring_check"
    title: ClassVar[str] = "Wiring check"
    signals: ClassVar[tuple[str, ...]] = (
        "force", "coil_current", "field", "V_C1", "V_C2", "V_K", "spikes",
    )  # fmt: skip

    push: SmallForce = Field(default=0.05, description="Force of the step")
    hold: Duration = Field(default=2.0, description="Time at each part")

    def trials(self) -> Trials:
        """Rest, push, rest."""
        quiet = Waveform.through([(0.0, 0.0), (self.hold, 0.0)])
        yield Trial(force=quiet, label="rest", level=0.0, hold=(0.0, self.hold))
        yield Trial(
            force=Waveform.pulse(self.push, ramp=0.25, hold=self.hold, rest=0.5),
            label="push",
            level=self.push,
            hold=(0.25, 0.25 + self.hold),
        )
        yield Trial(force=quiet, label="rest again", level=0.0, hold=(0.0, self.hold))
