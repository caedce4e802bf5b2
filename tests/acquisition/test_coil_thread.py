"""The coil's thread beside the real driver on a simulated wire, on simulated time."""

import re
import threading
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from sim_backend.serial_line import wires
from sim_backend.serial_line.faults import SerialFault
from tactile_lab.acquisition.coil_thread import CoilThread
from tactile_lab.acquisition.stop import Lease, StopRequest
from tactile_lab.current_list import CurrentList
from tactile_lab.drive import Drive
from tactile_lab.engine.bench import open_bench
from tactile_lab.planning.needs import needs
from tactile_lab.scene.load import load
from tactile_lab.waveform import Waveform

RAMP = Waveform(np.array([0.0, 0.25]), np.array([0.0, 0.4]))
BACK = Waveform(np.array([0.0, 0.25]), np.array([0.4, 0.0]))
LONGEST = 5.0


def coil_thread(dialect: str = "kepco-bop") -> CoilThread:
    """The thread of a simulated source; nobody holds a lease."""
    scene = load("demo", {"bench.coil.dialect": dialect})
    bench = open_bench(scene, needs(scene))
    lease = Lease(bench.clock)
    lease.end()
    return CoilThread(bench.coil, bench.clock, StopRequest(bench.clock), lease)


@pytest.fixture(scope="module")
def playing():
    """A coil that is live and plays what it is asked, and its clock."""
    thread = coil_thread()
    clock = thread.clock
    with clock.taking_part("test"):
        thread.start()
        thread.energise()
        clock.wait_for(lambda: thread.live, clock.now() + LONGEST)
        yield thread, clock
        thread.leave()
        clock.wait_for(lambda: thread.ended, clock.now() + LONGEST)
    assert thread.off is not None and thread.off.verified


def played(thread, clock, ramp: Waveform) -> tuple[float, list]:
    """When a ramp was asked for, and the set-points it gave."""
    thread.take_applied()
    begin, skipped = clock.now(), thread.skipped
    thread.play(ramp.shifted(begin), begin + 0.25)
    clock.wait_for(lambda: False, begin + 0.4)
    assert thread.skipped == skipped
    return begin, [a for a in thread.take_applied() if a.asked >= begin]


def test_a_program_that_stood_still_in_a_hold_ends_with_the_coil_off(monkeypatch):
    """A suspended one went on with the next press: the lease was renewed first."""
    thread = coil_thread()
    clock, due = thread.clock, []
    wait_for = clock.wait_for

    def stands_still(condition, until):
        if due and threading.current_thread() is not test:
            clock.sleep_until(clock.now() + due.pop())
        return wait_for(condition, until)

    test = threading.current_thread()
    monkeypatch.setattr(clock, "wait_for", stands_still)
    with clock.taking_part("test"):
        thread.start()
        thread.energise()
        clock.wait_for(lambda: thread.live, clock.now() + LONGEST)
        thread.play(RAMP.shifted(clock.now()), clock.now() + 60.0)
        clock.wait_for(lambda: False, clock.now() + 0.5)
        due.append(4.0)
        clock.wait_for(lambda: thread.ended, clock.now() + 2 * LONGEST)
    assert "stood still for 4" in str(thread.failure)
    assert "400 mA" in str(thread.failure)
    assert thread.off is not None and thread.off.verified


def test_the_source_was_read_back_at_0_A_before_the_first_ramp(playing) -> None:
    thread, _ = playing
    assert thread.last is not None and thread.last.setpoint == 0.0
    assert abs(thread.measured) < 5e-3


@pytest.mark.parametrize("rest", [0.0, 0.013, 0.05, 0.099, 0.24, 0.26, 0.7])
def test_a_ramp_loses_no_set_point_whenever_it_begins(playing, rest) -> None:
    thread, clock = playing
    clock.wait_for(lambda: False, clock.now() + rest)
    interval = thread.coil.update_interval
    for ramp in (RAMP, BACK):
        begin, applied = played(thread, clock, ramp)
        moving = [a for a in applied if a.setpoint not in (0.0, 0.4)]
        assert moving[0].asked - begin <= 1.1 * interval
        assert len(moving) >= int(0.25 / interval) - 1
        # a set-point is the ramp's value at the time it is sent
        sent = np.array([(a.asked - begin, a.setpoint) for a in moving])
        assert np.allclose(sent[:, 1], ramp.at(sent[:, 0]), atol=2e-3)


