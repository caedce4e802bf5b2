"""How one model of USBTMC oscilloscope speaks, as a row of data (TOML)."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from tactile_lab.instruments.line import Line, Lines, frozen, takes
from tactile_lab.instruments.serial_dialect import Dialect, DialectTable
from tactile_lab.scope import ScopeCapability

Numbers = Annotated[tuple[float, ...], BeforeValidator(frozen)]


def _numbered(table: Any) -> Any:
    """TOML's keys are texts; these are numbers of inputs."""
    if not isinstance(table, dict):
        return table
    return {int(k) if str(k).isdecimal() else k: v for k, v in table.items()}


Plain = Annotated[Line, takes()]
Input = Annotated[Line, takes("input")]
Wiring = Annotated[Line, takes("input", "coupling", "scale", "offset")]
Timing = Annotated[Line, takes("depth", "timebase")]
Bound = Annotated[Line, takes("first", "last")]


class Timebases(DialectTable):
    """Horizontal scales, s a division, in steps of 1, 2, 5."""

    shortest: float = Field(gt=0)
    longest: float = Field(gt=0)


class Commands(DialectTable):
    """Lines and questions; names in braces are filled in.

    `{input}` is an input's name, `{scale}` V a division, `{offset}` V, `{coupling}` DC
    or AC, `{depth}` samples, `{timebase}` s a division, `{first}` and `{last}` sample
    numbers from 1. `rate` answers S/s, `status` a word of which `waiting` and `done`
    matter, `preamble` the ten numbers of a Rigol, `data` a block of bytes.
    """

    identify: Line
    error: Line
    input_off: Annotated[tuple[Input, ...], BeforeValidator(frozen)]
    input_on: Annotated[tuple[Wiring, ...], BeforeValidator(frozen)]
    acquire: Annotated[tuple[Timing, ...], BeforeValidator(frozen)]
    rate: Line
    arm: Annotated[tuple[Plain, ...], BeforeValidator(frozen)]
    status: Line
    waiting: Line
    done: Line
    force: Line
    stop: Annotated[tuple[Plain, ...], BeforeValidator(frozen)]
    select: Annotated[tuple[Input, ...], BeforeValidator(frozen)]
    preamble: Line
    bounds: Annotated[tuple[Bound, ...], BeforeValidator(frozen)]
    data: Line


class ScopeDialect(Dialect):
    """One model.

    Attributes:
        vendor, product: USB ids.
        header_once: see `UsbtmcLink`.
        inputs: names of its inputs.
        fastest: highest rate for 1, 2, ... enabled inputs, S/s.
        bits: of its converter.
        divisions_wide: of the screen.
        divisions_high: from the middle of the screen to its edge: the full scale.
        codes_per_division: steps of the converter.
        scales: V a division.
        offsets: largest offset at each of them, V, either sign; empty: not known.
        timebases: s a division.
        depth: samples of a record for 1, 2, ... enabled inputs.
        read_at_once: most samples of one answer.
        commands: what to say.
    """

    role: Literal["scope"]
    vendor: int = Field(ge=0, le=0xFFFF)
    product: int = Field(ge=0, le=0xFFFF)
    header_once: bool = False
    inputs: Lines
    fastest: Numbers
    bits: int = Field(ge=1, le=8)
    divisions_wide: int = Field(ge=1)
    divisions_high: int = Field(ge=1)
    codes_per_division: int = Field(ge=1)
    scales: Numbers
    offsets: Numbers = ()
    timebases: Timebases
    depth: Annotated[dict[int, int], BeforeValidator(_numbered)]
    read_at_once: int = Field(ge=1)
    commands: Commands

    @property
    def ranges(self) -> tuple[float, ...]:
        """Full scale of each vertical scale, V."""
        return tuple(float(f"{s * self.divisions_high:.6g}") for s in self.scales)

    @property
    def capability(self) -> ScopeCapability:
        """What the model can do; between two records it is blind."""
        return ScopeCapability(
            gapless=False,
            inputs=self.inputs,
            ranges=self.ranges,
            bits=self.bits,
            fastest=self.fastest,
            offsets=self.offsets,
            steps=self.divisions_high * self.codes_per_division,
            record=self.record,
        )

    def record(self, interval: float, inputs: int) -> tuple[float, int]:
        """How long a record lasts, s, and its samples of a channel; as `timebase`."""
        screen = self.timebase(interval, inputs) * self.divisions_wide
        return screen, self.depth[inputs]

    def timebase(self, interval: float, inputs: int) -> float:
        """The longest s a division that samples at least as often as wanted.

        Args:
            interval: wanted time between samples, s.
            inputs: how many are enabled.
        """
        wanted = self.depth[inputs] * interval / self.divisions_wide
        step = self.timebases.shortest
        for exponent in range(-12, 4):
            for mantissa in (1, 2, 5):
                candidate = float(f"{mantissa}e{exponent}")
                if step <= candidate <= wanted * (1 + 1e-9):
                    step = candidate
        return min(step, self.timebases.longest)
