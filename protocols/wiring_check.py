"""A small safe step: is each channel what the bench file says it is?"""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from tactile_lab.quantity import Duration, Unit
from tactile_lab.stimulus.force import step
from tactile_lab.trial import Probes, Protocol, Trial, Trials
from tactile_lab.waveform import Waveform

SmallForce = Annotated[float, Unit("N", above=0.0, most=0.1)]
Mains = Annotated[float, Unit("Hz", above=0.0, most=100.0)]


class WiringCheck(Protocol):
    """Probes on 0 V, on V_S, then rest, a small push, rest: channels are judged.

    The first two give offset and gain of each voltage channel; a person puts the probes
    there. The push must lower V_C1 and raise V_C2; the shunt and the teslameter must
    show the current's sign and size. All voltage channels are set to see 0 V to V_S.
    """

    name: ClassVar[str] = "wiring_check"
    title: ClassVar[str] = "Wiring check"
    signals: ClassVar[tuple[str, ...]] = (
        "force", "coil_current", "field", "V_C1", "V_C2", "V_K",
    )  # fmt: skip
    as_wired: ClassVar[bool] = True
    sees_supply: ClassVar[bool] = True

    calibrate: bool = Field(
        default=True, description="First put the probes on 0 V and on V_S"
    )
    push: SmallForce = Field(default=0.05, description="Force of the step")
    hold: Duration = Field(default=2.0, description="Time at each part")
    mains: Mains = Field(default=50.0, description="Frequency of the hum looked for")

    def trials(self) -> Trials:
        """Calibration of the channels, rest, push, rest."""
        if self.calibrate:
            yield self._quiet("0 V", "ground")
            yield self._quiet("V_S", "supply")
        yield self._quiet("rest")
        yield step(self.push, ramp=0.25, hold=self.hold, rest=0.5, label="push")
        yield self._quiet("rest again")

    def _quiet(self, label: str, probes: Probes = "circuit") -> Trial:
        return Trial(
            force=Waveform.through([(0.0, 0.0), (self.hold, 0.0)]),
            label=label,
            hold=(0.0, self.hold),
            probes=probes,
        )
