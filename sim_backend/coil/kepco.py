"""A simulated Kepco BOP behind its BIT 4886 card, and a plain SCPI source like it."""

from __future__ import annotations

import re

from sim_backend.coil.panel import CoilPanel, SourceModel
from sim_backend.serial_line.scpi import (
    Handler,
    ScpiError,
    bare,
    boolean,
    number,
    numeric,
    one_of,
)


def _digits(line: bytes) -> bytes:
    """A Kepco keeps the last four digits before the point and eight after it."""
    return re.sub(
        rb"(\d+)(?:\.(\d*))?",
        lambda m: m[1][-4:] + (b"." + m[2][:8] if m[2] else b""),
        line,
    )


def _commands(source: CoilPanel) -> dict[str, Handler]:
    amperes, volts = source.rating

    def mode(choice: str) -> None:
        source.regulate_current(choice == "CURR")

    def remote(argument: str) -> None:
        source.remote = boolean(argument)
        source.local = source.local and not source.remote

    def remotely(act: Handler) -> Handler:
        """What is refused while the front panel has the source."""

        def run(argument: str) -> str | None:
            if source.local:
                raise ScpiError(-221, "Settings conflict")
            return act(argument)

        return run

    return {
        "*IDN?": lambda _: "KEPCO,BIT 4886 20-05,E123456,3.05-1.83",
        "*RST": bare(source.reset),
        "*OPC?": lambda _: "1",
        "SYSTem:REMote": remote,
        "SYSTem:REMote?": lambda _: str(int(source.remote)),
        "FUNCtion:MODE": one_of(mode, "CURRent", "VOLTage"),
        "FUNCtion:MODE?": lambda _: str(int(source.current_mode)),
        "[SOURce:]CURRent[:LEVel]": remotely(
            numeric(source.set_current, -amperes, amperes)
        ),
        "[SOURce:]CURRent[:LEVel]?": lambda _: f"{source.setpoint:.5f}",
        "[SOURce:]VOLTage[:LEVel]": numeric(source.set_compliance, 0.0, volts),
        "[SOURce:]VOLTage[:LEVel]?": lambda _: f"{source.compliance:.3f}",
        "OUTPut[:STATe]": remotely(lambda argument: source.switch(boolean(argument))),
        "OUTPut[:STATe]?": lambda _: str(int(source.output_on)),
        "MEASure[:SCALar]:CURRent?": lambda _: f"{source.measured_current():.5f}",
        "MEASure[:SCALar]:VOLTage?": lambda _: f"{source.measured_voltage():.4f}",
    }


def _list(source: CoilPanel) -> dict[str, Handler]:
    amperes, _ = source.rating

    def points(argument: str) -> None:
        for part in argument.split(","):
            source.list.append(number(part.strip(), -amperes, amperes))

    def repetitions(count: float) -> None:
        source.list.count = int(count)

    def dwells(argument: str) -> None:
        for part in argument.split(","):
            source.list.append_dwell(number(part.strip(), 0.0005, 10.0))

    def mode(choice: str) -> None:
        source.play_list(choice == "LIST")

    return {
        "LIST:CLEar": bare(source.list.clear),
        "LIST:CURRent": points,
        "LIST:CURRent:POINts?": lambda _: str(len(source.list.points)),
        "LIST:DWELl": dwells,
        "LIST:DWELl:POINts?": lambda _: str(len(source.list.dwells)),
        "LIST:COUNt": numeric(repetitions, 0, 255),
        "[SOURce:]CURRent:MODE": one_of(mode, "FIXed", "LIST"),
        "[SOURce:]CURRent:MODE?": lambda _: str(int(source.list.playing)),
    }


def _plain(source: CoilPanel) -> dict[str, Handler]:
    commands = _commands(source)
    commands["*IDN?"] = lambda _: "ACME,FOUR-QUADRANT SOURCE,1,1.0"
    for absent in ("SYSTem:REMote", "SYSTem:REMote?", "FUNCtion:MODE"):
        del commands[absent]
    return commands


KEPCO = SourceModel(
    rating=(5.0, 20.0),
    commands=lambda source: _commands(source) | _list(source),
    reply_end=b"\r\n",
    clearing=b"\x1b",
    max_line=127,
    max_queries=4,
    rewrite=_digits,
    analogue=(0.5, 2e3),
)

PLAIN = SourceModel(rating=(2.0, 20.0), commands=_plain)
