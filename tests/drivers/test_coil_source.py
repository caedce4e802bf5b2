import itertools
import math
from contextlib import nullcontext

import pytest

from drivers.coil.source import CoilSource
from drivers.coil.wire import CATCH_UP
from drivers.registered import SERIAL_SOURCE
from sim_backend.coil.source import SimCoilSource
from sim_backend.serial_line.faults import SerialFault
from sim_backend.serial_line.wires import plug_in, unplug
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import SimulatedClock
from tactile_lab.errors import (
    InstrumentError,
    InterlockError,
    LimitError,
    NoReplyError,
    SceneError,
)
from tactile_lab.instruments.dialects import coil_dialect
from tactile_lab.scene.bench_file import CoilSpec
from tactile_lab.scene.load import load

KEPCO = coil_dialect("kepco-bop")


@pytest.fixture
def bench(serial_bench):
    it = serial_bench
    return it.clock, it.plant, it.source, it.coil


def steps(far):
    return [change for change in far.changes if change.what == "set"]


def play(clock, coil, currents):
    """Set one after the other, as fast as the source takes them."""
    for wanted in currents:
        clock.sleep_until(clock.now() + coil.update_interval)
        coil.set_current(wanted)


def test_plays_a_current_and_reads_it_back(bench):
    clock, _plant, far, coil = bench
    coil.open()
    assert coil.identity.startswith("KEPCO")
    coil.energise()
    play(clock, coil, [0.5] * 10)
    assert far.setpoint == pytest.approx(0.5)
    clock.sleep_until(clock.now() + coil.update_interval)
    assert coil.set_current(0.4999963) == far.setpoint == 0.5, "as the wire carries it"
    clock.sleep_until(clock.now() + 0.2)
    assert coil.read_current().value == pytest.approx(0.5)
    assert coil._wire.voltage() == pytest.approx(2.5)


def test_update_interval_is_wire_time_and_latency_with_margin(bench):
    *_, coil = bench
    coil.open()
    assert coil.update_interval == pytest.approx(
        KEPCO.promised_interval(19200), rel=0.1
    )
    assert 1 / coil.update_interval > 20


def test_a_closed_source_promises_what_its_row_does(resistor):
    """Opened before to be switched off, a fast one skipped 1691 set-points of 1 s."""
    clock = SimulatedClock()
    wire = KEPCO.serial.model_copy(update={"baud": 4_000_000, "latency": 1e-4})
    end = plug_in(SimCoilSource(resistor, KEPCO.id, clock), wire, clock, "fast")
    coil = CoilSource(KEPCO, end.url, CoilLimits(), clock, baud=wire.baud)
    promised = coil.update_interval
    with clock.taking_part("test"):
        coil.open()
        assert coil.update_interval < 0.1 * promised
        coil.close()
    assert coil.update_interval == promised


def test_never_on_before_limit_and_zero(bench):
    _clock, _plant, far, coil = bench
    coil.open()
    coil.energise()
    order = [change.what for change in far.changes]
    on = next(i for i, d in enumerate(far.changes) if d.what == "output" and d.value)
    assert "limit" in order[:on]
    assert far.compliance == 14.0
    assert [d.value for d in far.changes[:on] if d.what == "set"][-1] == 0.0


def test_steps_never_exceed_the_slew_limit(bench):
    clock, _plant, far, coil = bench
    coil.open()
    coil.energise()
    clock.sleep_until(clock.now() + 5)
    play(clock, coil, [1.5, 1.5, 1.5, -1.5] * 4)
    coil.safe_off()
    for before, after in itertools.pairwise(steps(far)):
        change = abs(after.value - before.value)
        # after a long hold, too, it is no jump
        passed = min(after.time - before.time, max(2 * coil.update_interval, CATCH_UP))
        assert change <= coil.limits.slew * passed + 3e-3


def test_a_step_whose_answer_was_lost_is_where_the_next_begins(serial_bench):
    clock, far, coil = serial_bench.clock, serial_bench.source, serial_bench.coil
    coil.open()
    coil.energise()
    play(clock, coil, [0.5] * 10)
    seen = len(far.changes)
    serial_bench.end.faults.add(SerialFault(kind="missing", times=12))
    with pytest.raises(InstrumentError):
        for _ in range(12):
            coil.set_current(1.5)
    taken = far.setpoint
    assert taken > 0.5, "it was heard"
    for _ in range(12):
        try:
            play(clock, coil, [-1.5])
            break
        except InstrumentError:
            continue
    most = coil.limits.slew * max(2 * coil.update_interval, CATCH_UP) + 3e-3
    values = [
        change.value for change in far.changes[seen - 1 :] if change.what == "set"
    ]
    assert values[-1] < taken
    assert all(abs(b - a) <= most for a, b in itertools.pairwise(values))


