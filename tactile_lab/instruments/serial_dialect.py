"""Dialects: how one model of serial instrument speaks, as a row of data.

A dialect is everything the generic serial drivers know of a model; `dialects` reads
it from a TOML file.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Annotated, ClassVar, Literal, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

from tactile_lab.bench import CoilLimits
from tactile_lab.current_list import ListCapability
from tactile_lab.errors import SceneError
from tactile_lab.instruments.line import (
    Characters,
    Line,
    Lines,
    amount,
    decimals,
    frozen,
    needs,
)
from tactile_lab.quantity import Current, Duration, Pause, Unit, Voltage, show

MARGIN = 1.5
"""Factor by which the promised update interval exceeds the typical one."""


def _pattern(text: str) -> str:
    try:
        re.compile(text)
    except re.error as reason:
        raise ValueError(f"{text!r} is not a regular expression: {reason}") from reason
    return text


def _with_group(text: str) -> str:
    if re.compile(_pattern(text)).groups < 1:
        raise ValueError("it picks nothing out; put the number's part into (...)")
    return text


def _wanted(value: object) -> object:
    """A pattern, or the numbers of which one is wanted."""
    if isinstance(value, str):
        return _pattern(value)
    numbers = value if isinstance(value, list | tuple) else [value]
    if not numbers or any(type(one) not in (int, float) for one in numbers):
        raise ValueError("a pattern is needed, a number, or an array of numbers")
    return tuple(map(float, numbers))


Pattern = Annotated[str, AfterValidator(_pattern)]

Wanted = Annotated[str | tuple[float, ...], BeforeValidator(_wanted)]
"""What an answer must be: a pattern it matches, or one of some numbers."""

Picking = Annotated[str, AfterValidator(_with_group)]
"""A pattern whose group 1 is what is wanted of an answer."""

Timeout = Annotated[float, Unit("s", above=0.0, most=0.8)]
"""The guard kills a program that is silent for 1 s: no answer is waited for so long."""

Gap = Annotated[float, Unit("s", least=0.0, most=0.5)]
"""For the same reason."""


class DialectTable(BaseModel):
    """A table of a dialect: frozen, unknown keys refused."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, defer_build=True
    )


class SerialSettings(DialectTable):
    """Serial settings and framing of a model.

    Attributes:
        baud: symbols a second.
        xonxoff, rtscts, dsrdtr: flow control.
        dtr: level of DTR when opened; None leaves it to the system.
        send_end, reply_end: line terminators.
        min_gap: rest between the last character of a line or an answer and the first
            of the next line, s.
        latency: time the instrument takes to act on a line, s; typical, for plans.
        timeout: longest wait for an answer, s.
        max_line: longest line in characters, terminator included.
        echo: the instrument repeats each line before it answers.
        strip: control characters to drop from answers.
        preamble: characters sent before the first line of a (re)synchronisation.
    """

    baud: int = Field(default=9600, ge=50)
    bytesize: Literal[7, 8] = 8
    parity: Literal["N", "E", "O"] = "N"
    stopbits: Literal[1, 2] = 1
    xonxoff: bool = False
    rtscts: bool = False
    dsrdtr: bool = False
    dtr: bool | None = None
    send_end: Characters = "\n"
    reply_end: Characters = "\n"
    min_gap: Gap = 0.0
    latency: Pause = 0.010
    timeout: Timeout = 0.2
    max_line: int = Field(default=127, ge=16)
    echo: bool = False
    strip: Characters = ""
    preamble: Characters = ""

    def at(self, baud: int | None) -> SerialSettings:
        """The same at another rate; as they are where None is given."""
        return self if baud is None else self.model_copy(update={"baud": baud})

    @property
    def character_time(self) -> float:
        """Time one character takes on the wire, s."""
        bits = 1 + self.bytesize + (self.parity != "N") + self.stopbits
        return bits / self.baud


class ListMode(DialectTable):
    """Lines with which a model plays a list of currents by its own clock.

    Attributes:
        clear, start, stop: lines.
        points: template, `{values}` A comma-separated; what is sent again is appended.
        dwells: the same for the dwells, s: one for each point, or one for all.
        count: template, `{n}` repetitions; never sent with 0, which means for ever.
        points_query, dwells_query: how many of them the memory holds; None where
            nobody can ask.
        max_points, points_per_line: what the memory and one line hold.
        dwell_digits: decimals of a dwell on the wire.
        shortest, longest: dwell, s.
    """

    clear: Lines = ()
    points: Annotated[Line, needs("values")]
    dwells: Annotated[Line, needs("values")]
    count: Annotated[Line, needs("n")]
    points_query: Line | None = None
    dwells_query: Line | None = None
    start: Lines
    stop: Lines
    max_points: int = Field(ge=2)
    points_per_line: int = Field(ge=1)
    dwell_digits: int = Field(default=5, ge=2, le=8)
    shortest: Duration
    longest: Duration


