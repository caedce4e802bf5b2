"""The coil's thread beside the real driver on a simulated wire, on simulated time."""

import numpy as np
import pytest

from tactile_lab.acquisition.coil_thread import CoilThread
from tactile_lab.acquisition.stop import Lease, StopRequest
from tactile_lab.engine.bench import open_bench
from tactile_lab.planning.needs import needs
from tactile_lab.scene.load import load
from tactile_lab.waveform import Waveform

RAMP = Waveform(np.array([0.0, 0.25]), np.array([0.0, 0.4]))
BACK = Waveform(np.array([0.0, 0.25]), np.array([0.4, 0.0]))
LONGEST = 5.0


@pytest.fixture(scope="module")
def playing():
    """A coil that is live and plays what it is asked, and its clock."""
    scene = load("demo")
    bench = open_bench(scene, needs(scene))
    clock = bench.clock
    lease = Lease(clock)
    lease.end()
    thread = CoilThread(bench.coil, clock, StopRequest(clock), lease)
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
