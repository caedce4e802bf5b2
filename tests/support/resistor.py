"""A coil in which current flows at once, for tests of sources and meters alone."""

import math


class Resistor:
    """A plant without dynamics: 5 Ohm, 11 mT/A."""

    def __init__(self):
        self.amperes = 0.0
        self.on = False
        self.resistance = 5.0

    def set_current(self, time, amperes):
        self.amperes = amperes

    def output(self, time, on):
        self.on = on

    def coil_current(self, time):
        return self.amperes if self.on and math.isfinite(self.resistance) else 0.0

    def coil_voltage(self, time):
        return self.coil_current(time) * self.resistance

    def field(self, time):
        return 11e-3 * self.coil_current(time)