class AnalogueMode(DialectTable):
    """An input that adds a current to the set-point, in proportion to its voltage.

    Attributes:
        gain: A/V, as the maker says; a bench file may know it better.
        range: largest voltage it takes, V.
        bandwidth: Hz, into a coil; a bench file may know it better.
        on, off: lines that have the source follow it, and no longer.
    """

    gain: Annotated[float, Unit("A/V", above=0.0)]
    range: Annotated[float, Unit("V", above=0.0)]
    bandwidth: Annotated[float, Unit("Hz", above=0.0)]
    on: Lines = ()
    off: Lines = ()


class Dialect(DialectTable):
    """What every dialect has.

    Attributes:
        id: name used in bench files.
        role: what it is for.
        title: for people.
        match: pattern the answer to the query of its name must match.
        unverified: facts that no one has checked on an instrument yet.
    """

    id: str
    role: str
    title: str
    match: Pattern
    unverified: Annotated[tuple[str, ...], BeforeValidator(frozen)] = ()

    def try_templates(self, where: str) -> None:
        """Fill in every template: a mistake must not reach a bench.

        Raises:
            SceneError: one cannot be filled in; `where` names the file.
        """


class SerialDialect(Dialect):
    """What the dialect of every serial instrument has.

    Attributes:
        serial: settings and framing of the wire.
        identify: harmless query of its name.
        init: lines after identification.
        confirm: queries after `init`, and the number that each answer must be, one of
            some, or the pattern it must match: a line may have been lost.
        optional: lines before `init` whose refusal is accepted.
        release: lines before the port is closed.
        error: query of the error queue; None where there is none.
        error_ok: pattern of its answer when there is no error.
        number: pattern whose group 1 is a numeric answer.
        serial_number: what its name must hold besides, where several are alike.
    """

    serial: SerialSettings = SerialSettings()
    identify: Line = "*IDN?"
    optional: Lines = ()
    init: Lines = ()
    confirm: dict[Line, Wanted] = Field(default={})
    release: Lines = ()
    error: Line | None = None
    error_ok: Pattern = r"^[+-]?0\b"
    serial_number: str = ""
    number: Picking = r"^\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*[A-Za-z]*$"

    def verified(self, line: str) -> tuple[str, ...]:
        """`line` with the error query behind it."""
        return (line,) if self.error is None else (line, self.error)

    def of_one(self, *, serial: str | None, timeout: float | None) -> Self:
        """The same for one instrument: its serial number, its link's timeout, s."""
        known: dict[str, object] = {} if serial is None else {"serial_number": serial}
        if timeout is not None:
            known["serial"] = self.serial.model_copy(update={"timeout": timeout})
        return self.model_copy(update=known)


class SourceDialect(SerialDialect):
    """What the dialect of every source has, of a current or of a voltage.

    Templates use `{i}` and `{v}`, fixed-point.

    Attributes:
        current_unit, voltage_unit: what a 1 means on the wire, sent and read, A and V.
        digits: decimals of the set-point on the wire.
        limit, limit_query: set and read the compliance.
        set, set_query: set and read the set-point.
        on, off, on_query: the output.
        on_match, off_match: its answer when on and when off; any other is no answer.
        measure_current, measure_voltage: measured values.
        current_match, voltage_match: where they stand in the answers, if not alone.
        join: text that joins a line and the error query into one; "": two lines.
    """

    sets: ClassVar[Literal["i", "v"]]
    """What its set-point is, as `set` has it; the other is its compliance."""
    current_unit: Annotated[float, Unit("A", above=0.0)] = 1.0
    voltage_unit: Annotated[float, Unit("V", above=0.0)] = 1.0
    digits: int = Field(default=5, ge=0, le=8)
    limit: Line
    limit_query: Line
    set: Line
    set_query: Line
    on: Lines
    off: Lines
    on_query: Line
    on_match: Pattern = r"^\s*\+?(1|ON)\s*$"
    off_match: Pattern = r"^\s*\+?(0|OFF)\s*$"
    measure_current: Line
    measure_voltage: Line
    current_match: Picking | None = None
    voltage_match: Picking | None = None
    join: Line = ";:"

    def verified(self, line: str) -> tuple[str, ...]:
        """`line` with the error query behind it, as one line or two."""
        if self.error is None or not self.join:
            return super().verified(line)
        return (line + self.join + self.error,)

    @property
    def set_unit(self) -> float:
        """What a 1 of the set-point means, A or V."""
        return self.current_unit if self.sets == "i" else self.voltage_unit

    @property
    def limit_unit(self) -> float:
        """What a 1 of the compliance means, V or A."""
        return self.voltage_unit if self.sets == "i" else self.current_unit

    @property
    def grain(self) -> float:
        """Smallest step of the set-point that the wire carries, A or V."""
        return float(10.0**-self.digits * self.set_unit)

    def sent(self, value: float) -> float:
        """A set-point, A or V, as the number on the wire; never a negative zero."""
        return round(value / self.set_unit, self.digits) + 0.0

    def fixed(self, value: float) -> float:
        """A set-point, A or V, as the source gets it."""
        return self.sent(value) * self.set_unit

    def set_line(self, value: float) -> str:
        """Line that sets A or V; never an exponent, never a negative zero."""
        return self.set.format(**{self.sets: self.sent(value)})

    def limit_line(self, value: float) -> str:
        """Line that sets the compliance, V or A."""
        other = "v" if self.sets == "i" else "i"
        return self.limit.format(**{other: value / self.limit_unit})

    def _try_lines(self, lines: Iterable[str], where: str) -> None:
        """Refuse lines that are too long, and set-points that lose digits."""
        if decimals(self.set) < self.digits:
            raise SceneError(
                f'Dialect {where}: set = "{self.set}" has {decimals(self.set)} '
                f"decimals, less than digits = {self.digits}. Write as many."
            )
        for line in (part for one in lines for part in self.verified(one)):
            if len(line) + len(self.serial.send_end) > self.serial.max_line:
                raise SceneError(
                    f"Dialect {where}: {line!r} with its terminator is longer "
                    f"than max_line = {self.serial.max_line}."
                )


