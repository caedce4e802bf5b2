"""``[sensor]``: the circuit, the preset under it, and how it starts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Tag

from tactile_lab.errors import ParameterError
from tactile_lab.model.circuit import LARGEST_VOLTAGE, Circuit
from tactile_lab.model.state import Start
from tactile_lab.model.temperature import at_temperature
from tactile_lab.quantity import Unit
from tactile_lab.scene.tables import Temperature

PRESETS: Mapping[str, Mapping[str, str]] = {
    "table1": {},
    "fig5b": {"V_GS": "1.54141 V"},
}
"""What each preset changes of Table 1; fig5b sits close enough to threshold to fire
at 50 mN for 50 s, as the paper's bench must have done."""


def _form(value: Any) -> str:
    return "table" if isinstance(value, dict | Start) else "word"


def _start(value: Any) -> Any:
    if value != "equilibrium" and not isinstance(value, dict | Start):
        raise ValueError(
            '"equilibrium" or a table { V_P = "0 V", V_C1 = "0 V", V_C2 = "0 V" } is '
            "needed"
        )
    return value


@dataclass(frozen=True, kw_only=True)
class Sensor(Circuit):
    """A circuit as a scene writes it.

    Args:
        preset: what stood in place of the defaults of `Circuit`, see `PRESETS`.
        start: voltages at time 0, or "equilibrium".
        temperature: of the sensor, K: V_T, I_S and I_T1s follow from it; None: they
            are as given.
        temperature_uncertainty: half of the 95 % band of the temperature, K; None:
            not stated.
        sourced: of V_GS, V_S and V_th, those that a source meter of the bench sets
            and holds during a run; the others are set by hand.

    Raises:
        ParameterError: as `Circuit`, or a voltage at which it cannot start.
    """

    preset: Literal["table1", "fig5b"] = "table1"
    start: Annotated[
        Annotated[Start, Tag("table")] | Annotated[Literal["equilibrium"], Tag("word")],
        Discriminator(_form),
        BeforeValidator(_start),
    ] = "equilibrium"
    temperature: Temperature | None = None
    temperature_uncertainty: Annotated[float, Unit("K", least=0.0)] | None = None
    sourced: tuple[Literal["V_GS", "V_S", "V_th"], ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.start, Start):
            self._check_start(self.start)

    @cached_property
    def circuit(self) -> Circuit:
        """The circuit alone, at its temperature."""
        made = Circuit(**{f.name: getattr(self, f.name) for f in fields(Circuit)})
        if self.temperature is None:
            return made
        return at_temperature(made, self.temperature)

    def _check_start(self, start: Start) -> None:
        if start.V_C2 >= self.fire_voltage:
            raise ParameterError(
                f"start V_C2 = {start.V_C2:g} V must be below V_fire = "
                f"{self.fire_voltage:g} V: the circuit would fire at time 0."
            )
        if not 0 <= start.V_C1 <= self.V_S:
            raise ParameterError(
                f"start V_C1 = {start.V_C1:g} V must lie between 0 V and V_S = "
                f"{self.V_S:g} V."
            )
        if max(abs(start.V_P), abs(start.V_C2)) > LARGEST_VOLTAGE:
            raise ParameterError(
                "start V_P and V_C2 must not exceed 10 kV in magnitude; give volts."
            )


def with_preset(
    table: Mapping[str, Any], hand_set: Mapping[str, Any]
) -> dict[str, Any]:
    """The table over the bench's hand-set voltages over its preset."""
    preset = table.get("preset")
    under = PRESETS.get(preset, {}) if isinstance(preset, str) else {}
    return {**under, **hand_set, **table}
