"""How one model of source meter speaks where it holds a voltage."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import BeforeValidator, Field

from tactile_lab.errors import SceneError
from tactile_lab.instruments.line import Line, amount, frozen
from tactile_lab.instruments.serial_dialect import DialectTable, SourceDialect
from tactile_lab.quantity import Current, Voltage, show
from tactile_lab.voltage_source import VoltageLimits, VoltageSourceCapability


class VoltageRange(DialectTable):
    """One range of a source meter.

    Attributes:
        full: largest magnitude it sets, V.
        resolution: smallest step of the set-point, V.
        error, error_part: bound on the error of its reading: a constant part, V, and
            a part of the reading.
    """

    full: Voltage
    resolution: Voltage
    error: Voltage
    error_part: float = Field(default=0.0, ge=0.0)


class VoltageDialect(SourceDialect):
    """How a source meter speaks; `set` and `range` take `{v}`, `limit` `{i}`.

    Attributes:
        current: largest compliance the model takes, A.
        ranges: its ranges, ascending.
        range: line that chooses one by the largest voltage it sets; None: by itself.
        range_query: asks for that voltage, or the range's name in volts; None where
            nobody can.
    """

    role: Literal["voltage source"]
    sets: ClassVar[Literal["i", "v"]] = "v"
    set: Annotated[Line, amount("v")]
    limit: Annotated[Line, amount("i")]
    current: Current
    ranges: Annotated[tuple[VoltageRange, ...], BeforeValidator(frozen)] = Field(
        min_length=1
    )
    range: Annotated[Line, amount("v")] | None = None
    range_query: Line | None = None

    def try_templates(self, where: str) -> None:
        """Fill in every template with extremes.

        Raises:
            SceneError: a line is too long, or set too coarse for its digits.
        """
        most = self.ranges[-1].full
        lines = [self.set_line(-most), self.limit_line(self.current)]
        self._try_lines([*lines, *self.range_lines(most)], where)

    def range_lines(self, volts: float) -> tuple[str, ...]:
        """Lines that choose the range that reaches `volts`, V."""
        return (
            ()
            if self.range is None
            else (self.range.format(v=volts / self.voltage_unit),)
        )

    def range_for(self, limits: VoltageLimits) -> VoltageRange:
        """The finest range that reaches all that `limits` allow.

        Raises:
            SceneError: the model does not reach it, or cannot limit the current so.
        """
        fits = [one for one in self.ranges if one.full >= limits.largest]
        if not fits:
            raise SceneError(
                f"[voltage_source] limits of {limits.span} are beyond the "
                f"{show(self.ranges[-1].full, 'V')} of {self.title}."
            )
        if limits.compliance > self.current:
            raise SceneError(
                f"[voltage_source] compliance = {show(limits.compliance, 'A')} is "
                f"beyond the {show(self.current, 'A')} of {self.title}."
            )
        return fits[0]

    def capability(self, limits: VoltageLimits) -> VoltageSourceCapability:
        """What the model can do within `limits`.

        Raises:
            SceneError: they are beyond the model.
        """
        used = self.range_for(limits)
        return VoltageSourceCapability(
            title=self.title,
            resolution=max(used.resolution, self.grain),
            error=used.error,
            error_part=used.error_part,
        )
