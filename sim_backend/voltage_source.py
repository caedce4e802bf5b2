"""Simulated source meters that hold a voltage of the circuit.

Written from the manual's facts, not from the dialect rows, so that a wrong row fails;
a row of the user's own is served as it says.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sim_backend.serial_line.from_row import Answer, RowParser, invented, reader
from sim_backend.serial_line.keithley import Elements, Sensing, identity
from sim_backend.serial_line.scpi import (
    Handler,
    ScpiError,
    ScpiParser,
    bare,
    boolean,
    numeric,
    one_of,
)
from tactile_lab.clock import Clock
from tactile_lab.instruments.voltage_dialect import VoltageDialect

LEAK = 10e9
"""Resistance of gate and cable to ground, Ohm."""

NOISE = 10e-6
"""Standard deviation of a reading, V."""


class SourceLoad(Protocol):
    """What a source's terminals are connected to."""

    def set_voltage(self, name: str, time: float, volts: float) -> None:
        """Let the voltage called `name` be `volts` from `time` s on."""
        ...


@dataclass(frozen=True, kw_only=True)
class LoadFault:
    """What goes wrong at the terminals, for tests.

    Attributes:
        resistance: to ground, Ohm; 0 is a short.
        after: from when on, s of the bench's clock.
    """

    resistance: float = 0.0
    after: float = 0.0


class VoltagePanel:
    """State of a simulated source of a voltage."""

    clearing, reply_end, gap = b"\x03\x18", b"\n", 0.0

    def __init__(
        self, plant: SourceLoad, name: str, clock: Clock, seed: int = 0
    ) -> None:
        self._plant, self.name, self._clock = plant, name, clock
        self._random = np.random.default_rng(seed)
        self.setpoint, self.compliance = 0.0, 105e-6
        self.output_on = False
        self.fault: LoadFault | None = None
        self.changes: list[tuple[str, float, float]] = []
        """What was changed (`set`, `limit`, `output`), when, to what; for tests."""
        self._apply()

    @property
    def load(self) -> float:
        """Resistance between its terminals, Ohm."""
        fault = self.fault
        broken = fault is not None and self._clock.now() >= fault.after
        return fault.resistance if fault is not None and broken else LEAK

    @property
    def voltage(self) -> float:
        """Between its terminals, V: less than the set-point in compliance."""
        if not self.output_on:
            return 0.0
        most = self.compliance * self.load
        return min(max(self.setpoint, -most), most)

    @property
    def current(self) -> float:
        """That it gives, A."""
        volts, load = self.voltage, self.load
        if self.output_on and volts != self.setpoint:
            return math.copysign(self.compliance, self.setpoint)
        return volts / load if load else 0.0

    def measured(self) -> tuple[float, float]:
        """Voltage, V, with noise, and current, A."""
        self._apply()
        return self.voltage + NOISE * self._random.standard_normal(), self.current

    def set(self, volts: float) -> None:
        """Set-point, V."""
        self.setpoint = volts
        self._note("set", volts)

    def limit(self, amperes: float) -> None:
        """Compliance, A."""
        self.compliance = amperes
        self._note("limit", amperes)

    def switch(self, on: bool) -> None:
        """Switch the output."""
        self.output_on = on
        self._note("output", float(on))

    def _note(self, what: str, value: float) -> None:
        self.changes.append((what, self._clock.now(), value))
        self._apply()

    def _apply(self) -> None:
        self._plant.set_voltage(self.name, self._clock.now(), self.voltage)


