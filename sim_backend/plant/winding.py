"""Heat in the coil: copper on a steel core in a room, and the copper's resistance."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tactile_lab.errors import ParameterError


@dataclass(frozen=True, kw_only=True)
class Winding:
    """The winding's resistance and where its heat goes.

    Attributes:
        resistance: at the room's temperature, 20 C, Ohm.
        coefficient: relative rise of the resistance, per K.
        copper: heat capacity of the winding, J/K.
        core: heat capacity of the core, J/K.
        contact: heat flow from winding to core, W/K.
        loss: heat flow from core to room, W/K.

    Raises:
        ParameterError: a value is not finite or not above 0.
    """

    resistance: float = 4.9
    coefficient: float = 3.93e-3
    copper: float = 3.8
    core: float = 81.0
    contact: float = 0.4
    loss: float = 0.07

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (math.isfinite(value) and value > 0):
                raise ParameterError(f"{name} = {value} must be finite and above 0.")

    def after(
        self, rise: tuple[float, float], current: float, duration: float
    ) -> tuple[float, float]:
        """Winding and core above the room, K, after `current` A for `duration` s.

        The power rises with the temperature, so the system stays linear and this is
        exact.

        Args:
            rise: winding and core above the room at the begin, K.
            current: A.
            duration: s.
        """
        power = self.resistance * current**2
        flows = np.array(
            [
                [power * self.coefficient - self.contact, self.contact],
                [self.contact, -self.contact - self.loss],
            ]
        )
        capacity = np.array([self.copper, self.core])
        system = flows / capacity[:, None]
        steady = np.linalg.solve(system, [-power / self.copper, 0.0])
        rates, modes = np.linalg.eig(system)
        away = np.linalg.solve(modes, np.array(rise) - steady)
        winding, core = steady + modes @ (away * np.exp(rates * duration))
        return float(winding), float(core)

    def resistance_at(self, rise: float) -> float:
        """Resistance when the winding is `rise` K above the room, Ohm."""
        return self.resistance * (1 + self.coefficient * rise)