def test_a_read_back_does_not_delay_a_ramp_that_comes(playing) -> None:
    thread, clock = playing
    interval = thread.coil.update_interval
    for wait in np.linspace(0.25, 0.25 + 2 * interval, 7):
        thread.take_applied()
        begin = clock.now()
        rest = Waveform(np.array([0.0, wait, wait + 0.25]), np.array([0.0, 0.0, 0.4]))
        thread.play(rest.shifted(begin), begin + wait + 0.25)
        clock.wait_for(lambda: False, clock.now() + wait + 0.5)
        moving = [a for a in thread.take_applied() if a.setpoint > 0]
        assert moving[0].asked - (begin + wait) <= 1.1 * interval
        played(thread, clock, BACK)


@pytest.mark.parametrize(("held_up", "is_late"), [(0.03, False), (0.2, True)])
def test_on_a_fast_link_nothing_is_late_that_the_plan_counts_on(
    playing, monkeypatch, held_up: float, is_late: bool
) -> None:
    """By the hundred they were called too late, and a faster link was asked for."""
    thread, clock = playing
    coil = thread.coil
    set_current, slow = coil.set_current, [held_up]

    def held(current: float) -> float:
        if slow:
            clock.sleep_until(clock.now() + slow.pop())
        return set_current(current)

    monkeypatch.setattr(coil, "_interval", 4e-4)
    monkeypatch.setattr(coil, "set_current", held)
    before = thread.skipped
    thread.play(RAMP.shifted(clock.now()), clock.now() + 0.25)
    clock.wait_for(lambda: False, clock.now() + 0.6)
    assert thread.skipped - before <= 5  # by its own intervals it were hundreds
    assert (thread.skipped > before) is thread.source_late is is_late
    monkeypatch.undo()
    played(thread, clock, BACK)


