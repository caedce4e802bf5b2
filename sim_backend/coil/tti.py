"""A simulated Aim-TTi PL bench supply: one polarity, and not SCPI."""

from __future__ import annotations

from sim_backend.coil.panel import CoilPanel, SourceModel
from sim_backend.serial_line.scpi import Handler, bare, boolean, numeric


def _commands(source: CoilPanel) -> dict[str, Handler]:
    amperes, volts = source.rating

    def execution_error(_: str) -> str:
        number = abs(source.errors[-1][0]) if source.errors else 0
        source.errors.clear()
        return str(number)

    return {
        "*IDN?": lambda _: "THURLBY THANDAR, PL303, 012345, 1.02",
        "*RST": bare(source.reset),
        "I1": numeric(source.set_current, 0.0, amperes),
        "I1?": lambda _: f"I1 {source.setpoint:.3f}",
        "V1": numeric(source.set_compliance, 0.0, volts),
        "V1?": lambda _: f"V1 {source.compliance:.2f}",
        "OP1": lambda argument: source.switch(boolean(argument)),
        "OP1?": lambda _: str(int(source.output_on)),
        "I1O?": lambda _: f"{source.measured_current():.3f}A",
        "V1O?": lambda _: f"{source.measured_voltage():.2f}V",
        "EER?": execution_error,
        "LOCAL": bare(lambda: None),
    }


AIM_TTI = SourceModel(
    rating=(3.0, 30.0), commands=_commands, reply_end=b"\r\n", standard=False
)