class CoilDialect(SourceDialect):
    """How a current source speaks.

    Attributes:
        polarity: "both", or "positive" for a source that cannot reverse.
        current: largest magnitude the model gives, A.
        voltage: largest compliance the model takes, V.
        measures_when_off: the model measures with its output off; else verifying off
            relies on output state and set-point.
        list: list mode, None where the model has none worth using.
        analogue: analogue input, None where the model has none.
    """

    role: Literal["coil"]
    sets: ClassVar[Literal["i", "v"]] = "i"
    set: Annotated[Line, amount("i")]
    limit: Annotated[Line, amount("v")]
    polarity: Literal["both", "positive"]
    current: Current
    voltage: Voltage
    measures_when_off: bool = True
    list: ListMode | None = None
    analogue: AnalogueMode | None = None

    def try_templates(self, where: str) -> None:
        """Fill in every template with extremes.

        Raises:
            SceneError: a line is too long, or set too coarse for its digits.
        """
        extremes = (-self.current, 0.0, self.current)
        lines = [*map(self.set_line, extremes), self.limit_line(self.voltage)]
        self._try_lines(lines, where)
        if self.list is not None:
            self._try_list_lines(self.list, where)

    def _try_list_lines(self, mode: ListMode, where: str) -> None:
        """Refuse more points a line than a line can hold."""
        current = f"{self.sent(-self.current):.{self.digits}f}"
        dwell = f"{mode.longest:.{mode.dwell_digits}f}"
        for template, value in ((mode.points, current), (mode.dwells, dwell)):
            line = template.format(values=",".join([value] * mode.points_per_line))
            longest = max(map(len, self.verified(line))) + len(self.serial.send_end)
            if longest > self.serial.max_line:
                raise SceneError(
                    f"Dialect {where}: {mode.points_per_line} points a line take "
                    f"{longest} characters, more than max_line = "
                    f"{self.serial.max_line}."
                )

    def check_limits(self, limits: CoilLimits) -> None:
        """Refuse limits beyond what the model can do.

        Raises:
            SceneError: the current or the compliance is.
        """
        for name, limit, most, unit in (
            ("current", limits.current, self.current, "A"),
            ("compliance", limits.compliance, self.voltage, "V"),
        ):
            if limit > most:
                raise SceneError(
                    f"[coil.limits] {name} = {show(limit, unit)} is beyond the "
                    f"{show(most, unit)} of {self.title}. Write "
                    f'{name} = "{most:g} {unit}" or less.'
                )

    @property
    def stop_lines(self) -> tuple[str, ...]:
        """Lines that end a list that may be playing; () without list mode."""
        return () if self.list is None else self.list.stop

    def promised_interval(self, baud: int | None = None) -> float:
        """Update interval to plan with, s: wire time, gap and latency with margin."""
        return MARGIN * self._exchange(self.set_line(-self.current), baud)

    def lists(self, baud: int | None = None) -> ListCapability | None:
        """What lists the model plays, and how long they take to load; None: none."""
        mode = self.list
        if mode is None:
            return None
        current = f"{self.sent(-self.current):.{self.digits}f}"
        dwell = f"{mode.shortest:.{mode.dwell_digits}f}"
        per_line = sum(
            self._exchange(template.format(values=",".join(values)), baud)
            for template, values in (
                (mode.points, [current] * mode.points_per_line),
                (mode.dwells, [dwell] * mode.points_per_line),
            )
        )
        asked = [q for q in (mode.points_query, mode.dwells_query) if q]
        others = (*mode.clear, mode.count, *asked, *mode.start)
        return ListCapability(
            points=mode.max_points,
            shortest=mode.shortest,
            longest=mode.longest,
            resolution=10.0**-mode.dwell_digits,
            load_fixed=sum(self._exchange(line, baud) for line in others),
            load_point=per_line / mode.points_per_line,
        )

    def _exchange(self, line: str, baud: int | None) -> float:
        """Typical time to send `line` and to verify it, s."""
        wire = self.serial.at(baud)
        lines = self.verified(line)
        sent = sum(len(line) + len(wire.send_end) for line in lines)
        answer = len('0,"No error"\r\n') if self.error else 0
        typical = (sent + answer) * wire.character_time
        return typical + len(lines) * (wire.latency + wire.min_gap)
