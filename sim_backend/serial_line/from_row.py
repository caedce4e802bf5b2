"""Far ends for rows of a user's own, as far as the row itself describes them.

They say what the row expects to hear, so they cannot find out that a row is wrong; the
models that ship are written from their manuals instead. List mode is not simulated.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable
from string import Formatter

from drivers.teslameter import MULTIPLIERS
from sim_backend.coil.panel import CoilPanel, CoilPlant
from sim_backend.coil.source import MODELS as SOURCES
from sim_backend.coil.source import SimCoilSource
from sim_backend.serial_line.invented import invented
from sim_backend.teslameter import MODELS as METERS
from sim_backend.teslameter import FieldPlant, SimTeslameter
from tactile_lab.clock import Clock
from tactile_lab.errors import SceneError
from tactile_lab.instruments.serial_dialect import (
    CoilDialect,
    MeterDialect,
    SerialDialect,
)

UNKNOWN = '-113,"Undefined header"'
TOO_MUCH = '-222,"Data out of range"'

Answer = Callable[[], str]


def coil_far_end(
    plant: CoilPlant, row: CoilDialect, clock: Clock
) -> SimCoilSource | RowCoil:
    """The simulated source that speaks `row`: written from a manual, or from the row.

    Raises:
        SceneError: the row does not say enough.
    """
    if row.id in SOURCES:
        return SimCoilSource(plant, row.id, clock)
    return RowCoil(plant, row, clock)


def meter_far_end(
    plant: FieldPlant,
    row: MeterDialect,
    clock: Clock,
    *,
    noise: float = 0.0,
    seed: int = 0,
) -> SimTeslameter | RowMeter:
    """The simulated teslameter that speaks `row`, as `coil_far_end`.

    Args:
        plant: the physics at the probe.
        row: the dialect.
        clock: the bench's time.
        noise: standard deviation of a reading, T; not of one made from a row.
        seed: of the noise.
    """
    if row.id in METERS:
        return SimTeslameter(plant, row.id, clock, noise=noise, seed=seed)
    return RowMeter(plant, row, clock)


class Talk:
    """What is common to all rows: name, settings that are accepted, error queue.

    Args:
        row: the dialect.
        answers: further queries.
        acts: further lines; each says whether it was meant.
        errors: of the instrument, oldest first.
    """

    def __init__(
        self,
        row: SerialDialect,
        answers: dict[str, Answer],
        acts: Callable[[str], bool],
        errors: deque[str],
    ) -> None:
        name, fine = invented(row.match), invented(row.error_ok)
        self._answers = {row.identify: lambda: name} | answers
        if row.error is not None:
            self._answers[row.error] = lambda: errors.popleft() if errors else fine
        self._accepted = {*row.init, *row.optional, *row.release}
        self._acts, self._errors = acts, errors
        join = row.join if isinstance(row, CoilDialect) else ""
        self._error = row.error
        self._tail = join + row.error if join and row.error else None

    def line(self, line: bytes) -> bytes | None:
        """Act on one line; the answer without terminator, or None."""
        parts = [line.decode("ascii", "replace")]
        if self._tail and self._error and parts[0].endswith(self._tail):
            parts = [parts[0].removesuffix(self._tail), self._error]
        said = [self._one(part) for part in parts]
        told = ";".join(one for one in said if one)
        return told.encode("ascii") if told else None

    def _one(self, text: str) -> str | None:
        if text in self._answers:
            return self._answers[text]()
        if not self._acts(text) and text not in self._accepted:
            self._errors.append(UNKNOWN)
        return None


class RowCoil(CoilPanel):
    """A simulated current source made from its row.

    Args:
        plant: the physics behind its terminals.
        row: the dialect.
        clock: the bench's time.

    Raises:
        SceneError: no answer can be made from one of its patterns.
    """

    def __init__(self, plant: CoilPlant, row: CoilDialect, clock: Clock) -> None:
        super().__init__(plant, clock, (row.current, row.voltage))
        self._row = row
        self.reply_end = row.serial.reply_end.encode("ascii")
        self.clearing = row.serial.preamble.encode("ascii")
        self._limit, self._set = _reader(row.limit), _reader(row.set)
        self._told: deque[str] = deque()
        self._talk = Talk(row, self._queries(), self._act, self._told)
        for answer in self._queries().values():
            answer()  # a pattern without an answer is found here, not in a run

    def line(self, line: bytes) -> bytes | None:
        """Act on one line; the answer without terminator, or None."""
        return self._talk.line(line)

    def _queries(self) -> dict[str, Answer]:
        row = self._row
        found: dict[str, Answer] = {
            row.set_query: lambda: self._number(self.setpoint, row.number),
            row.limit_query: lambda: self._number(self.compliance, row.number),
            row.on_query: lambda: invented(
                row.on_match if self.output_on else row.off_match
            ),
        }
        if row.measure_current == row.measure_voltage:
            return found | {row.measure_current: self._both}
        current, voltage = row.current_match, row.voltage_match
        return found | {
            row.measure_current: lambda: self._number(
                self.measured_current(), current or row.number
            ),
            row.measure_voltage: lambda: self._number(
                self.measured_voltage(), voltage or row.number
            ),
        }

    def _both(self) -> str:
        """Current and voltage in one answer, in the order the row looks for."""
        row, parts = self._row, (self.measured_voltage(), self.measured_current())
        for order in (parts, parts[::-1]):
            text = ",".join(f"{value:.{row.digits}f}" for value in order)
            found = [
                re.search(pattern or row.number, text)
                for pattern in (row.voltage_match, row.current_match)
            ]
            if all(found) and len({m.start(1) for m in found if m}) == 2:
                return text
        raise SceneError(
            f'The dialect "{row.id}" asks for current and voltage in one line; no '
            "simulated answer can be made from its patterns."
        )

    def _number(self, value: float, pattern: str) -> str:
        return invented(pattern, f"{value:.{self._row.digits}f}")

    def _act(self, text: str) -> bool:
        row = self._row
        if (amperes := self._set(text)) is not None:
            if abs(amperes) > row.current or (
                amperes < 0 and row.polarity == "positive"
            ):
                self._told.append(TOO_MUCH)
            else:
                self.set_current(amperes)
            return True
        if (volts := self._limit(text)) is not None:
            if volts > row.voltage:
                self._told.append(TOO_MUCH)
            else:
                self.set_compliance(volts)
            return True
        if text in row.on or text in row.off:
            if text not in row.off:
                self.switch(True)
            elif text not in row.on:
                self.switch(False)
            return True
        return text in row.stop_lines


class RowMeter:
    """A simulated teslameter made from its row; it has neither range nor noise.

    Args:
        plant: the physics at the probe.
        row: the dialect.
        clock: the bench's time.

    Raises:
        SceneError: no answer can be made from one of its patterns.
    """

    def __init__(self, plant: FieldPlant, row: MeterDialect, clock: Clock) -> None:
        self.reply_end = row.serial.reply_end.encode("ascii")
        self.clearing = row.serial.preamble.encode("ascii")
        per_tesla = 1 / row.scale

        def field() -> str:
            value = plant.field(clock.now()) * per_tesla
            return invented(row.number, f"{value:.7f}")

        answers: dict[str, Answer] = dict.fromkeys(row.report.values(), lambda: "1")
        if row.multiplier is not None:
            per_tesla /= MULTIPLIERS["m"]
            answers[row.multiplier] = lambda: "m"
        answers[row.field] = field
        self._talk = Talk(row, answers, lambda text: False, deque())
        field()

    def line(self, line: bytes) -> bytes | None:
        """Act on one line; the answer without terminator, or None."""
        return self._talk.line(line)


def _reader(template: str) -> Callable[[str], float | None]:
    """Reads the number back that `template` was filled with; None for other lines."""
    pattern = "".join(
        re.escape(literal) + ("" if name is None else r"([-+]?\d+\.?\d*)")
        for literal, name, _, _ in Formatter().parse(template)
    )

    def read(line: str) -> float | None:
        found = re.fullmatch(pattern, line)
        return None if found is None else float(found.group(1))

    return read
