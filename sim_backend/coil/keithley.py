"""Simulated Keithley 2400 and 2420 SourceMeters."""

from __future__ import annotations

from collections.abc import Callable

from sim_backend.coil.panel import CoilPanel, SourceModel
from sim_backend.serial_line.keithley import Elements, Sensing, identity
from sim_backend.serial_line.scpi import (
    Handler,
    ScpiError,
    bare,
    boolean,
    numeric,
    one_of,
)


def _commands(source: CoilPanel, model: str) -> dict[str, Handler]:
    amperes, volts = source.rating
    elements, top = Elements(), amperes
    source.regulate_current(False)

    def set_range(current: float) -> None:
        nonlocal top
        top = min(1.05 * current, amperes)

    def set_current(current: float) -> None:
        if not source.current_mode:
            raise ScpiError(-221, "Settings conflict")
        if abs(current) > top:
            raise ScpiError(-222, "Data out of range")
        source.set_current(current)

    def read(_: str) -> str:
        return elements.answer(
            source.output_on, source.measured_voltage(), source.measured_current()
        )

    def function(choice: str) -> None:
        source.regulate_current(choice == "CURR")

    modes = {"output": "NORM", "source": "FIX"}

    def keep(name: str) -> Callable[[str], None]:
        return lambda choice: modes.update({name: choice})

    def accept(_: str | float) -> None:
        """Settings that change nothing a coil could notice."""

    return {
        "*IDN?": lambda _: identity(model),
        "*RST": bare(source.reset),
        "SYSTem:BEEPer:STATe": lambda argument: accept(str(boolean(argument))),
        "SYSTem:LOCal": bare(lambda: None),
        "SOURce:FUNCtion[:MODE]": one_of(function, "CURRent", "VOLTage"),
        "SOURce:FUNCtion[:MODE]?": lambda _: "CURR" if source.current_mode else "VOLT",
        "SOURce:CURRent:MODE": one_of(keep("source"), "FIXed", "LIST", "SWEep"),
        "SOURce:CURRent:MODE?": lambda _: modes["source"],
        "SOURce:CURRent:RANGe": numeric(set_range, 0.0, amperes),
        "SOURce:CURRent:RANGe?": lambda _: f"{top / 1.05:+.6E}",
        "SOURce:CURRent[:LEVel]": numeric(set_current, -amperes, amperes),
        "SOURce:CURRent[:LEVel]?": lambda _: f"{source.setpoint:+.6E}",
        **Sensing().commands,
        "SENSe:VOLTage:PROTection": numeric(source.set_compliance, 0.0, volts),
        "SENSe:VOLTage:PROTection?": lambda _: f"{source.compliance:+.6E}",
        "FORMat:ELEMents": elements.choose,
        "FORMat:ELEMents?": lambda _: ",".join(elements.chosen),
        "OUTPut:SMODe": one_of(keep("output"), "NORMal", "ZERO", "HIMPedance", "GUARd"),
        "OUTPut:SMODe?": lambda _: modes["output"],
        "OUTPut[:STATe]": lambda argument: source.switch(boolean(argument)),
        "OUTPut[:STATe]?": lambda _: str(int(source.output_on)),
        "READ?": read,
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
