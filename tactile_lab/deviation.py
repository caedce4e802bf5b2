"""What is true of a bench and its sensor less what is believed of them.

The simulated world takes one as its truth, the tolerance of the model beside a run as
what the bench leaves open, and the search for what explains a misfit as its suspects.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Annotated, NamedTuple

from tactile_lab.long_waveform import AnyWaveform
from tactile_lab.magnetics import Magnet
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.temperature import at_temperature, temperature
from tactile_lab.quantity import Current, Unit, Voltage
from tactile_lab.table import SceneTable
from tactile_lab.waveform import Waveform

Part = Annotated[float, Unit("", above=-1.0)]
Later = Annotated[float, Unit("s")]
Warmer = Annotated[float, Unit("K")]

KEPT = 4000
"""Points of a set-point up to which the force is held whole, and kept: behind its lags
each takes 1 kB."""


class DrivenCircuit(NamedTuple):
    """A circuit, and the force on it, N."""

    circuit: Circuit
    force: AnyWaveform


@dataclass(frozen=True, kw_only=True)
class Deviation(SceneTable):
    """True less believed, the table ``[simulated.deviation]``; 0: no surprise.

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

    def __add__(self, other: Deviation) -> Deviation:
        """Both at once; parts of themselves simply add."""
        return Deviation(
            **{
                f.name: getattr(self, f.name) + getattr(other, f.name)
                for f in fields(self)
            }
        )

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

    def driven(
        self, circuit: Circuit, magnet: Magnet, setpoint: Waveform
    ) -> DrivenCircuit:
        """The circuit as it really is, and the force really on it.

        Args:
            circuit: as it is believed to be.
            magnet: likewise; a deviation takes at most all of its lag away.
            setpoint: what the source gave, A.
        """
        if self.lag:
            eddy = max(magnet.eddy_lag + self.lag, 0.0)
            magnet = replace(magnet, eddy_lag=eddy)
        brief = setpoint.time.size <= KEPT
        force = (_force if brief else Magnet.long_force)(magnet, setpoint)
        return DrivenCircuit(
            self.circuit(circuit), force.scaled(1 + self.force) if self.force else force
        )


@lru_cache(maxsize=8)
def _force(magnet: Magnet, setpoint: Waveform) -> Waveform:
    """The force, N: most of what is tried of a sensor leaves it as it was."""
    return magnet.lagged_force(setpoint)[0]
