"""Simulated current sources: what a Kepco or Keithley does with the lines it gets.

Written from the manuals' facts, not from the dialect rows, so that a wrong row fails;
only a row of the user's own is served as it says, without list mode. No transport here:
`sim_backend.serial_line.wires` brings the bytes.
"""

from __future__ import annotations

import re
from collections import deque

from sim_backend.coil.keithley import KEITHLEY_2400, KEITHLEY_2420
from sim_backend.coil.kepco import KEPCO, PLAIN
from sim_backend.coil.panel import CoilPanel
from sim_backend.coil.tti import AIM_TTI
from sim_backend.plant.driven_coil import DrivenCoil
from sim_backend.serial_line.from_row import Answer, RowParser, invented, reader
from sim_backend.serial_line.scpi import ScpiParser
from tactile_lab.clock import Clock
from tactile_lab.errors import SceneError
from tactile_lab.instruments.serial_dialect import CoilDialect

TOO_MUCH = '-222,"Data out of range"'

MODELS = {
    "kepco-bop": KEPCO,
    "scpi-generic": PLAIN,
    "keithley-2400": KEITHLEY_2400,
    "keithley-2420": KEITHLEY_2420,
    "aim-tti-pl": AIM_TTI,
}
"""Simulated models by the id of the dialect row they speak."""


class SimCoilSource(CoilPanel):
    """A simulated current source.

    Args:
        plant: the physics behind its terminals.
        model: name in `MODELS`.
        clock: the bench's time.

    Raises:
        SceneError: nobody simulates that model.
    """

    def __init__(self, plant: DrivenCoil, model: str, clock: Clock) -> None:
        if model not in MODELS:
            raise SceneError(
                f'There is no simulated source for the dialect "{model}"; there is one '
                f"for {', '.join(MODELS)}."
            )
        known = MODELS[model]
        super().__init__(plant, clock, known.rating, known.analogue)
        self.reply_end = known.reply_end
        self.clearing = known.clearing
        self._rewrite = known.rewrite
        self.parser = ScpiParser(
            known.commands(self),
            max_line=known.max_line,
            max_queries=known.max_queries,
            standard=known.standard,
            errors=self.errors,
        )

    def line(self, line: bytes) -> bytes | None:
        """Act on one line; the answer without terminator, or None."""
        return self.parser.line(self._rewrite(line))


class RowCoil(CoilPanel):
    """A simulated current source made from its row.

    Raises:
        SceneError: no answer can be made from one of its patterns.
    """

    def __init__(self, plant: DrivenCoil, row: CoilDialect, clock: Clock) -> None:
        mode = row.analogue
        analogue = None if mode is None else (mode.gain, mode.bandwidth)
        rating = row.current, row.voltage
        super().__init__(plant, clock, rating, analogue)
        self._row = row
        self.reply_end = row.serial.reply_end.encode("ascii")
        self.clearing = row.serial.preamble.encode("ascii")
        self.gap = row.serial.min_gap
        self._limit, self._set = reader(row.limit), reader(row.set)
        self._told: deque[str] = deque()
        self._talk = RowParser(row, self._queries(), self._act, self._told)

    def line(self, line: bytes) -> bytes | None:
        """Act on one line; the answer without terminator, or None."""
        return self._talk.line(line)

    def _queries(self) -> dict[str, Answer]:
        row = self._row
        found: dict[str, Answer] = {
            row.set_query: lambda: self._number(
                self.setpoint / row.set_unit, row.number
            ),
            row.limit_query: lambda: self._number(
                self.compliance / row.limit_unit, row.number
            ),
            row.on_query: lambda: invented(
                row.on_match if self.output_on else row.off_match
            ),
        }
        if row.measure_current == row.measure_voltage:
            return found | {row.measure_current: self._both}
        current, voltage = row.current_match, row.voltage_match
        return found | {
            row.measure_current: lambda: self._number(
                self.measured_current() / row.current_unit, current or row.number
            ),
            row.measure_voltage: lambda: self._number(
                self.measured_voltage() / row.voltage_unit, voltage or row.number
            ),
        }

    def _both(self) -> str:
        """Current and voltage in one answer, in the order the row looks for."""
        row = self._row
        voltage = self.measured_voltage() / row.voltage_unit
        parts = (voltage, self.measured_current() / row.current_unit)
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
        if (number := self._set(text)) is not None:
            amperes = number * row.set_unit
            if abs(amperes) > row.current or (
                amperes < 0 and row.polarity == "positive"
            ):
                self._told.append(TOO_MUCH)
            else:
                self.set_current(amperes)
            return True
        if (number := self._limit(text)) is not None:
            volts = number * row.limit_unit
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


def coil_far_end(
    plant: DrivenCoil, row: CoilDialect, clock: Clock
) -> SimCoilSource | RowCoil:
    """The simulated source that speaks `row`: written from a manual, or from the row.

    Raises:
        SceneError: the row does not say enough.
    """
    if row.id in MODELS:
        return SimCoilSource(plant, row.id, clock)
    return RowCoil(plant, row, clock)
