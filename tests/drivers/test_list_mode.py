"""Lists that the source plays by itself."""

import itertools
import math

import pytest

from drivers.coil.source import CoilSource
from sim_backend.serial_line.faults import SerialFault
from tactile_lab.bench import CoilLimits
from tactile_lab.errors import LimitError, LinkLostError, RefusedError
from tactile_lab.instruments.dialects import coil_dialect

SINE = [round(0.3 * math.sin(2 * math.pi * k / 100), 6) for k in range(100)] + [0.0]


@pytest.fixture
def bench(serial_bench):
    serial_bench.coil.open()
    serial_bench.coil.energise()
    return serial_bench


def test_plays_in_its_own_time(bench):
    before = len(bench.sets)
    length = bench.coil.play_list(SINE, 0.01)
    assert length == pytest.approx(1.01)
    start = bench.clock.now()
    bench.clock.sleep_until(start + 0.255)
    assert bench.coil.read_current().value == pytest.approx(0.3, abs=0.03)
    bench.clock.sleep_until(start + length + 0.1)
    played = bench.sets[before:]
    assert [change.value for change in played] == pytest.approx(SINE, abs=1e-5)
    steps = [b.time - a.time for a, b in itertools.pairwise(played)]
    assert steps == pytest.approx([0.01] * 100)
    bench.coil.end_list()
    bench.drive(0.1)
    assert bench.source.setpoint == pytest.approx(0.1)


def test_safe_off_in_the_middle_ramps_from_what_flows(bench):
    bench.coil.play_list(SINE, 0.05)
    bench.clock.sleep_until(bench.clock.now() + 1.25)
    assert bench.plant.coil_current(0) > 0.25
    before = len(bench.sets)
    assert bench.coil.safe_off().verified
    ramp = bench.sets[before:]
    # the list's own steps, what flowed taken over, then down at the slew limit
    assert ramp[-2].value > 0.25 and ramp[-1].value == 0.0
    for earlier, later in itertools.pairwise(ramp):
        slew = (earlier.value - later.value) / (later.time - earlier.time)
        assert slew <= bench.coil.limits.slew
    bench.clock.sleep_until(bench.clock.now() + 5)
    assert bench.plant.coil_current(0) == 0.0 and not bench.source.list.playing


def test_unplugged_during_a_list_it_still_ends_at_zero(bench):
    bench.coil.play_list(SINE, 0.01)
    bench.end.faults.add(SerialFault(kind="unplug"))
    with pytest.raises(LinkLostError):
        bench.coil.read_current()
    assert not bench.coil.safe_off().verified
    bench.clock.sleep_until(bench.clock.now() + 2)
    assert bench.plant.coil_current(0) == 0.0


@pytest.mark.parametrize(
    ("currents", "dwell", "why"),
    [
        ([0.1], 0.1, "must end at 0 A"),
        ([0.1, 0.0], 1e-4, "dwell"),
        ([0.1, 0.0], 11.0, "dwell"),
        ([], 0.1, "0 points"),
        ([0.0] * 1003, 0.1, "1003 points"),
        ([0.2, 0.0], 0.01, "slew"),
        ([math.nan, 0.0], 0.1, "nan"),
        ([2.5, 0.0], 1.0, "exceeds the limit"),
        ([2.0] * 9 + [0.0], 1.0, "heat budget"),
    ],
)
def test_a_list_that_may_not_be_played(bench, currents, dwell, why):
    before = list(bench.source.changes)
    with pytest.raises(LimitError, match=why):
        bench.coil.play_list(currents, dwell)
    assert bench.source.changes == before
    assert bench.source.list.points == []


def test_a_refused_line_starts_nothing(bench):
    bench.end.faults.add(SerialFault(kind="refused", line="LIST:DWEL"))
    with pytest.raises(RefusedError):
        bench.coil.play_list(SINE, 0.01)
    assert not bench.source.list.playing


def test_a_source_without_lists(serial_bench):
    row = coil_dialect("kepco-bop").model_copy(update={"list": None})
    it = serial_bench
    coil = CoilSource(row, it.end.url, CoilLimits(), it.clock, baud=19200)
    coil.open()
    coil.energise()
    with pytest.raises(LimitError, match="no list mode"):
        coil.play_list(SINE, 0.01)
    coil.close()