@pytest.mark.parametrize("leaves", [False, True])
def test_a_lost_answer_and_a_wrong_digit_do_not_set_what_nobody_asked_for(
    serial_bench, leaves
):
    """1.6 A were set on the way from 0.5 A to 0.6 A, and as much on the way out."""
    it = serial_bench
    it.coil.open()
    it.coil.energise()
    it.drive(0.5)
    it.end.faults.add(SerialFault(kind="missing", line="CURR 0", times=2))
    with pytest.raises(InstrumentError):
        it.drive(0.6)
    heard, wrong = it.source.line, [b"1.60000"]
    it.source.line = lambda line: (
        wrong.pop() if wrong and line in (b"CURR?", b"MEAS:CURR?") else heard(line)
    )
    if leaves:
        assert it.coil.safe_off().verified
    else:
        it.drive(0.6)
    assert not wrong
    assert max(change.value for change in it.sets) <= 0.601


@pytest.mark.parametrize("current", [2.1, -2.1, math.nan, math.inf])
def test_refuses_what_may_never_be_set(bench, current):
    *_, far, coil = bench
    coil.open()
    coil.energise()
    before = list(far.changes)
    with pytest.raises(LimitError):
        coil.set_current(current)
    assert far.changes == before


def test_refuses_to_set_with_the_output_off(bench):
    *_, coil = bench
    coil.open()
    with pytest.raises(LimitError, match="energise"):
        coil.set_current(0.1)


def test_a_source_that_a_person_took_to_its_front_panel_is_switched_off(serial_bench):
    serial_bench.coil.open()
    serial_bench.coil.energise()
    serial_bench.drive(0.3)
    serial_bench.source.local = True
    with pytest.raises(InstrumentError, match="-221"):
        serial_bench.drive(0.4)
    report = serial_bench.coil.safe_off()
    assert report.verified, report.text
    assert not serial_bench.source.output_on and not serial_bench.source.local


def test_safe_off_ramps_and_verifies_and_may_be_repeated(bench):
    clock, _plant, far, coil = bench
    coil.open()
    coil.energise()
    play(clock, coil, [1.0] * 20)
    begun, seen = clock.now(), len(far.changes)
    report = coil.safe_off()
    assert report.verified and report.current == 0.0
    assert not far.output_on and far.setpoint == 0.0
    assert clock.now() - begun < 0.6
    assert len(far.changes) - seen > 4
    assert coil.safe_off().verified


def test_a_hold_is_left_as_fast_as_the_slew_limit_allows(resistor):
    """From 1 A by 5 A/s, 0.2 s; 0.1 s more to answer and be read back off."""
    clock = SimulatedClock()
    source = SimCoilSource(resistor, KEPCO.id, clock)
    settings = {"baud": 4_000_000, "latency": 5e-3}
    end = plug_in(source, KEPCO.serial.model_copy(update=settings), clock, "coil")
    coil = CoilSource(KEPCO, end.url, CoilLimits(), clock, baud=4_000_000)
    with clock.taking_part("test"):
        coil.open()
        coil.energise()
        play(clock, coil, [1.0] * 20)
        clock.sleep_until(clock.now() + 1.0)
        begun, seen = clock.now(), len(source.changes)
        report = coil.safe_off()
        assert report.verified
        assert clock.now() - begun < 0.3
        changes = [one for one in source.changes[seen - 1 :] if one.what == "set"]
        for before, after in itertools.pairwise(changes):
            fall = before.value - after.value
            assert fall <= coil.limits.slew * (after.time - before.time) + 3e-3
        coil.close()
    unplug(end)


def test_heat_budget_trips_and_stays_latched(bench):
    clock, _plant, far, coil = bench
    coil.open()
    coil.energise()
    begun = clock.now()
    with pytest.raises(InterlockError, match="heat budget") as trip:
        play(clock, coil, [2.0] * 1000)
    assert "Output off" not in str(trip.value), "told by whoever ends the run"
    assert 8.2 < clock.now() - begun < 9.5
    assert not far.output_on
    with pytest.raises(InterlockError):
        coil.energise()
    clock.sleep_until(clock.now() + 60)
    coil.acknowledge()
    coil.energise()


def test_an_open_circuit_trips(bench):
    clock, plant, far, coil = bench
    coil.open()
    coil.energise()
    play(clock, coil, [0.5] * 10)
    plant.resistance = math.inf
    clock.sleep_until(clock.now() + 0.2)
    with pytest.raises(InterlockError, match="open"):
        for _ in range(5):
            coil.read_current()
    assert not far.output_on


