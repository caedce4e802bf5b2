"""No reading of a teslameter is lost, whenever it comes and whenever it is taken."""

import pytest
from short_runs import SHORT

from sim_backend.bench import open_bench
from sim_backend.serial_line.faults import SerialFault
from tactile_lab.acquisition.events import RunState
from tactile_lab.acquisition.meter_thread import MeterThread
from tactile_lab.bench import Reading
from tactile_lab.clock import SimulatedClock
from tactile_lab.planning.needs import needs


class SlowMeter:
    """Answers after a while with how often it was asked."""

    identity = "slow"

    def __init__(self, clock, latency):
        self.clock, self.latency, self.asked = clock, latency, 0

    def open(self):
        pass

    def close(self):
        pass

    def settings(self):
        return {}

    def read(self):
        self.asked += 1
        self.clock.sleep_until(self.clock.now() + self.latency)
        return Reading(self.clock.now(), float(self.asked))


@pytest.mark.parametrize("latency", [0.001, 0.02, 0.099, 0.3])
@pytest.mark.parametrize("every", [0.003, 0.02, 0.05, 0.25])
def test_every_reading_is_taken_whenever_it_comes(latency, every):
    clock = SimulatedClock()
    meter = SlowMeter(clock, latency)
    thread, taken = MeterThread("teslameter", meter, clock, 0.1), []
    with clock.taking_part("test"):
        thread.start()
        while clock.now() < 3.0:
            clock.sleep_until(clock.now() + every)
            taken += thread.take_readings()
        thread.leave()
        clock.wait_for(lambda: thread.ended, clock.now() + 1.0)
    taken += thread.take_readings()
    assert [reading.value for reading in taken] == list(range(1, meter.asked + 1))


def test_an_answer_that_is_of_nobody_knows_which_moment_is_not_kept():
    """A step of a field calibration had the field of the step before."""
    clock = SimulatedClock()
    meter = SlowMeter(clock, 0.02)
    thread = MeterThread("field meter", meter, clock, 0.1)
    with clock.taking_part("test"):
        thread.start()
        for meter.latency, until in ((0.02, 1.0), (0.9, 1.1), (0.02, 3.0)):
            clock.sleep_until(until)
        thread.leave()
        clock.wait_for(lambda: thread.ended, clock.now() + 1.0)
    seen = [round(one.value) for one in thread.take_readings()]
    (missing,) = set(range(1, meter.asked + 1)) - set(seen)
    assert 10 < missing < 13 and len(seen) > 15
    assert thread.doubt.startswith("field meter: 1 answer took over 140 ms")


def test_a_run_stores_every_reading_of_a_slow_meter(run_scene):
    asked = []

    def bench(scene):
        late = SerialFault(kind="late", line="RDGFIELD", times=None, amount=0.045)
        made = open_bench(scene, needs(scene), meter_faults=[late])
        read = made.field_meter.read

        def counted():
            asked.append(read())
            return asked[-1]

        made.field_meter.read = counted
        return made

    ran = run_scene(*SHORT, 'record.signals=["V_C1", "field"]', bench=bench)
    assert ran.done.state is RunState.COMPLETE, ran.done.reason
    with ran.stored() as run:
        stored = run.records("field")["field"].tolist()
    assert len(stored) > 10
    assert stored == [reading.value for reading in asked][-len(stored) :]
    assert len(asked) - len(stored) <= 1  # one before the record began
