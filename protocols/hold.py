"""One long constant force: adaptation, if it lasts long enough until silence."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from pydantic import Field

from tactile_lab.analysis.adrian import ADRIAN, MARK
from tactile_lab.analysis.spike_train import within
from tactile_lab.conclusion import NOT_SEARCHED, Conclusion
from tactile_lab.measurement import Measurement
from tactile_lab.plot import Panel, Plot, Series
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

    def conclude(self, run: Measurement) -> Conclusion:
        """The time constant of the falling rate."""
        if not run.searched:
            return Conclusion(missing=(NOT_SEARCHED,))
        held = [t for t in run.results if t.hold is not None]
        fit = next((t.adaptation for t in held if t.adaptation is not None), None)
        if fit is None:
            why = held[0].why_not if held else "no hold was completed"
            return Conclusion(
                (), {"time_constant_s": None}, (f"No time constant: {why}.",)
            )
        tau = fit.time_constant
        said = f"The rate falls with a time constant of {tau.text('s')}."
        return Conclusion((said,), {"time_constant_s": tau})

    def plots(self, run: Measurement) -> Iterator[Plot]:
        """The decay with its fit (Fig. 5c), beside Adrian's curves (Fig. 5d left)."""
        trial = next((t for t in run.results if t.adaptation is not None), None)
        if trial is None or trial.adaptation is None:
            return
        fit = trial.adaptation
        start, end = fit.hold
        held = within(trial.spike_times, fit.hold)
        time, later = np.linspace(start, end, 300), np.linspace(0, 8, 200)
        values = (
            ("α", fit.alpha, "Hz"),
            ("β", fit.beta, "1/s"),
            ("γ", fit.gamma, "Hz"),
        )
        fitted = [f"{name} = {value.text(unit)}" for name, value, unit in values]
        colours = zip(ADRIAN, ("V_C1", "V_C2"), strict=True)
        yield Plot(
            name="summary",
            title="adaptation",
            caption="Left: instantaneous rate during the hold and the fit α exp(βt) + "
            "γ, as in Fig. 5c. Right: Adrian and Zotterman's adaptation drawn from the "
            "coefficients the paper prints (Fig. 5d, left); these curves are not data.",
            x_label="Time",
            x_unit="s",
            beside=True,
            panels=(
                Panel(
                    label="Rate",
                    unit="Hz",
                    series=(
                        Series(x=held[1:] - start, y=1 / np.diff(held), mark="dots"),
                        Series(
                            x=time - start, y=fit.rate(time), mark="dashed",
                            colour="ink",
                        ),
                    ),
                    limits=(0, None),
                    text="\n".join(fitted),
                ),
                Panel(
                    label="Rate",
                    unit="Hz",
                    series=tuple(
                        Series(
                            x=later, y=curve.rate(later), mark="dashed", colour=colour,
                            name=curve.stimulus,
                        )
                        for curve, colour in colours
                    ),
                    limits=(0, None),
                    text=f"Adrian and Zotterman 1926:\n{MARK}",
                ),
            ),
        )  # fmt: skip