def test_an_open_circuit_trips_where_the_set_point_never_rests_long(bench):
    """Of a hold of half a second one reading comes: a run of many saw no current."""
    clock, _plant, far, coil = bench
    coil.open()
    coil.energise()
    far.switch(False)
    with pytest.raises(InterlockError, match="0 A flows, 3 readings in a row"):
        for _ in range(3):
            play(clock, coil, [0.3] * 10)
            clock.sleep_until(clock.now() + 0.25)
            coil.read_current()
            play(clock, coil, [0.0] * 10)
            clock.sleep_until(clock.now() + 0.25)
            coil.read_current()
    assert not far.output_on and far.setpoint == 0.0


@pytest.mark.parametrize("on", [True, False])
def test_a_current_that_moves_all_the_time_is_judged_by_where_it_was(bench, on):
    """A vibration never rests for 0.1 s, and was played with the output off."""
    clock, _plant, far, coil = bench
    coil.open()
    coil.energise()
    play(clock, coil, [0.5] * 5)
    far.switch(on)
    with nullcontext() if on else pytest.raises(InterlockError, match="but 0 A flows"):
        for _ in range(4):
            play(clock, coil, [0.3, 0.35, 0.4, 0.35] * 5)
            coil.read_current()
    assert far.output_on is on


def test_an_answer_that_comes_twice_answers_no_other_question(bench):
    """2.5 V, answered twice, were stored as a coil current of 2.5 A."""
    clock, _plant, far, coil = bench
    coil.open()
    coil.energise()
    play(clock, coil, [0.5] * 10)
    act = far.line
    far.line = lambda line: act(line) and b"\n".join([act(line)] * 2)
    clock.sleep_until(clock.now() + 0.2)
    assert coil._wire.voltage() == pytest.approx(2.5)
    far.line = act
    clock.sleep_until(clock.now() + 0.2)
    assert coil.read_current().value == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("done", "why"),
    [
        (lambda far: far.reset(), "switched off, reset or set by hand"),
        (lambda far: far.set_current(0.55), "row: it was set by hand"),
    ],
)
def test_a_source_that_somebody_else_set_is_not_called_an_open_circuit(
    bench, done, why
):
    clock, _plant, far, coil = bench
    coil.open()
    coil.energise()
    play(clock, coil, [0.5] * 10)
    done(far)
    clock.sleep_until(clock.now() + 0.2)
    with pytest.raises(InterlockError, match=why):
        for _ in range(5):
            coil.read_current()
    assert not far.output_on


def test_output_on_at_connect_is_ramped_down(bench):
    _clock, _plant, far, coil = bench
    far.switch(True)
    far.set_current(1.0)
    coil.open()
    assert not far.output_on and far.setpoint == 0.0
    assert "already on" in coil.warnings[0]
    assert len(steps(far)) > 4


def test_a_character_lost_from_its_name_is_no_other_instrument(serial_bench):
    """The first line of a run's talk ended it, with exit code 4."""
    it = serial_bench
    heard, wrong = it.source.line, [b"EPCO,BIT 4886 20-05,E123456,3.05-1.83"]
    it.source.line = lambda line: (
        wrong.pop() if wrong and line == b"*IDN?" else heard(line)
    )
    it.coil.open()
    assert not wrong
    assert it.coil.identity == "KEPCO,BIT 4886 20-05,E123456,3.05-1.83"


def test_wrong_baud_is_no_reply(serial_bench):
    wrong = CoilSource(
        KEPCO, serial_bench.end.url, CoilLimits(), serial_bench.clock, baud=9600
    )
    with pytest.raises(NoReplyError, match="baud"):
        wrong.open()


def test_two_programs_on_one_port(serial_bench):
    serial_bench.coil.open()
    second = CoilSource(
        KEPCO, serial_bench.end.url, CoilLimits(), serial_bench.clock, baud=19200
    )
    with pytest.raises(InstrumentError, match="Another program"):
        second.open()


def at_half_an_ampere(it):
    """The bench, its coil's resistance looked at for the first two times."""
    it.coil.open()
    it.coil.energise()
    it.drive(0.5)
    for wait in (0.2, 1.1):
        it.clock.sleep_until(it.clock.now() + wait)
        it.coil.read_current()
    return it


def test_a_hot_coil_warns_then_trips(serial_bench):
    it = at_half_an_ampere(serial_bench)
    for resistance in (5.5, 5.8):
        it.plant.resistance = resistance
        it.clock.sleep_until(it.clock.now() + 1.1)
        it.coil.read_current()
    assert it.coil.resistance_ratio == pytest.approx(1.16)
    assert "41 K warmer" in it.coil.warnings[0]
    it.plant.resistance = 6.3
    it.clock.sleep_until(it.clock.now() + 1.1)
    with pytest.raises(InterlockError, match="cool"):
        it.coil.read_current()
    assert not it.source.output_on