class Keithley2400(VoltagePanel):
    """A simulated Keithley 2400; takes one line at a time."""

    def __init__(
        self, plant: SourceLoad, name: str, clock: Clock, seed: int = 0
    ) -> None:
        super().__init__(plant, name, clock, seed)
        self._voltage_mode, self._range = False, 21.0
        self._modes = {"output": "NORM", "source": "FIX"}
        self._elements = Elements()
        self._concurrent = True
        self.parser = ScpiParser(self._commands())

    def line(self, line: bytes) -> bytes | None:
        """Act on one line; the answer without terminator, or None."""
        return self.parser.line(line)

    def _commands(self) -> dict[str, Handler]:
        def keep(name: str) -> Callable[[str], None]:
            return lambda choice: self._modes.update({name: choice})

        def function(choice: str) -> None:
            self._voltage_mode = choice == "VOLT"
            self.switch(False)  # a change of function switches off

        def concurrent(argument: str) -> None:
            self._concurrent = boolean(argument)

        def accept(_: float) -> None:
            """Settings that change nothing a gate could notice."""

        return {
            "*IDN?": lambda _: identity("2400"),
            "SYSTem:BEEPer:STATe": lambda argument: accept(boolean(argument)),
            "SYSTem:LOCal": bare(lambda: None),
            "SOURce:FUNCtion[:MODE]": one_of(function, "CURRent", "VOLTage"),
            "SOURce:FUNCtion[:MODE]?": lambda _: (
                "VOLT" if self._voltage_mode else "CURR"
            ),
            "SOURce:VOLTage:MODE": one_of(keep("source"), "FIXed", "LIST", "SWEep"),
            "SOURce:VOLTage:MODE?": lambda _: self._modes["source"],
            "SOURce:VOLTage:RANGe": numeric(self._choose, -210.0, 210.0),
            "SOURce:VOLTage:RANGe?": lambda _: f"{self._range:+.6E}",
            "SOURce:VOLTage[:LEVel]": numeric(self._level, -210.0, 210.0),
            "SOURce:VOLTage[:LEVel]?": lambda _: f"{self.setpoint:+.6E}",
            **Sensing().commands,
            "SENSe:FUNCtion:CONCurrent": concurrent,
            "SENSe:FUNCtion:CONCurrent?": lambda _: str(int(self._concurrent)),
            "SENSe:CURRent:PROTection": numeric(self.limit, 1e-9, 1.05),
            "SENSe:CURRent:PROTection?": lambda _: f"{self.compliance:+.6E}",
            "FORMat:ELEMents": self._elements.choose,
            "FORMat:ELEMents?": lambda _: ",".join(self._elements.chosen),
            "OUTPut:SMODe": one_of(
                keep("output"), "NORMal", "ZERO", "HIMPedance", "GUARd"
            ),
            "OUTPut:SMODe?": lambda _: self._modes["output"],
            "OUTPut[:STATe]": lambda argument: self.switch(boolean(argument)),
            "OUTPut[:STATe]?": lambda _: str(int(self.output_on)),
            "READ?": lambda _: self._elements.answer(self.output_on, *self.measured()),
        }

    def _choose(self, volts: float) -> None:
        self._range = next(one for one in (0.21, 2.1, 21.0, 210.0) if abs(volts) <= one)

    def _level(self, volts: float) -> None:
        if not self._voltage_mode:
            raise ScpiError(-221, "Settings conflict")
        if abs(volts) > self._range:
            raise ScpiError(-222, "Data out of range")
        step = self._range / 2.1 * 50e-6
        self.set(round(volts / step) * step)


class RowVoltageSource(VoltagePanel):
    """A simulated source of a voltage made from its row.

    Raises:
        SceneError: no answer can be made from one of its patterns.
    """

    def __init__(
        self, plant: SourceLoad, name: str, row: VoltageDialect, clock: Clock
    ) -> None:
        super().__init__(plant, name, clock)
        self._row, self.gap = row, row.serial.min_gap
        self.reply_end = row.serial.reply_end.encode("ascii")
        self.clearing = row.serial.preamble.encode("ascii")
        self._levels = (
            (reader(row.set), row.set_unit, self.set),
            (reader(row.limit), row.limit_unit, self.limit),
        )
        self._chosen = reader(row.range or row.set)
        self._range = row.ranges[-1].full
        self._told: deque[str] = deque()
        self._talk = RowParser(row, self._queries(), self._act, self._told)

    def line(self, line: bytes) -> bytes | None:
        """Act on one line; the answer without terminator, or None."""
        return self._talk.line(line)

    def _queries(self) -> dict[str, Answer]:
        row, one = self._row, self._row.number
        volt, ampere = row.voltage_unit, row.current_unit
        on = row.on_match, row.off_match
        found: dict[str, Answer] = {
            row.set_query: lambda: invented(one, f"{self.setpoint / volt:.6f}"),
            row.limit_query: lambda: invented(one, f"{self.compliance / ampere:.9f}"),
            row.on_query: lambda: invented(on[0] if self.output_on else on[1]),
        }
        if row.range_query is not None:
            found[row.range_query] = lambda: invented(one, f"{self._range / volt:.3f}")
        if row.measure_current == row.measure_voltage:
            # the order that both patterns of the rows that ship have
            both = "{:.6f},{:.9f}"
            return found | {row.measure_current: lambda: self._told_as(both)}
        return found | {
            row.measure_voltage: lambda: invented(one, self._told_as("{:.6f}")),
            row.measure_current: lambda: invented(one, self._told_as("{1:.9f}")),
        }

    def _told_as(self, form: str) -> str:
        """Voltage and current as `form` has them, in the row's units."""
        voltage, current = self.measured()
        row = self._row
        return form.format(voltage / row.voltage_unit, current / row.current_unit)

    def _act(self, text: str) -> bool:
        for read, unit, act in self._levels:
            if (value := read(text)) is not None:
                act(value * unit)
                return True
        if text in self._row.on or text in self._row.off:
            self.switch(text in self._row.on)
            return True
        if self._row.range is None or (volts := self._chosen(text)) is None:
            return False
        most = volts * self._row.voltage_unit
        self._range = next(one.full for one in self._row.ranges if most <= one.full)
        return True


def voltage_far_end(
    plant: SourceLoad, name: str, row: VoltageDialect, clock: Clock, *, seed: int = 0
) -> Keithley2400 | RowVoltageSource:
    """The simulated source that speaks `row`: written from a manual, or from the row.

    Raises:
        SceneError: the row does not say enough.
    """
    if row.id == "keithley-2400-voltage":
        return Keithley2400(plant, name, clock, seed)
    return RowVoltageSource(plant, name, row, clock)
