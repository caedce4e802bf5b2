"""One rule for the rate of a train: nothing is told across a silence."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.spikes.rate import begins, rate, rate_changes, rates_between
from tactile_lab.waveform import Waveform

TRAIN = np.array([1.0, 1.1, 1.3, 1.7])


def test_rate_is_right_continuous_and_zero_before_the_second_spike():
    at = [0.0, 1.0, 1.0999, 1.1, 1.2, 1.3, 1.5, 1.7, 2.8]
    assert rate(TRAIN, at) == pytest.approx([0, 0, 0, 10, 10, 5, 5, 2.5, 2.5])
    assert rate([], [1.0]) == pytest.approx([0.0])
    assert rate([1.0], [2.0]) == pytest.approx([0.0])


@given(st.lists(st.integers(1, 499), min_size=2, max_size=60))
def test_rate_just_after_each_spike_is_one_over_the_last_interval(steps):
    times = np.cumsum(steps) * 1e-3
    assert rate(times, times)[1:] == pytest.approx(1 / np.diff(times))


def test_no_interval_spans_a_silence_or_the_wait_between_two_steps():
    spikes = np.array([1.0, 1.1, 1.3, 4.0, 4.2])
    middles, rates = rates_between(spikes)
    assert middles == pytest.approx([1.05, 1.2, 4.1])
    assert rates == pytest.approx([10.0, 5.0, 5.0])
    slow = np.array([1.0, 2.0, 3.0])
    assert rates_between(slow)[1] == pytest.approx([1.0, 1.0])
    assert rates_between(slow, np.array([2.5]))[1] == pytest.approx([1.0])
    assert rates_between(np.empty(0))[0].size == 0


def test_no_rate_is_told_through_a_silence():
    two = np.concatenate([TRAIN, TRAIN + 30.0])
    assert rate(two, [2.89, 2.91, 20.0, 31.0, 31.05]) == pytest.approx(
        [2.5, 0, 0, 0, 0]
    )
    assert rate(two, [31.1]) == pytest.approx([10.0])
    slow = np.arange(0.0, 60, 5)
    assert rate(slow, [32.0]) == pytest.approx([0.2]), "slow but regular is no silence"


@given(
    st.lists(st.floats(1e-3, 9.0), max_size=40),
    st.lists(st.floats(0.0, 200.0), max_size=9),
)
def test_the_rate_holds_from_each_change_to_the_next(between, steps):
    spikes, steps = np.cumsum(between), np.sort(steps)
    time, value = rate_changes(spikes, steps)
    assert np.all(np.diff(time) >= 0)
    # both ends of a stretch are told: up at its second spike, down in its silence
    begun = begins(spikes, steps)
    stretches = np.split(spikes, np.flatnonzero(begun)[1:])
    firing = sum(s.size > 1 for s in stretches)
    assert np.count_nonzero(value == 0) == firing
    assert np.count_nonzero(value) == np.count_nonzero(~begun)
    assert value.size == 0 or value[-1] == 0


def test_the_model_tells_no_rate_once_it_is_silent():
    force = Waveform.pulse(0.15, ramp=0.25, hold=1.0, rest=5.0)
    found = simulate(Circuit(), force, keep=("rate", "spikes"))
    last = found.spike_times[-1]
    shown = found.sample("rate", np.array([last, last + 0.3, last + 3.0]))
    assert shown[0] == shown[1] > 1.0
    assert shown[2] == 0.0
