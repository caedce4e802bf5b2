"""Simulated thermometers: what a Lake Shore does with the lines it gets.

Written from the manual of the 218 (6.2, 6.3), not from the rows, so that a wrong row
fails; a row of the user's own is served as it says.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np

from sim_backend.serial_line.from_row import Answer, RowParser, invented
from sim_backend.serial_line.scpi import Handler, ScpiError, ScpiParser
from tactile_lab.clock import Clock
from tactile_lab.instruments.meter_dialect import ThermometerDialect
from tactile_lab.scene.tables import ZERO_CELSIUS

NOISE = 5e-3
"""Standard deviation of a reading, K."""

OPEN = 480.0
"""What an open diode is shown as, K: only the status says that it is no reading."""

OVERRANGE = 32 + 128
"""Status of an open sensor: temperature and sensor units over range."""


class TemperatureSource(Protocol):
    """What has the temperature that is read."""

    def temperature(self, time: float) -> float:
        """Temperature at `time` s, K."""
        ...


@dataclass(frozen=True, kw_only=True)
class SensorFault:
    """The thermometer's own sensor comes loose, for tests.

    Attributes:
        after: from when on, s of the bench's clock.
    """

    after: float = 0.0


class SimThermometer:
    """A simulated Lake Shore whose first input has a sensor; the others are open.

    Args:
        place: where its sensor is.
        model: name in `MODELS`.
        clock: the bench's time.
        seed: of the noise.
    """

    clearing = b""

    def __init__(
        self, place: TemperatureSource, model: str, clock: Clock, *, seed: int = 0
    ) -> None:
        self._place, self._clock = place, clock
        self._random = np.random.default_rng(seed)
        self.identity, self.inputs, self._digits, self.reply_end = MODELS[model]
        self.gap = 0.05
        self.fault: SensorFault | None = None
        commands: dict[str, Handler] = {
            "*IDN?": lambda _: self.identity,
            "KRDG?": lambda name: self._shown(self._kelvin(name)),
            "CRDG?": lambda name: self._shown(self._kelvin(name) - ZERO_CELSIUS),
            "RDGST?": lambda name: f"{0 if self._has_sensor(name) else OVERRANGE:03d}",
            "INCRV?": lambda name: "02" if self._has_sensor(name) else "00",
        }
        self.parser = ScpiParser(commands, max_queries=1, standard=False)

    def line(self, line: bytes) -> bytes | None:
        """Act on one line; the answer without terminator, or None."""
        return self.parser.line(line)

    def _has_sensor(self, name: str) -> bool:
        if name not in self.inputs:
            raise ScpiError(-224, "Illegal parameter value")
        loose = self.fault is not None and self._clock.now() >= self.fault.after
        return name == self.inputs[0] and not loose

    def _kelvin(self, name: str) -> float:
        if not self._has_sensor(name):
            return OPEN
        noise = NOISE * float(self._random.standard_normal())
        return self._place.temperature(self._clock.now()) + noise

    def _shown(self, value: float) -> str:
        return f"{value:+.{self._digits}f}"


MODELS: dict[str, tuple[str, str, int, bytes]] = {
    "lakeshore-218": ("LSCI,MODEL218S,21EA4F,042109", "12345678", 2, b"\r\n"),
    "lakeshore-335": ("LSCI,MODEL335,1234567/1234567,1.0", "AB", 3, b"\r\n"),
}
"""Name, inputs, digits behind the point and terminator of each model, by its row."""


def row_thermometer(
    place: TemperatureSource, row: ThermometerDialect, clock: Clock
) -> RowParser:
    """A simulated thermometer made from its row, at the input the row is for.

    Args:
        place: where its sensor is.
        row: the dialect, as `ThermometerDialect.at` gives it.
        clock: the bench's time.

    Raises:
        SceneError: no answer can be made from one of its patterns.
    """

    def kelvin() -> str:
        value = place.temperature(clock.now()) - row.zero
        return invented(row.number, f"{value:.3f}")

    answers: dict[str, Answer] = dict.fromkeys(row.report.values(), lambda: "1")
    if row.status is not None:
        answers[row.status] = partial(invented, row.status_ok)
    answers[row.temperature] = kelvin
    return RowParser(row, answers)


def thermometer_far_end(
    place: TemperatureSource, row: ThermometerDialect, clock: Clock, *, seed: int = 0
) -> SimThermometer | RowParser:
    """The simulated thermometer that speaks `row`, as `coil_far_end`.

    Args:
        place: where its sensor is.
        row: the dialect, as `ThermometerDialect.at` gives it.
        clock: the bench's time.
        seed: of the noise; not of one made from a row.
    """
    if row.id in MODELS:
        return SimThermometer(place, row.id, clock, seed=seed)
    return row_thermometer(place, row, clock)