@pytest.mark.parametrize(("resistance", "why"), [(11.0, "loose"), (3.0, "shorted")])
def test_a_jump_of_the_resistance_trips(serial_bench, resistance, why):
    it = at_half_an_ampere(serial_bench)
    it.plant.resistance = resistance
    it.clock.sleep_until(it.clock.now() + 1.1)
    with pytest.raises(InterlockError, match=why):
        it.coil.read_current()
    assert not it.source.output_on


@pytest.mark.parametrize("volts", [0.5, 0.249, 25.0])
def test_one_wrong_answer_is_no_shorted_coil(serial_bench, volts):
    """A night's runs ended by a digit: "turns are shorted"."""
    it = at_half_an_ampere(serial_bench)
    told = it.source.measured_voltage
    wrong = iter([volts])
    it.source.measured_voltage = lambda: next(wrong, told())
    it.clock.sleep_until(it.clock.now() + 1.1)
    it.coil.read_current()
    assert next(wrong, None) is None
    assert it.coil.resistance_ratio == pytest.approx(1.0)
    assert it.source.output_on


@pytest.mark.parametrize("volts", [0.5, 1.25, 25.0])
def test_a_wrong_first_answer_is_no_cold_coil(serial_bench, volts):
    """All later ones were a loose lead, or 24 % warmer came after 150 %."""
    it = serial_bench
    told = it.source.measured_voltage
    wrong = iter([volts])
    it.source.measured_voltage = lambda: next(wrong, told())
    at_half_an_ampere(it)
    assert next(wrong, None) is None
    it.clock.sleep_until(it.clock.now() + 1.1)
    it.coil.read_current()
    assert it.coil.resistance_ratio == pytest.approx(1.0)
    assert not it.coil.warnings
    it.plant.resistance *= 1.26
    it.clock.sleep_until(it.clock.now() + 1.1)
    with pytest.raises(InterlockError, match="cool"):
        it.coil.read_current()


def test_the_limits_in_force_are_the_narrowest():
    coil = CoilSource(
        KEPCO, "sim://x", CoilLimits(current=50.0, compliance=99.0), SimulatedClock()
    )
    assert (coil.limits.current, coil.limits.compliance) == (5.0, 20.0)


@pytest.mark.parametrize("on", [True, False])
def test_a_look_tells_what_a_person_did_and_touches_nothing(serial_bench, on):
    source, coil = serial_bench.source, serial_bench.coil
    source.set_current(0.3)
    source.switch(on)
    before = list(source.changes)
    seen = coil.look()
    assert (seen.on, seen.current) == (on, pytest.approx(0.3 if on else 0.0, abs=1e-4))
    assert seen.report.verified is not on
    coil.close()
    assert source.changes == before and not source.remote
    assert source.output_on is on


@pytest.mark.parametrize(("timeout", "opens"), [(None, False), (0.5, True)])
def test_a_slow_link_is_waited_for_as_the_bench_file_says(resistor, timeout, opens):
    clock = SimulatedClock()
    row = coil_dialect("kepco-bop")
    source = SimCoilSource(resistor, row.id, clock)
    end = plug_in(source, row.serial, clock, "coil")
    end.faults.add(SerialFault(kind="late", amount=0.3, times=None))
    coil = SERIAL_SOURCE.make(CoilSpec(port=end.url, timeout=timeout), clock)
    with clock.taking_part("test"):
        if opens:
            coil.open()
            assert coil.safe_off().verified
        else:
            with pytest.raises(InstrumentError):
                coil.open()
        coil.close()
    unplug(end)
    with pytest.raises(SceneError, match="at most"):
        load("demo", {"bench.coil.timeout": "1 s"})


@pytest.mark.parametrize("late", [0.41, 0.42, 0.43, 0.44])
def test_a_name_that_comes_late_is_no_answer_to_what_is_asked_next(serial_bench, late):
    """Asked its name twice, a slow source says it twice: a set-point was "refused"."""
    coil, end = serial_bench.coil, serial_bench.end
    coil.open()
    coil.energise()
    end.faults.add(SerialFault(kind="late", amount=late, line="CURR"))
    end.faults.add(SerialFault(kind="late", amount=0.24, line="IDN", times=2))
    serial_bench.drive(0.1)
    assert end.faults.struck >= 3
    assert coil.read_current().value == pytest.approx(0.1, abs=0.02)
    assert coil.safe_off().verified
