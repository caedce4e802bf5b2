"""A coil in which current flows at once, for tests of sources and meters alone."""

import math


class Resistor:
    """A plant without dynamics: 5 Ohm, 11 mT/A."""

    def __init__(self) -> None:
        self.amperes = 0.0
        self.on = False
        self.resistance = 5.0

    def set_current(self, time: float, amperes: float) -> None:
        self.amperes = amperes

    def output(self, time: float, on: bool) -> None:
        self.on = on

    def coil_current(self, time: float) -> float:
        return self.amperes if self.on and math.isfinite(self.resistance) else 0.0

    def coil_voltage(self, time: float) -> float:
        return self.coil_current(time) * self.resistance

    def field(self, time: float) -> float:
        return 11e-3 * self.coil_current(time)
