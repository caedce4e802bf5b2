"""Simulated teslameters: what a Lake Shore does with the lines it gets."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sim_backend.plant.driven_coil import DrivenCoil
from sim_backend.serial_line.from_row import Answer, RowParser, invented
from sim_backend.serial_line.scpi import Handler, ScpiError, ScpiParser, number
from tactile_lab.clock import Clock
from tactile_lab.errors import SceneError
from tactile_lab.instruments.meter_dialect import MULTIPLIERS, TeslameterDialect

PER_TESLA = {1: 1e4, 2: 1.0, 3: 1e4, 4: 1.0 / (4e-7 * np.pi)}
"""Answer per tesla for unit 1 G, 2 T, 3 Oe, 4 A/m."""

RANGES = {1: 35e-4, 2: 350e-4, 3: 3500e-4, 4: 35000e-4}
"""Full scale of each range, T."""


class SimTeslameter:
    """A simulated Lake Shore.

    Args:
        plant: the physics at the probe.
        model: name in `MODELS`.
        clock: the bench's time.
        noise: standard deviation of a reading, T.
        seed: of the noise.

    Raises:
        SceneError: nobody simulates that model.
    """

    clearing = b""

    def __init__(
        self,
        plant: DrivenCoil,
        model: str,
        clock: Clock,
        *,
        noise: float = 0.0,
        seed: int = 0,
    ) -> None:
        if model not in MODELS:
            raise SceneError(
                f'There is no simulated teslameter for the dialect "{model}"; there is '
                f"one for {', '.join(MODELS)}."
            )
        self._plant = plant
        self._clock = clock
        self._noise = noise
        self._random = np.random.default_rng(seed)
        self.reply_end, self.gap, standard, commands = MODELS[model]
        self.unit = 1
        self.range = 4
        self.autorange = False
        self.offset = 0.0
        self.settings: dict[str, str] = {}
        self.parser = ScpiParser(commands(self), standard=standard)

    def line(self, line: bytes) -> bytes | None:
        """Act on one line; the answer without terminator, or None."""
        return self.parser.line(line)

    def reading(self) -> float | None:
        """Flux density with noise and resolution, T; None on overload."""
        field = self._plant.field(self._clock.now()) - self.offset
        field += self._noise * float(self._random.standard_normal())
        if self.autorange:
            fits = [n for n, top in RANGES.items() if abs(field) <= top]
            self.range = min(fits, default=4)
        top = RANGES[self.range]
        if abs(field) > top:
            return None
        step = top / 35000
        return round(field / step) * step


def _choice(argument: str, low: int, high: int) -> int:
    value = number(argument, low, high)
    if value != int(value):
        raise ScpiError(-224, "Illegal parameter value")
    return int(value)


def _family(meter: SimTeslameter, model: str, modes: int) -> dict[str, Handler]:
    """Verbs of the 425, 455 and 475; `modes` parameters to RDGMODE."""

    def unit(argument: str) -> None:
        meter.unit = _choice(argument, 1, 4)

    def fixed_range(argument: str) -> None:
        meter.range, meter.autorange = _choice(argument, 1, 4), False

    def auto(argument: str) -> None:
        meter.autorange = bool(_choice(argument, 0, 1))

    def mode(argument: str) -> None:
        parts = argument.split(",")
        if len(parts) != modes:
            raise ScpiError(-109, "Missing parameter")
        meter.settings["mode"] = ",".join(str(_choice(p.strip(), 0, 3)) for p in parts)

    def field(_: str) -> str:
        value = meter.reading()
        return "OL" if value is None else f"{value * PER_TESLA[meter.unit]:+.7g}"

    return {
        "*IDN?": lambda _: f"LSCI,MODEL{model},{model}1234,1.2",
        "UNIT": unit,
        "UNIT?": lambda _: str(meter.unit),
        "RANGE": fixed_range,
        "RANGE?": lambda _: str(meter.range),
        "AUTO": auto,
        "AUTO?": lambda _: str(int(meter.autorange)),
        "RDGMODE": mode,
        "RDGMODE?": lambda _: meter.settings.get("mode", ",".join("1" * modes)),
        "RDGFIELD?": field,
    }


def _lakeshore_421(meter: SimTeslameter) -> dict[str, Handler]:
    def unit(argument: str) -> None:
        meter.unit = {"G": 1, "T": 2}.get(argument, 0)
        if meter.unit == 0:
            raise ScpiError(-224, "Illegal parameter value")

    def auto(argument: str) -> None:
        meter.autorange = bool(_choice(argument, 0, 1))

    def prefix() -> tuple[str, float]:
        top = RANGES[meter.range] * PER_TESLA[meter.unit]
        return ("m", 1e3) if top < 1 else ("", 1.0)

    def field(_: str) -> str:
        value = meter.reading()
        if value is None:
            return "OL"
        return f"{value * PER_TESLA[meter.unit] * prefix()[1]:+.4f}"

    return {
        "*IDN?": lambda _: "LSCI,MODEL421,0,010203",
        "UNIT": unit,
        "UNIT?": lambda _: {1: "G", 2: "T"}[meter.unit],
        "RANGE?": lambda _: str(4 - meter.range),
        "AUTO": auto,
        "AUTO?": lambda _: str(int(meter.autorange)),
        "ACDC": lambda argument: meter.settings.update(
            acdc=str(_choice(argument, 0, 1))
        ),
        "ACDC?": lambda _: meter.settings.get("acdc", "1"),
        "FIELD?": field,
        "FIELDM?": lambda _: prefix()[0],
    }


def _lakeshore_f41(meter: SimTeslameter) -> dict[str, Handler]:
    def mode(argument: str) -> None:
        if argument.upper() not in ("DC", "AC", "HIFR"):
            raise ScpiError(-224, "Illegal parameter value")
        meter.settings["mode"] = argument.upper()

    def unit(argument: str) -> None:
        units = {"GAUSS": 1, "TESLA": 2}
        if argument.upper() not in units:
            raise ScpiError(-224, "Illegal parameter value")
        meter.unit = units[argument.upper()]

    def field(_: str) -> str:
        value = meter.reading()
        return "9.9E37" if value is None else f"{value * PER_TESLA[meter.unit]:.8E}"

    meter.autorange = True
    return {
        "*IDN?": lambda _: "Lake Shore,F41,LSA1234,1.5.2019091901",
        "SENSe:MODE": mode,
        "SENSe:MODE?": lambda _: meter.settings.get("mode", "AC"),
        "UNIT:FIELd": unit,
        "UNIT:FIELd?": lambda _: {1: "GAUSS", 2: "TESLA"}[meter.unit],
        "FETCh:DC?": field,
        "FETCh:TEMPerature?": lambda _: "22.5",
        "PROBe:SNUMber?": lambda _: "P4321",
    }


MODELS: dict[
    str, tuple[bytes, float, bool, Callable[[SimTeslameter], dict[str, Handler]]]
] = {
    "lakeshore-425": (b"\r\n", 0.03, False, lambda meter: _family(meter, "425", 3)),
    "lakeshore-455": (b"\r\n", 0.03, False, lambda meter: _family(meter, "455", 5)),
    "lakeshore-475": (b"\r\n", 0.03, False, lambda meter: _family(meter, "475", 5)),
    "lakeshore-421": (b"\r\n", 0.05, False, _lakeshore_421),
    "lakeshore-f41": (b"\n", 0.0, True, _lakeshore_f41),
}
"""Reply terminator, rest it wants before a line (s), SCPI error queue, and commands of
each model, by dialect row."""


def row_teslameter(
    plant: DrivenCoil, row: TeslameterDialect, clock: Clock
) -> RowParser:
    """A simulated teslameter made from its row; it has neither range nor noise.

    Raises:
        SceneError: no answer can be made from one of its patterns.
    """
    per_tesla = 1 / row.scale

    def field() -> str:
        value = plant.field(clock.now()) * per_tesla
        return invented(row.number, f"{value:.7f}")

    answers: dict[str, Answer] = dict.fromkeys(row.report.values(), lambda: "1")
    if row.multiplier is not None:
        per_tesla /= MULTIPLIERS["m"]
        answers[row.multiplier] = lambda: "m"
    answers[row.field] = field
    return RowParser(row, answers)


def meter_far_end(
    plant: DrivenCoil,
    row: TeslameterDialect,
    clock: Clock,
    *,
    noise: float = 0.0,
    seed: int = 0,
) -> SimTeslameter | RowParser:
    """The simulated teslameter that speaks `row`, as `coil_far_end`.

    Args:
        plant: the physics at the probe.
        row: the dialect.
        clock: the bench's time.
        noise: standard deviation of a reading, T; not of one made from a row.
        seed: of the noise.
    """
    if row.id in MODELS:
        return SimTeslameter(plant, row.id, clock, noise=noise, seed=seed)
    return row_teslameter(plant, row, clock)
