"""How the simulated world differs from what bench file and sensor say of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

from tactile_lab.model.circuit import Circuit
from tactile_lab.model.temperature import at_temperature, temperature
from tactile_lab.quantity import Current, Unit, Voltage
from tactile_lab.table import SceneTable

Part = Annotated[float, Unit("", above=-1.0)]
Later = Annotated[float, Unit("s")]
Warmer = Annotated[float, Unit("K")]


@dataclass(frozen=True, kw_only=True)
class Deviation(SceneTable):
    """``[simulated.deviation]``: what is true less what is believed; 0: no surprise.

    Attributes:
        input_bias: of the follower at V_C2, A.
        offset: of the followers' outputs, V.
        V_GS: gate-source bias, V.
        R1: resistor at node A, a part of itself.
        temperature: of the sensor, K: V_T, I_S and I_T1s change with it.
        force: force per field, a part of itself.
        lag: of the field behind the current, s.
    """

    input_bias: Current = 0.0
    offset: Voltage = 0.0
    V_GS: Voltage = 0.0
    R1: Part = 0.0
    temperature: Warmer = 0.0
    force: Part = 0.0
    lag: Later = 0.0

    def circuit(self, believed: Circuit) -> Circuit:
        """The circuit as it really is."""
        true = replace(
            believed,
            V_GS=believed.V_GS + self.V_GS,
            R1=believed.R1 * (1 + self.R1),
            I_bias=believed.I_bias + self.input_bias,
        )
        if self.temperature == 0:
            return true
        return at_temperature(true, temperature(true) + self.temperature)
