"""What simulated Keithley SourceMeters have in common, whatever they source."""

from __future__ import annotations

from sim_backend.serial_line.scpi import ScpiError


class Elements:
    """Which of its values a 2400 answers with, in an order of its own."""

    NAMES = ("VOLT", "CURR", "RES", "TIME", "STAT")

    def __init__(self) -> None:
        self.chosen: tuple[str, ...] = self.NAMES

    def choose(self, argument: str) -> None:
        """``:FORMat:ELEMents``."""
        names = tuple(part.strip().upper()[:4] for part in argument.split(","))
        if not set(names) <= set(self.NAMES):
            raise ScpiError(-224, "Illegal parameter value")
        self.chosen = names

    def answer(self, on: bool, voltage: float, current: float) -> str:
        """Answer to ``:READ?``, V and A; refused with the output off."""
        if not on:
            raise ScpiError(803, "Not permitted with OUTPUT off")
        known = {"VOLT": voltage, "CURR": current, "RES": 9.91e37}
        told = (known.get(name, 0.0) for name in self.NAMES if name in self.chosen)
        return ",".join(f"{value:+.6E}" for value in told)


def both_functions(argument: str) -> None:
    """``:SENSe:FUNCtion`` for voltage and current."""
    if set(argument.replace(" ", "").split(",")) - {"'VOLT'", "'CURR'"}:
        raise ScpiError(-224, "Illegal parameter value")


def identity(model: str) -> str:
    """Answer to ``*IDN?``."""
    return f"KEITHLEY INSTRUMENTS INC.,MODEL {model},1234567,C30   Mar 17 2006"
