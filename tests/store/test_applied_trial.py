"""When a force stood: what rates, falls and fits are counted within."""

import numpy as np
import pytest

from tactile_lab.lag import Lag
from tactile_lab.measurement import MeasuredTrial
from tactile_lab.store.applied_trial import stood
from tactile_lab.waveform import Waveform

ASKED = 0.25, 2.25


def late(by=0.046, level=0.18):
    """Force and current of a ramp up, a hold and a ramp down, set every 10 ms."""
    pulse = Waveform.pulse(level, ramp=0.25, hold=2.0)
    time = np.arange(0.0, pulse.end + 0.01, 0.01)
    current = Waveform.stairs(np.column_stack([time + by, pulse.at(time)]), 3.0)
    return Lag(coil=3e-3).follow(current)[0], current


@pytest.mark.parametrize("level", [0.18, -0.12])
def test_a_force_that_is_late_stands_late_and_stands_as_long(level):
    start, end = stood(ASKED, level, *late(level=level), 0.0, 2.8)
    assert start == pytest.approx(0.25 + 0.046, abs=0.011)
    assert end == pytest.approx(2.25 + 0.046, abs=0.011)


def test_it_begins_no_earlier_than_asked_and_ends_with_its_trial():
    exact = Waveform.pulse(0.18, ramp=0.25, hold=2.0)
    assert stood(ASKED, 0.18, exact, exact, 0.0, 2.5) == pytest.approx(ASKED, abs=3e-4)
    _, end = stood(ASKED, 0.18, *late(), 0.0, 2.27)
    assert end <= 2.27
    stays = Waveform(time=[0.0, 0.3, 9.0], value=[0.0, 0.18, 0.18])
    assert stood(ASKED, 0.18, stays, stays, 0.0, 2.5)[1] == 2.25


def test_no_step_of_the_current_lies_within_it():
    """The field read was that of a current which stood: none was left of a hold."""
    force, current = late()
    start, end = stood(ASKED, 0.18, force, current, 0.0, 2.8)
    moves = current.time[1:][np.diff(current.value) != 0]
    assert not np.any((moves > start) & (moves <= end))
    assert current.at(end) == 0.18


@pytest.mark.parametrize("level", [None, float("nan"), 0.0])
def test_a_trial_without_a_level_holds_as_asked(level):
    assert stood(ASKED, level, *late(), 0.0, 2.8) == ASKED
    assert stood(None, 0.18, *late(), 0.0, 2.8) is None


def test_it_counts_from_its_trial_wherever_that_lies_in_the_run():
    both = late()
    later = [Waveform(time=one.time + 7.0, value=one.value) for one in both]
    found = stood(ASKED, 0.18, *later, 7.0, 9.8)
    assert found == pytest.approx(stood(ASKED, 0.18, *both, 0.0, 2.8))


def test_rates_are_of_the_hold_as_applied():
    """As asked, the ramp's last interval was the peak, and the last one was lost."""
    held = stood(ASKED, 0.18, *late(), 0.0, 2.8)
    times = np.array([0.255, 0.285, 0.335, 0.4, 2.07, 2.17, 2.28])
    found = MeasuredTrial(
        label="", level=0.18, start=0.0, duration=2.8, spike_times=times, hold=held
    ).response
    assert found.peak_rate == pytest.approx(1 / 0.065)
    assert found.final_rate == pytest.approx(1 / 0.11)
    assert found.ramp_spikes == 2
