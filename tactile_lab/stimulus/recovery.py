"""Recovery between trials: V_P is a high-pass of force and must die away first."""

from __future__ import annotations

import math
from typing import Annotated, Self

from pydantic import Field

from tactile_lab.quantity import Duration, Unit
from tactile_lab.stimulus.force import ForceProtocol, SmallVoltage, Steps, pause
from tactile_lab.trial import Outcome, Trial
from tactile_lab.waveform import Waveform

PerForce = Annotated[float, Unit("V/N", above=0.0)]

TABLE_1_TAU, TABLE_1_PER_FORCE = 8.69, 1.529750693
"""Of Table 1's sensor, s and V/N: where a protocol is used without a scene."""
MOST_EXTENSIONS = 6
"""After so many extensions V_C1 is taken to have drifted, not to be recovering."""
CODE = 20e-3
"""One code of V_C1 where it is not known, V."""
LOOK = 0.2
"""Time the bench streams to look at V_C1 before it goes on, s."""


class Recovering(ForceProtocol):
    """A protocol whose trials each start from rest.

    After a force F the recovery lasts tau ln(k_F |F| / residual): about 50 s after
    200 mN. It is neither streamed nor stored. Where V_C1 is recorded it is looked at
    afterwards and the recovery extended until V_C1 is back.
    """

    tau: Duration | None = Field(
        default=None, description="Leakage time of the film; the sensor's if empty"
    )
    volts_per_newton: PerForce | None = Field(
        default=None, description="V_P per force, Eqs. (3)-(6); the sensor's if empty"
    )
    residual: SmallVoltage = Field(
        default=1e-3, description="V_P that may be left when the next trial starts"
    )
    settled: SmallVoltage | None = Field(
        default=None,
        description="How near V_C1 must be to its first rest value; one code if empty",
    )

    def recovery_time(self, force: float) -> float:
        """Time until |V_P| is below the residual after a change by `force` N, s."""
        volts = (self.volts_per_newton or TABLE_1_PER_FORCE) * abs(force)
        return self._leak * math.log(max(volts / self.residual, math.e))

    def on_sensor(self, tau: float, volts_per_newton: float) -> Self:
        """With what the scene does not say taken from the sensor."""
        known = {"tau": tau, "volts_per_newton": volts_per_newton}
        left = {name: v for name, v in known.items() if getattr(self, name) is None}
        return self.model_copy(update=left)

    @property
    def _leak(self) -> float:
        return self.tau or TABLE_1_TAU

    def recover(self, force: float, first: float | None) -> Steps:
        """Pauses after `force` N until V_C1 is back at `first` V (None: not looked at).

        A V_C1 that never comes back has drifted; the run judges that before each trial.
        """
        yield pause(self.recovery_time(force))
        if first is None:
            return
        for _ in range(MOST_EXTENSIONS):
            seen = yield Trial(
                force=Waveform.constant(0.0), duration=LOOK, label="look at rest"
            )
            near = self.settled or seen.codes.get("V_C1", CODE)
            if not abs(resting(seen) - first) > near:
                return
            yield pause(self._leak)


def resting(outcome: Outcome) -> float:
    """V_C1 just before the trial, V; not a number where it is not recorded."""
    return outcome.rest.get("V_C1", math.nan)


def first_rest(outcome: Outcome) -> float | None:
    """V_C1 before the first trial, to compare the later ones with, or None."""
    value = resting(outcome)
    return None if math.isnan(value) else value
