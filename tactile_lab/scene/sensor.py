"""``[sensor]``: the circuit's parameters, a preset under them, and how it starts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Tag

from tactile_lab.model.circuit import Circuit
from tactile_lab.quantity import Unit
from tactile_lab.scene.tables import Table

PRESETS: dict[str, dict[str, float]] = {"table1": {}, "fig5b": {"V_GS": 1.54141}}
"""What each preset changes of Table 1; fig5b sits close enough to threshold to fire
at 50 mN for 50 s, as the paper's bench must have done."""

Ampere = Annotated[float, Unit("A")]
Volt = Annotated[float, Unit("V")]
Metre = Annotated[float, Unit("m")]
Second = Annotated[float, Unit("s")]
Ohm = Annotated[float, Unit("Ohm")]
Farad = Annotated[float, Unit("F")]
Coefficient = Annotated[float, Unit("V m/N")]


class StartTable(Table):
    """Voltages at time 0, all three."""

    V_P: Volt
    V_C1: Volt
    V_C2: Volt


@dataclass(frozen=True, kw_only=True)
class StartVoltages:
    """Voltages at time 0 instead of the equilibrium, V."""

    V_P: float
    V_C1: float
    V_C2: float


def _form(value: Any) -> str:
    return "table" if isinstance(value, dict | StartTable) else "word"


def _start(value: Any) -> Any:
    if value != "equilibrium" and not isinstance(value, dict | StartTable):
        raise ValueError(
            '"equilibrium" or a table { V_P = "0 V", V_C1 = "0 V", V_C2 = "0 V" } is '
            "needed"
        )
    return value


class SensorTable(Table):
    """Keys of ``[sensor]``; None is what the preset says (see `Circuit`)."""

    preset: Literal["table1", "fig5b"] = "table1"
    I_S: Ampere | None = None
    V_GS: Volt | None = None
    m: float | None = None
    V_T: Volt | None = None
    g31: Coefficient | None = None
    h: Metre | None = None
    L: Metre | None = None
    d: Metre | None = None
    a: Metre | None = None
    b: Metre | None = None
    tau: Second | None = None
    R1: Ohm | None = None
    R2: Ohm | None = None
    R3: Ohm | None = None
    R_L: Ohm | None = None
    R_k: Ohm | None = None
    C1: Farad | None = None
    C2: Farad | None = None
    V_S: Volt | None = None
    V_th: Volt | None = None
    I_T1s: Ampere | None = None
    beta_F: float | None = None
    beta_R: float | None = None
    V_fire: Volt | None = None
    V_reset: Volt | None = None
    t_eps: Second | None = None
    t1: Literal["emitter_resistor", "direct"] | None = None
    firing: Literal["lif", "put"] | None = None
    saturation: bool | None = None
    start: Annotated[
        Annotated[StartTable, Tag("table")]
        | Annotated[Literal["equilibrium"], Tag("word")],
        Discriminator(_form),
        BeforeValidator(_start),
    ] = "equilibrium"

    def circuit(self, hand_set: dict[str, float]) -> Circuit:
        """The circuit: preset, then the bench's hand-set voltages, then these keys.

        Raises:
            ParameterError: a value is impossible or contradicts another.
        """
        own = self.model_dump(exclude={"preset", "start"}, exclude_none=True)
        own = {name: getattr(self, name) for name in own}
        return Circuit(**{**PRESETS[self.preset], **hand_set, **own})

    def start_voltages(self, circuit: Circuit) -> StartVoltages | None:
        """Voltages at time 0, None for the equilibrium.

        Raises:
            ValueError: a voltage at which the circuit cannot start.
        """
        if not isinstance(self.start, StartTable):
            return None
        start = self.start
        if start.V_C2 >= circuit.fire_voltage:
            raise ValueError(
                f"start V_C2 = {start.V_C2:g} V must be below V_fire = "
                f"{circuit.fire_voltage:g} V: the circuit would fire at time 0."
            )
        if not 0 <= start.V_C1 <= circuit.V_S:
            raise ValueError(
                f"start V_C1 = {start.V_C1:g} V must lie between 0 V and V_S = "
                f"{circuit.V_S:g} V."
            )
        if max(abs(start.V_P), abs(start.V_C2)) > 1e4:
            raise ValueError(
                "start V_P and V_C2 must not exceed 10 kV in magnitude; give volts."
            )
        return StartVoltages(V_P=start.V_P, V_C1=start.V_C1, V_C2=start.V_C2)
