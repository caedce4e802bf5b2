import numpy as np
import pytest

from tactile_lab.analysis.spike_train import (
    adaptation_index,
    intervals,
    respond,
    within,
)
from tactile_lab.errors import ParameterError

TRAIN = np.array([1.0, 1.1, 1.3, 1.7])


def test_intervals_are_differences():
    assert intervals(TRAIN) == pytest.approx([0.1, 0.2, 0.4])
    assert intervals([]).size == 0
    assert intervals([3.0]).size == 0


def test_adaptation_index_tells_slowing_from_regular():
    assert adaptation_index([0, 1, 2, 3]) == pytest.approx(0)
    assert adaptation_index(TRAIN) == pytest.approx(1 / 3)
    assert adaptation_index(-TRAIN[::-1]) == pytest.approx(-1 / 3)
    assert adaptation_index([0, 1]) is None


def test_response_describes_one_trial():
    found = respond([0.6, 0.7, 0.9, 1.3, 2.9], onset=0.5, hold=(0.65, 1.35))
    assert found.spikes == 5
    assert found.latency == pytest.approx(0.1)
    assert found.peak_rate == pytest.approx(5), "that of the ramp is not the hold's"
    assert found.ramp_spikes == 2
    assert found.final_rate == pytest.approx(2.5)
    assert found.fall == pytest.approx(0.5)
    assert found.intervals == 2
    assert found.silent is None


def test_a_hold_that_is_silent_has_no_rate_though_its_ramps_fire():
    found = respond([0.1, 0.15, 0.2, 1.3, 1.35], hold=(0.25, 1.25))
    assert found.spikes == found.ramp_spikes == 5
    assert found.peak_rate is None


def test_response_says_when_firing_stopped():
    assert respond([1.0, 1.2, 1.4], hold=(0.5, 1.9)).silent == pytest.approx(1.4)
    assert respond([1.0, 1.2, 1.4], hold=(0.5, 1.7)).silent is None


def test_one_interval_tells_a_rate_and_no_fall():
    found = respond([1.0, 1.5], hold=(0.0, 2.0))
    assert found.peak_rate == found.final_rate == pytest.approx(2.0)
    assert found.fall is None, "it stood as 0 %"


def test_without_a_hold_there_is_no_fall_in_it():
    assert respond([1.0, 1.2, 1.6, 2.4]).fall is None, 'it stood beside "no hold"'


@pytest.mark.parametrize("times", [[], [1.0]])
def test_too_few_spikes_give_none_not_an_error(times):
    found = respond(times, hold=(0.0, 2.0))
    assert found.spikes == len(times)
    assert found.peak_rate is found.final_rate is found.fall is None
    assert (found.latency is None) == (not times)


def test_a_spike_before_the_onset_is_no_latency():
    assert respond([0.1, 0.9], onset=0.5).latency == pytest.approx(0.4)


def test_hold_includes_its_ends():
    assert within([1.0, 2.0, 3.0], (1.0, 2.0)) == pytest.approx([1.0, 2.0])


@pytest.mark.parametrize("times", [[1.0, 1.0], [2.0, 1.0], [1.0, np.nan]])
def test_impossible_trains_are_refused(times):
    with pytest.raises(ParameterError, match="Spike times must"):
        intervals(times)