@pytest.mark.parametrize("dialect", ["kepco-bop", "keithley-2420", "aim-tti-pl"])
def test_a_step_is_dated_when_the_source_took_it(
    dialect: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Half-way between question and answer the model's spikes came 8 ms too early."""
    thread = coil_thread(dialect)
    far = [far for name, far in wires._far_ends.items() if "coil" in name][-1]
    act, clock, took = far.instrument.line, thread.clock, {}

    def acted(line: bytes) -> bytes | None:
        answer = act(line)
        took.setdefault(far.instrument.setpoint, clock.now())
        return answer

    monkeypatch.setattr(far.instrument, "line", acted)
    with clock.taking_part("test"):
        thread.start()
        thread.energise()
        clock.wait_for(lambda: thread.live, clock.now() + LONGEST)
        _, applied = played(thread, clock, RAMP)
        thread.leave()
        clock.wait_for(lambda: thread.ended, clock.now() + LONGEST)
    steps = [a for a in applied if 0 < a.setpoint < 0.4]
    nearest = [min(took, key=lambda sent: abs(sent - a.setpoint)) for a in steps]
    off = [a.acted - took[one] for a, one in zip(steps, nearest, strict=True)]
    latency = thread.coil.dialect.serial.latency
    assert len(steps) > 1
    assert all(a.asked <= a.acted <= a.time for a in steps)
    # where the error is asked for in a line of its own, that takes a latency, too
    most = 2e-3 if thread.coil.dialect.join else latency + 2e-3
    assert np.max(np.abs(off)) < most


@pytest.mark.parametrize("spoilt", ["", "late", "missing", "garbled"])
def test_an_output_that_is_on_is_never_told_to_be_off(
    spoilt: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Asked whenever the source has acted on a line, so that nothing lies between."""
    thread = coil_thread()
    far = [far for name, far in wires._far_ends.items() if "coil" in name][-1]
    act, seen = far.instrument.line, []

    def acted(line: bytes) -> bytes | None:
        answer = act(line)
        told = thread.state
        on = far.instrument.output_on
        if spoilt and on and not any(was for was, *_ in seen):
            far.faults.add(SerialFault(kind=spoilt, times=3, amount=0.3))
        seen.append((on, told.live, told.off))
        return answer

    monkeypatch.setattr(far.instrument, "line", acted)
    with thread.clock.taking_part("test"):
        thread.start()
        thread.energise()
        settled = thread.clock.now() + LONGEST
        thread.clock.wait_for(lambda: thread.live or thread.ended, settled)
        thread.leave()
        thread.clock.wait_for(lambda: thread.ended, thread.clock.now() + 60.0)
    assert [told for on, *told in seen if on and told != [True, None]] == []
    assert sum(on for on, *_ in seen) >= 2, "it was on, and asked"
    assert thread.state.off is not None and not thread.state.live


SHORT = Drive(
    Waveform(np.array([0.0, 0.3]), np.zeros(2)),
    CurrentList(np.r_[np.linspace(0.0, 0.2, 40), np.zeros(1)], np.full(41, 0.01)),
)


def drives(thread: CoilThread, way: str) -> None:
    """Switch the coil on and have it move by set-points or a list, unless it ends."""
    clock = thread.clock

    def until(done: Callable[[], bool]) -> None:
        clock.wait_for(lambda: thread.ended or done(), clock.now() + LONGEST)

    thread.energise()
    until(lambda: thread.live)
    if way == "list":
        thread.load_list(SHORT)
        until(lambda: thread.loaded is SHORT.points)
        thread.play_list()
        until(lambda: thread.list is not None and not thread.plays_list)
    else:
        thread.play(RAMP.shifted(clock.now()), clock.now() + 0.25)
        until(lambda: thread.last is not None and thread.last.setpoint == 0.4)


def leads_off(line: str, flowing: float) -> bool:
    """Whether a line only asks, goes towards 0 A from what flows, or switches off."""
    said = line.removesuffix(";:SYST:ERR?")
    if said.endswith("?") or said in ("OUTP 0", "CURR:MODE FIX", "SYST:REM 0"):
        return True
    number = re.fullmatch(r"CURR ([\d.]+)", said)
    return number is not None and float(number[1]) <= flowing + 5e-3


Line = tuple[str, float]
"""What the source heard, and what flowed then, A."""


def heard_with_stop_at(count: int, way: str, lost: int | None) -> list[Line] | None:
    """Lines from the one on at which STOP came; None where there were not so many."""
    thread = coil_thread()
    clock = thread.clock
    far = [far for name, far in wires._far_ends.items() if "coil" in name][-1]
    act, lines = far.instrument.line, []

    def acted(line: bytes) -> bytes | None:
        if thread.opened:
            lines.append((line.decode(), far.instrument.measured_current()))
            if lost is not None and len(lines) == count - lost:
                far.faults.add(SerialFault(kind="missing"))
            if len(lines) == count:
                thread._stop("STOP")
        return act(line)

    far.instrument.line = acted
    with clock.taking_part("test"):
        thread.start()
        clock.wait_for(lambda: thread.opened, clock.now() + LONGEST)
        drives(thread, way)
        halted = thread._stop.requested
        thread.leave()
        clock.wait_for(lambda: thread.ended, clock.now() + 60.0)
    assert thread.off is not None and thread.off.verified
    assert not far.instrument.output_on
    return lines[count - 1 :] if halted else None


@pytest.mark.parametrize(
    ("way", "lost"),
    [("set-points", None), ("set-points", 0), ("set-points", 1), ("list", None)],
)
def test_once_a_stop_is_accepted_only_what_leads_to_off_is_sent(
    way: str, lost: int | None
) -> None:
    """STOP comes as the source hears a line, be it any of them.

    It is answered; or its answer is lost, or that of the line before, so that STOP
    comes as the link gets into step again. The output was switched on, a list loaded
    to its end, and a step sent that had waited for the lost answer.
    """
    at, wrong = [], []
    while heard := heard_with_stop_at(len(at) + 1, way, lost):
        at.append(heard[0][0])
        for (_, before), (line, now) in pairwise(heard):
            if not leads_off(line, max(before, now)):  # it says what it just measured
                wrong.append((at[-1], line, now))
    assert wrong == []
    assert len(at) >= 16  # a ramp's set-points among them, or a list's lines
