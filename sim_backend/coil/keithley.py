"""Simulated Keithley 2400 and 2420 SourceMeters."""

from __future__ import annotations

from collections.abc import Callable

from sim_backend.coil.panel import CoilPanel, SourceModel, bare, numeric, one_of
from sim_backend.serial_line.scpi import Handler, ScpiError, boolean


class _Ranges:
    """Source range and data elements, which differ from a plain source's."""

    def __init__(self, source: CoilPanel) -> None:
        self._source = source
        self.top = source.rating[0]
        self.elements: tuple[str, ...] = ("VOLT", "CURR", "RES", "TIME", "STAT")

    def set_range(self, current: float) -> None:
        self.top = min(1.05 * current, self._source.rating[0])

    def set_current(self, current: float) -> None:
        if not self._source.current_mode:
            raise ScpiError(-221, "Settings conflict")
        if abs(current) > self.top:
            raise ScpiError(-222, "Data out of range")
        self._source.set_current(current)

    def set_elements(self, argument: str) -> None:
        names = tuple(part.strip().upper()[:4] for part in argument.split(","))
        if not set(names) <= {"VOLT", "CURR", "RES", "TIME", "STAT"}:
            raise ScpiError(-224, "Illegal parameter value")
        self.elements = names

    def read(self, _: str) -> str:
        source = self._source
        if not source.output_on:
            raise ScpiError(803, "Not permitted with OUTPUT off")
        values = {
            "VOLT": source.measured_voltage(),
            "CURR": source.measured_current(),
            "RES": 9.91e37,
            "TIME": 0.0,
            "STAT": 0.0,
        }
        # the instrument answers in its own order, whatever was asked
        chosen = [values[name] for name in values if name in self.elements]
        return ",".join(f"{value:+.6E}" for value in chosen)


def _commands(source: CoilPanel, model: str) -> dict[str, Handler]:
    amperes, volts = source.rating
    ranges = _Ranges(source)
    source.regulate_current(False)

    def function(choice: str) -> None:
        source.regulate_current(choice == "CURR")

    def sense(argument: str) -> None:
        if set(argument.replace(" ", "").split(",")) - {"'VOLT'", "'CURR'"}:
            raise ScpiError(-224, "Illegal parameter value")

    modes = {"output": "NORM", "source": "FIX"}

    def keep(name: str) -> Callable[[str], None]:
        return lambda choice: modes.update({name: choice})

    def accept(_: str | float) -> None:
        """Settings that change nothing a coil could notice."""

    return {
        "*IDN?": lambda _: (
            f"KEITHLEY INSTRUMENTS INC.,MODEL {model},1234567,C30   Mar 17 2006"
        ),
        "*RST": bare(source.reset),
        "SYSTem:BEEPer:STATe": lambda argument: accept(str(boolean(argument))),
        "SYSTem:LOCal": bare(lambda: None),
        "SOURce:FUNCtion[:MODE]": one_of(function, "CURRent", "VOLTage"),
        "SOURce:FUNCtion[:MODE]?": lambda _: "CURR" if source.current_mode else "VOLT",
        "SOURce:CURRent:MODE": one_of(keep("source"), "FIXed", "LIST", "SWEep"),
        "SOURce:CURRent:MODE?": lambda _: modes["source"],
        "SOURce:CURRent:RANGe": numeric(ranges.set_range, 0.0, amperes),
        "SOURce:CURRent[:LEVel]": numeric(ranges.set_current, -amperes, amperes),
        "SOURce:CURRent[:LEVel]?": lambda _: f"{source.setpoint:+.6E}",
        "SENSe:FUNCtion": sense,
        "SENSe:CURRent:NPLCycles": numeric(accept, 0.01, 10),
        "SENSe:VOLTage:RANGe": numeric(accept, 0.0, volts),
        "SENSe:VOLTage:PROTection": numeric(source.set_compliance, 0.0, volts),
        "SENSe:VOLTage:PROTection?": lambda _: f"{source.compliance:+.6E}",
        "FORMat:ELEMents": ranges.set_elements,
        "FORMat:ELEMents?": lambda _: ",".join(ranges.elements),
        "OUTPut:SMODe": one_of(keep("output"), "NORMal", "ZERO", "HIMPedance", "GUARd"),
        "OUTPut:SMODe?": lambda _: modes["output"],
        "OUTPut[:STATe]": lambda argument: source.switch(boolean(argument)),
        "OUTPut[:STATe]?": lambda _: str(int(source.output_on)),
        "READ?": ranges.read,
    }


KEITHLEY_2400 = SourceModel(
    rating=(1.05, 21.0),
    commands=lambda source: _commands(source, "2400"),
    clearing=b"\x03\x18",
)

KEITHLEY_2420 = SourceModel(
    rating=(3.15, 20.0),
    commands=lambda source: _commands(source, "2420"),
    clearing=b"\x03\x18",
)
