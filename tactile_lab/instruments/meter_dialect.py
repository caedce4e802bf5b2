"""How an instrument speaks that reads one quantity: a teslameter, a thermometer."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from tactile_lab.errors import SceneError, choices
from tactile_lab.instruments.line import Line, Lines, takes
from tactile_lab.instruments.serial_dialect import Pattern, SerialDialect
from tactile_lab.quantity import Pause, Unit

MULTIPLIERS = {"": 1.0, "u": 1e-6, "m": 1e-3, "k": 1e3}
"""Meaning of the prefix letters some meters answer separately."""


class MeterDialect(SerialDialect):
    """What the dialect of every such instrument has.

    Attributes:
        report: queries whose answers are kept with the run, by name.
        interval: shortest time between two readings, s.
    """

    report: dict[str, Line] = Field(default={})
    interval: Pause = 0.1


class TeslameterDialect(MeterDialect):
    """How a teslameter speaks.

    Attributes:
        field: query of the field.
        scale: tesla per unit of the answer.
        multiplier: query of a prefix letter (empty, u, m, k) that scales the answer.
        overload: pattern of an answer that says the range is exceeded.
    """

    role: Literal["field meter"]
    field: Line
    scale: float = 1.0
    multiplier: Line | None = None
    overload: Pattern = r"(?i)^\s*O(V)?L"


class ThermometerDialect(MeterDialect):
    """How a thermometer speaks; in its queries `{input}` is where the sensor is.

    Attributes:
        temperature: query of the temperature.
        zero: what an answer of 0 means, K: 273.15 K where it answers in °C.
        inputs: names of its inputs; the first unless a bench file says another.
        status: query of whether the last reading is one; None where nobody can ask.
        status_ok: pattern of its answer if it is.
    """

    role: Literal["thermometer"]
    report: dict[str, Annotated[Line, takes("input")]] = Field(default={})
    temperature: Annotated[Line, takes("input")]
    zero: Annotated[float, Unit("K", least=0.0)] = 0.0
    inputs: Lines = ("",)
    status: Annotated[Line, takes("input")] | None = None
    status_ok: Pattern = r"^\+?0+$"

    def try_templates(self, where: str) -> None:
        """Refuse inputs that cannot be told apart.

        Raises:
            SceneError: the question is the same for all.
        """
        if len(self.inputs) > 1 and "{input}" not in self.temperature:
            raise SceneError(
                f'Dialect {where}: temperature = "{self.temperature}" would read the '
                f"same of {len(self.inputs)} inputs. Write {{input}} where its name "
                "belongs."
            )

    def at(self, name: str | None) -> ThermometerDialect:
        """The row with its queries for the input `name`; its first where None is given.

        Raises:
            SceneError: the model has no such input.
        """
        chosen = self.inputs[0] if name is None else name
        if chosen not in self.inputs:
            raise SceneError(
                f'[thermometer] input = "{chosen}": {self.title} has none of that '
                f"name; {choices(chosen, self.inputs)}"
            )
        lines = {key: one.format(input=chosen) for key, one in self.report.items()}
        return self.model_copy(
            update={
                "temperature": self.temperature.format(input=chosen),
                "status": self.status and self.status.format(input=chosen),
                "report": lines,
                "inputs": (chosen,),
            }
        )
