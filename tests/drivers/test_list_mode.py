"""Lists that the source plays by itself."""

import itertools
import math

import numpy as np
import pytest

from drivers.coil.source import CoilSource
from sim_backend.coil.list_mode import ListFault
from sim_backend.serial_line.faults import SerialFault
from tactile_lab.bench import CoilLimits
from tactile_lab.current_list import CurrentList
from tactile_lab.errors import (
    InterlockError,
    LimitError,
    LinkLostError,
    NoReplyError,
    RefusedError,
)
from tactile_lab.instruments.dialects import coil_dialect
from tactile_lab.waveform import Waveform

SINE = [round(0.3 * math.sin(2 * math.pi * k / 100), 6) for k in range(100)] + [0.0]


def listed(currents, dwell):
    """A list, and with one dwell for all points if only one is given."""
    dwells = np.broadcast_to(np.asarray(dwell, float), len(currents))
    return CurrentList(np.array(currents, float), dwells.copy())


def play(coil, currents, dwell):
    """Load and start a list; its length, s."""
    points = listed(currents, dwell)
    coil.load_list(points)
    coil.start_list()
    return points.duration


@pytest.fixture
def bench(serial_bench):
    serial_bench.coil.open()
    serial_bench.coil.energise()
    return serial_bench


def test_plays_in_its_own_time(bench):
    before = len(bench.sets)
    length = play(bench.coil, SINE, 0.01)
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


def test_every_point_has_its_own_dwell(bench):
    dwells = [0.0005, 2.5, 0.00051, 0.1]
    before = len(bench.sets)
    length = play(bench.coil, [0.001, 0.002, 0.001, 0.0], dwells)
    bench.clock.sleep_until(bench.clock.now() + length)
    played = bench.sets[before:]
    steps = [b.time - a.time for a, b in itertools.pairwise(played)]
    assert steps == pytest.approx(dwells[:-1], rel=1e-9)


def test_a_list_that_is_loaded_plays_again(bench):
    points = listed([0.002, 0.0], 0.5)
    bench.coil.load_list(points)
    for _ in range(2):
        bench.coil.start_list()
        bench.clock.sleep_until(bench.clock.now() + points.duration)
        bench.coil.end_list()
    assert [change.value for change in bench.sets].count(0.002) == 2


def test_safe_off_in_the_middle_ramps_from_what_flows(bench):
    play(bench.coil, SINE, 0.05)
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
    play(bench.coil, SINE, 0.01)
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
        ([0.2, 0.0], 0.01, "list_slew"),
        ([math.nan, 0.0], 0.1, "nan"),
        ([2.5, 0.0], 1.0, "exceeds the limit"),
        ([2.0] * 9 + [0.0], 1.0, "heat budget"),
        # hot in the middle, and cooler again at its end
        ([2.0] * 9 + [0.0] * 400, 1.0, "heat budget"),
    ],
)
def test_a_list_that_may_not_be_played(bench, currents, dwell, why):
    before = list(bench.source.changes)
    with pytest.raises(LimitError, match=why):
        play(bench.coil, currents, dwell)
    assert bench.source.changes == before
    assert bench.source.list.points == []


def test_a_list_that_is_loaded_does_not_start_while_the_coil_is_too_hot(bench):
    length = play(bench.coil, [2.0] * 5 + [0.0], 1.0)
    bench.clock.sleep_until(bench.clock.now() + length + 0.1)
    bench.coil.end_list()
    before = list(bench.source.changes)
    with pytest.raises(LimitError, match=r"With this list: .*heat budget"):
        bench.coil.start_list()
    assert bench.source.changes == before
    bench.clock.sleep_until(bench.clock.now() + 300)
    bench.coil.start_list()
    assert bench.source.list.playing


def test_a_list_made_for_the_slew_limit_is_not_refused_for_its_rounding(bench):
    row, limits = bench.coil.dialect, bench.coil.limits
    top = 0.0501 / limits.fastest
    wave = Waveform.through([(0, 0), (top, 0.0501), (2 * top, 0), (3 * top, 0)])
    points = row.lists().following(wave)
    assert points.steepest > limits.fastest * (1 + 1e-3)
    bench.coil.load_list(points)
    assert len(bench.source.list.points) == len(points)


