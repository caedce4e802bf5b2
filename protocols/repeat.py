"""The same force again and again: how the response falls from one to the next."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from pydantic import Field

from tactile_lab.conclusion import NOT_SEARCHED, Conclusion
from tactile_lab.measurement import Measurement
from tactile_lab.plot import Panel, Plot, Series
from tactile_lab.quantity import Duration, Force, Pause
from tactile_lab.stimulus.force import ForceProtocol, step
from tactile_lab.trial import Trials


class Repeat(ForceProtocol):
    """Successive equal presentations (Fig. 1d, 5d right)."""

    name: ClassVar[str] = "repeat"
    title: ClassVar[str] = "Repeated presentations"

    level: Force = Field(default=0.16, description="Force held")
    count: int = Field(
        default=8, ge=2, le=10_000, title="Presentations", description="Presentations"
    )
    ramp: Pause = Field(default=0.25, description="Ramp up and ramp down, each")
    hold: Duration = Field(default=1.0, description="Time at the level")
    gap: Pause = Field(default=1.0, description="Time at no force after each")

    def presentations(self) -> Trials:
        """One trial per presentation."""
        for number in range(self.count):
            yield step(
                self.level,
                ramp=self.ramp,
                hold=self.hold,
                rest=self.gap,
                label=f"no. {number + 1}",
            )

    def conclude(self, run: Measurement) -> Conclusion:
        """The highest rate from one presentation to the next."""
        if not run.searched:
            return Conclusion(missing=(NOT_SEARCHED,))
        rates = [t.response.peak_rate for t in run.results]
        values = {
            "spikes": [t.response.spikes for t in run.results],
            "peak_rates_Hz": rates,
        }
        if len(rates) < 2 or rates[0] is None:
            why = "No decrement: the first presentation gave no rate."
            return Conclusion((), values, (why,))
        rated = [r for r in rates if r is not None]
        said = (
            "Highest rate in the hold, from one presentation to the next: "
            f"{', '.join(f'{r:.3g}' for r in rated)} Hz"
        )
        if silent := len(rates) - len(rated):
            said += f"; the other {silent} gave fewer than two spikes in it"
        return Conclusion((f"{said}.",), values)

    def plots(self, run: Measurement) -> Iterator[Plot]:
        """Highest rate against presentation."""
        trials = [t for t in run.results if t.level is not None]
        if len(trials) < 2:
            return
        number = np.arange(1, len(trials) + 1)
        # one spike has no rate: it stands hollow at 0
        rate = np.array([t.response.peak_rate for t in trials], dtype=np.float64)
        if np.isnan(rate).all():
            return
        counts = np.array([str(t.response.spikes) for t in trials])
        none = np.isnan(rate)
        hollow = Series(
            x=number[none], y=np.zeros(int(none.sum())), mark="open",
            name="fewer than two spikes in the hold", texts=tuple(counts[none]),
        )  # fmt: skip
        joined = Series(
            x=number[~none], y=rate[~none], mark="joined", texts=tuple(counts[~none])
        )
        yield Plot(
            name="summary",
            title="decrement",
            caption="Highest rate in the hold from one presentation of the same force "
            "to the next, as in Fig. 5d (right).",
            x_label="Presentation (numbers: spikes)",
            whole=True,
            panels=(
                Panel(
                    label="Highest rate",
                    unit="Hz",
                    prefix="",
                    series=(joined, hollow) if none.any() else (joined,),
                    limits=(0, float(np.nanmax(rate)) * 1.15),
                ),
            ),
        )
