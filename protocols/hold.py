"""One long constant force: adaptation, if it lasts long enough until silence."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from tactile_lab.quantity import Duration, Force, Pause, show
from tactile_lab.stimulus.force import ForceProtocol
from tactile_lab.trial import Trial, Trials
from tactile_lab.waveform import Waveform


class Hold(ForceProtocol):
    """A force ramped up and held for long (Fig. 4e, 5b, 5c)."""

    name: ClassVar[str] = "hold"
    title: ClassVar[str] = "Hold"

    level: Force = Field(default=0.15, description="Force held")
    ramp: Pause = Field(default=0.25, description="Ramp up and ramp down, each")
    hold: Duration = Field(default=10.0, description="Time at the level")
    before: Pause = Field(default=0.0, description="Time at no force before the ramp")
    rest: Pause = Field(default=2.0, description="Time at no force afterwards")

    def presentations(self) -> Trials:
        """One trial."""
        pulse = Waveform.pulse(
            self.level, ramp=self.ramp, hold=self.hold, rest=self.rest
        )
        begin = self.before + self.ramp
        if self.before > 0:
            quiet = Waveform.through([(0.0, 0.0), (self.before, 0.0)])
            pulse = quiet.then(pulse)
        yield Trial(
            force=pulse,
            label=show(self.level, "N"),
            level=self.level,
            hold=(begin, begin + self.hold),
        )