@pytest.mark.parametrize("line", ["LIST:DWEL", "LIST:COUN", "LIST:CLE"])
def test_a_refused_line_starts_nothing(bench, line):
    bench.end.faults.add(SerialFault(kind="refused", line=line))
    with pytest.raises(RefusedError):
        play(bench.coil, SINE, 0.01)
    assert not bench.source.list.playing
    with pytest.raises(LimitError, match="No list is loaded"):
        bench.coil.start_list()


def test_a_memory_that_is_full_says_so(bench):
    bench.source.list.fault = ListFault(memory=50)
    with pytest.raises(RefusedError, match="Too much data"):
        play(bench.coil, SINE, 0.01)


@pytest.mark.parametrize("line", ["LIST:CURR ", "LIST:DWEL "])
@pytest.mark.parametrize("kind", ["deaf", "missing", "garbled"])
def test_no_point_is_lost_or_doubled_where_an_answer_is_lost(bench, kind, line):
    """Twice as many in a row as were survived by loading it all again."""
    dwells = np.linspace(0.02, 0.01, len(SINE))
    for skip in (0, 2, 3):
        bench.end.faults.add(SerialFault(kind=kind, line=line, skip=skip))
    play(bench.coil, SINE, dwells)
    assert bench.source.list.points == pytest.approx(SINE, abs=1e-5)
    assert bench.source.list.dwells == pytest.approx(dwells, abs=1e-5)
    bench.clock.sleep_until(bench.clock.now() + 2)
    bench.coil.end_list()
    bench.end.faults.add(SerialFault(kind="deaf", line=line, times=None))
    with pytest.raises(NoReplyError, match="thrice"):
        play(bench.coil, SINE[1:], dwells[1:])
    assert not bench.source.list.playing


@pytest.mark.parametrize(
    "fault", [ListFault(trigger_lost=True), ListFault(cut_after=0.15)]
)
def test_a_list_that_does_not_play_trips(bench, fault):
    bench.source.list.fault = fault
    play(bench.coil, [0.1] * 40 + [0.0], 0.05)
    with pytest.raises(InterlockError, match="did not start or was cut short"):
        for _ in range(8):
            bench.clock.sleep_until(bench.clock.now() + 0.25)
            bench.coil.read_current()
    assert not bench.source.output_on


def test_reading_back_a_fast_list_trips_nothing(bench):
    length = play(bench.coil, [i / 5 for i in SINE * 9], 0.001)
    until = bench.clock.now() + length
    while bench.clock.now() < until - 0.1:
        bench.coil.read_current()
    assert bench.coil.tripped is None


def test_a_source_without_lists(serial_bench):
    row = coil_dialect("kepco-bop").model_copy(update={"list": None})
    it = serial_bench
    coil = CoilSource(row, it.end.url, CoilLimits(), it.clock, baud=19200)
    coil.open()
    coil.energise()
    with pytest.raises(LimitError, match="no list mode"):
        play(coil, SINE, 0.01)
    coil.close()


@pytest.mark.parametrize("wrong", ["2.87500", "0.02875"])
def test_one_wrong_digit_as_a_list_is_ended_is_no_set_point(bench, wrong):
    """Ten times what flowed was set, beyond the limit of the coil."""
    play(bench.coil, SINE, 0.05)
    bench.clock.sleep_until(bench.clock.now() + 1.25)
    before, largest = len(bench.sets), abs(bench.plant.coil_current(0))
    once, heard = [wrong.encode()], bench.source.line
    bench.source.line = lambda line: (
        once.pop() if once and line == b"MEAS:CURR?" else heard(line)
    )
    assert bench.coil.safe_off().verified and not once
    assert max(abs(one.value) for one in bench.sets[before:]) < largest + 0.02
    assert bench.source.setpoint == 0.0
