"""What simulated Keithley SourceMeters have in common, whatever they source."""

from __future__ import annotations

from sim_backend.serial_line.scpi import Handler, ScpiError, numeric


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


class Sensing:
    """What a 2400 measures and how finely, which neither coil nor gate notices."""

    def __init__(self) -> None:
        self.functions: tuple[str, ...] = ("CURR",)
        self.cycles, self.range = 1.0, 2.1

    @property
    def commands(self) -> dict[str, Handler]:
        """Headers and what they do."""
        return {
            "SENSe:FUNCtion": self._choose,
            "SENSe:FUNCtion?": lambda _: ",".join(
                f'"{name}:DC"' for name in self.functions
            ),
            "SENSe:CURRent:NPLCycles": numeric(self._integrate, 0.01, 10),
            "SENSe:CURRent:NPLCycles?": lambda _: f"{self.cycles:.2f}",
            "SENSe:VOLTage:RANGe": numeric(self._widen, 0.0, 210.0),
            "SENSe:VOLTage:RANGe?": lambda _: f"{self.range:+.6E}",
        }

    def _choose(self, argument: str) -> None:
        names = argument.replace(" ", "").replace("'", "").split(",")
        if set(names) - {"VOLT", "CURR"}:
            raise ScpiError(-224, "Illegal parameter value")
        self.functions = tuple(sorted(names, reverse=True))

    def _integrate(self, cycles: float) -> None:
        self.cycles = cycles

    def _widen(self, volts: float) -> None:
        self.range = next(one for one in (0.21, 2.1, 21.0, 210.0) if volts <= one)


def identity(model: str) -> str:
    """Answer to ``*IDN?``."""
    return f"KEITHLEY INSTRUMENTS INC.,MODEL {model},1234567,C30   Mar 17 2006"
