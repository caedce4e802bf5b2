from dataclasses import dataclass

import pytest
from resistor import Resistor

from drivers.coil.source import CoilSource
from sim_backend.coil.source import SimCoilSource
from sim_backend.serial_line.wires import FarEnd, plug_in, unplug
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import SimulatedClock
from tactile_lab.instruments.dialects import coil_dialect


@dataclass
class SerialBench:
    clock: SimulatedClock
    plant: Resistor
    source: SimCoilSource
    end: FarEnd
    coil: CoilSource

    def drive(self, current, updates=12):
        for _ in range(updates):
            self.clock.sleep_until(self.clock.now() + self.coil.update_interval)
            self.coil.set_current(current)

    @property
    def sets(self):
        return [change for change in self.source.changes if change.what == "set"]


@pytest.fixture
def resistor():
    return Resistor()


@pytest.fixture
def serial_bench(resistor):
    """A Kepco at 19200 baud on the simulated clock; this thread takes part."""
    row = coil_dialect("kepco-bop")
    clock = SimulatedClock()
    source = SimCoilSource(resistor, row.id, clock)
    wire = row.serial.model_copy(update={"baud": 19200})
    end = plug_in(source, wire, clock, "coil")
    coil = CoilSource(row, end.url, CoilLimits(), clock, baud=19200)
    with clock.taking_part("test"):
        yield SerialBench(clock, resistor, source, end, coil)
        coil.close()
    unplug(end)
