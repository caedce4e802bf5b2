"""The simulated serial instruments for other programs: one coil behind them."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import TextIO

from sim_backend.coil.panel import PanelChange
from sim_backend.coil.source import coil_far_end
from sim_backend.plant.driven_coil import DrivenCoil
from sim_backend.plant.options import PlantOptions
from sim_backend.serial_line.servers import PtyServer, SerialServer, TcpServer
from sim_backend.serial_line.wires import FarEnd, LineInstrument
from sim_backend.teslameter import meter_far_end
from sim_backend.thermometer import thermometer_far_end
from sim_backend.voltage_source import voltage_far_end
from tactile_lab.clock import Clock, RealClock
from tactile_lab.errors import InstrumentError, SceneError
from tactile_lab.instruments.dialects import (
    coil_dialect,
    teslameter_dialect,
    thermometer_dialect,
    voltage_dialect,
)
from tactile_lab.instruments.serial_dialect import SerialSettings
from tactile_lab.magnetics import Magnet

BACKLOG = 1000
"""Set-points the electromagnet remembers before it forgets the older half."""


class CoilOnly(DrivenCoil):
    """Coil and field without sensor or scope; safe for all threads."""

    def __init__(self, magnet: Magnet) -> None:
        super().__init__(PlantOptions().electromagnet())
        self._magnet = magnet

    def field(self, time: float) -> float:
        """Flux density of the electromagnet, T."""
        with self._lock:
            return float(self._magnet.field(self._electromagnet.effective(time)))

    def _command(self, time: float) -> None:
        self._electromagnet.command(time, self._driven)
        if self._electromagnet.commands > BACKLOG:
            self._electromagnet.forget(BACKLOG // 2)


class Gate:
    """A gate in the air: what a source gives, and nothing that feels it."""

    def __init__(self) -> None:
        self.volts: dict[str, float] = {}

    def set_voltage(self, name: str, time: float, volts: float) -> None:
        """Let the voltage called `name` be `volts` from `time` s on."""
        self.volts[name] = volts


class Air:
    """The air of the room, in which a thermometer's sensor hangs."""

    def temperature(self, time: float) -> float:
        """Its temperature at any `time` s, K."""
        return 293.15


class ServedBench:
    """Simulated instruments at addresses other programs can open.

    Args:
        coil: `pty`, `tcp:PORT` (0 for any free port) or None for no source.
        teslameter: the same for the teslameter.
        voltage_source: the same for a source meter that holds V_GS.
        thermometer: the same for a thermometer.
        coil_row, meter_row, voltage_row, thermometer_row: ids of the dialect rows they
            speak, or files with one.
        baud: of the source instead of its row's.
        paced: let bytes take the time the baud rate gives them, and the instruments
            the time they take to act.
        log: JSON line per thing the source was told, with the time since boot.

    Attributes:
        gate: what the source meter is connected to.

    Raises:
        SceneError: an address or row that cannot be served.
        InstrumentError: the TCP port is taken.
    """

    def __init__(
        self,
        *,
        coil: str | None = "pty",
        teslameter: str | None = None,
        voltage_source: str | None = None,
        thermometer: str | None = None,
        coil_row: str = "kepco-bop",
        meter_row: str = "lakeshore-425",
        voltage_row: str = "keithley-2400-voltage",
        thermometer_row: str = "lakeshore-218",
        baud: int | None = None,
        paced: bool = False,
        log: Path | None = None,
    ) -> None:
        clock: Clock = RealClock()
        self._log: TextIO | None = None
        self._servers: dict[str, SerialServer] = {}
        plant = CoilOnly(Magnet(r=6e-3))
        self.gate = Gate()
        try:
            if coil is not None:
                row = coil_dialect(coil_row)
                source, wire = coil_far_end(plant, row, clock), row.serial
                if log is not None:
                    self._log = _appended(log)
                    source.on_change = _writer(self._log)
                self._add("coil", coil, source, wire.at(baud), clock, paced)
            if teslameter is not None:
                known = teslameter_dialect(meter_row)
                meter = meter_far_end(plant, known, clock, noise=2e-6, seed=1)
                self._add("teslameter", teslameter, meter, known.serial, clock, paced)
            if voltage_source is not None:
                speaks = voltage_dialect(voltage_row)
                held = voltage_far_end(self.gate, "V_GS", speaks, clock, seed=1)
                self._add(
                    "voltage_source", voltage_source, held, speaks.serial, clock, paced
                )
            if thermometer is not None:
                warm = thermometer_dialect(thermometer_row).at(None)
                sensor = thermometer_far_end(Air(), warm, clock, seed=1)
                self._add("thermometer", thermometer, sensor, warm.serial, clock, paced)
        except BaseException:
            self.close()
            raise

    @property
    def addresses(self) -> dict[str, str]:
        """Address for pyserial of each instrument."""
        return {name: server.url for name, server in self._servers.items()}

    def start(self) -> None:
        """Serve from now on."""
        for server in self._servers.values():
            server.start()

    def close(self) -> None:
        """End all servers; idempotent."""
        for server in self._servers.values():
            server.close()
        if self._log is not None:
            self._log.close()
            self._log = None

    def _add(
        self,
        name: str,
        where: str,
        instrument: LineInstrument,
        wire: SerialSettings,
        clock: Clock,
        paced: bool,
    ) -> None:
        if not paced:
            wire = wire.model_copy(update={"latency": 0.0})
        far_end = FarEnd(instrument, wire, clock, name)
        self._servers[name] = _server(where, far_end, paced)


def _server(where: str, far_end: FarEnd, paced: bool) -> SerialServer:
    if where == "pty":
        return PtyServer(far_end, paced=paced)
    kind, _, port = where.partition(":")
    if kind != "tcp" or not port.isdecimal() or int(port) > 65535:
        raise SceneError(
            f'"{where}" is no address to serve at; write pty, or tcp:PORT with a port '
            "from 0 (any free one) to 65535."
        )
    try:
        return TcpServer(far_end, int(port), paced=paced)
    except OSError as reason:
        raise InstrumentError(
            f"TCP port {port} cannot be served ({reason}); choose another, or 0."
        ) from reason


def _appended(log: Path) -> TextIO:
    try:
        return log.open("a", encoding="utf-8")
    except OSError as reason:
        raise SceneError(
            f"--log {log} cannot be written: {reason.strerror}; give a file in a "
            "folder that is there."
        ) from reason


def _writer(log: TextIO) -> Callable[[PanelChange], None]:
    def write(change: PanelChange) -> None:
        entry = {
            "monotonic_s": time.monotonic(),
            "what": change.what,
            "value": change.value,
        }
        log.write(json.dumps(entry) + "\n")
        log.flush()

    return write
