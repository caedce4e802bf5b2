from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from peak_memory import peak, tells_peak

from tactile_lab.analysis.belief import PART
from tactile_lab.analysis.evidence import Residuals
from tactile_lab.analysis.spike_pairs import match
from tactile_lab.analysis.twin import Measured, twin
from tactile_lab.deviation import DrivenCircuit
from tactile_lab.errors import ParameterError
from tactile_lab.long_waveform import LongWaveform
from tactile_lab.model import slices
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.waveform import Waveform

FORCE = Waveform.pulse(0.15, ramp=0.25, hold=3.0, rest=1.0)


def measured(circuit, signal="V_C1", noise=0.0, bins=500):
    found = simulate(circuit, FORCE, keep=("V_C1", "V_C2", "spikes"))
    time = (np.arange(bins) + 0.5) * FORCE.end / bins
    rng = np.random.default_rng(1)
    value = found.sample(signal, time) + rng.normal(0, noise, bins)
    return Measured(signal, time, value), found.spike_times


LONG = np.linspace(0, 30, 150_000)
SWINGING = Waveform(LONG, 0.1 + 0.05 * np.sin(2 * np.pi * LONG))
BINS = (np.arange(4000) + 0.5) * SWINGING.end / 4000
SEEN = Measured("V_C1", BINS, np.full(BINS.size, 3.0), width=SWINGING.end / 4000)
SPIKES = np.arange(1.0, SWINGING.end, 0.05)


def beside():
    found = twin(Circuit(), SWINGING, 30.0, voltages=[SEEN], spike_times=SPIKES)
    return np.concatenate([found.error, found.residuals[0].predicted])


def residuals():
    problem = Residuals(Circuit(), (), SWINGING, 30.0, SEEN, SPIKES)
    driven = DrivenCircuit(Circuit(), SWINGING)
    return np.append(problem.under(driven), problem.late(driven))


@tells_peak
@pytest.mark.parametrize("compared", [beside, residuals])
def test_a_long_force_is_compared_in_the_memory_of_a_slice(compared, monkeypatch):
    """Ten minutes of `repeat` are 380,000 points, of which all took 470 MB at once."""
    _, warm = peak(compared)
    sliced, found = peak(compared)
    monkeypatch.setattr(slices, "POINTS", SWINGING.time.size)
    whole, at_once = peak(compared)
    assert np.array_equal(found, at_once)
    assert np.array_equal(found, warm)
    assert sliced < 0.4 * whole


def test_a_force_in_pieces_is_compared_as_the_whole():
    pieces = LongWaveform(lambda: SWINGING.pieces(40_000))
    made = [
        twin(Circuit(), one, 31.0, voltages=[SEEN], spike_times=SPIKES)
        for one in (SWINGING, pieces)
    ]
    one, other = (each.residuals[0].predicted for each in made)
    assert np.array_equal(one, other)
    assert np.array_equal(made[0].spikes.offsets, made[1].spikes.offsets)


@pytest.mark.parametrize(("frequency", "width"), [(60, 0.025), (100, 0.0919)])
def test_the_mean_of_a_bin_is_compared_with_the_model_s_mean(frequency, width):
    """A vibration swings several times within a bin of a long run."""
    time = np.arange(0, 2, 5e-4)
    force = Waveform(time, 0.1 + 0.04 * np.sin(2 * np.pi * frequency * time))
    found = simulate(Circuit(), force, keep=("V_C1",))
    middles = np.arange(0.5, 1.9, width)
    fine = middles[:, None] + (np.arange(2000) - 999.5) / 2000 * width
    mean = found.sample("V_C1", fine.ravel()).reshape(fine.shape).mean(axis=1)
    seen = Measured("V_C1", middles, mean, width=width)
    beside = twin(Circuit(), force, force.end, voltages=[seen]).residual("V_C1")
    assert beside.rms < 2e-5
    at_once = twin(
        Circuit(), force, force.end, voltages=[replace(seen, width=0.0)]
    ).residual("V_C1")
    assert at_once.rms > 10 * beside.rms


def test_the_twin_of_the_true_circuit_leaves_the_noise():
    trace, spikes = measured(Circuit(), noise=3e-3)
    found = twin(Circuit(), FORCE, FORCE.end, voltages=[trace], spike_times=spikes)
    node_a = found.residual("V_C1")
    assert node_a.rms == pytest.approx(3e-3, rel=0.15)
    assert abs(node_a.offset) < 1e-3
    assert found.spikes.offsets == pytest.approx(0.0, abs=1e-6)
    assert found.spikes.missed == found.spikes.extra == 0


def test_the_twin_of_another_circuit_shows_what_differs():
    trace, spikes = measured(Circuit())
    other = replace(Circuit(), V_GS=1.41)
    found = twin(other, FORCE, FORCE.end, voltages=[trace], spike_times=spikes)
    assert found.residual("V_C1").offset > 5e-3
    assert np.median(found.spikes.rate_error) < -0.02
    assert "spikes matched" in found.spikes.sentence


def test_resets_do_not_spoil_the_residual_of_v_c2():
    trace, spikes = measured(Circuit(), "V_C2")
    found = twin(Circuit(), FORCE, FORCE.end, voltages=[trace], spike_times=spikes)
    residual = found.residual("V_C2")
    assert residual.band < 1e-6
    assert np.isnan(residual.difference).sum() >= spikes.size


def test_spikes_during_a_pause_are_not_missed():
    _, spikes = measured(Circuit())
    seen = spikes[(spikes < 1.0) | (spikes >= 2.0)]
    found = twin(
        Circuit(), FORCE, FORCE.end, spike_times=seen, pauses=[(1.0, 2.0)]
    ).spikes
    assert found.missed == 0
    assert found.extra == 0


def test_the_firing_stage_is_left_out_where_nothing_needs_it():
    trace, _ = measured(Circuit())
    found = twin(Circuit(), FORCE, FORCE.end, voltages=[trace])
    assert found.spikes is None
    assert found.error.spike_time is None


def test_a_twin_needs_something_to_compare():
    with pytest.raises(ParameterError, match="measured voltage or spikes"):
        twin(Circuit(), FORCE, FORCE.end)


def test_the_tolerance_is_what_another_force_within_its_band_would_do():
    trace, _ = measured(Circuit())
    stronger = FORCE.scaled(1.003)
    found = simulate(Circuit(), stronger, keep=("V_C1", "spikes"))
    there = Measured("V_C1", trace.time, found.sample("V_C1", trace.time), 1e-4)
    beside = twin(
        Circuit(), FORCE, FORCE.end, voltages=[there], spike_times=found.spike_times,
        displaced=[
            ("force", DrivenCircuit(Circuit(), FORCE.scaled(1 + 0.004 * PART))),
            ("clocks", DrivenCircuit(Circuit(), FORCE.shifted(1e-4 * PART))),
        ],
    )  # fmt: skip
    node_a = beside.residual("V_C1")
    assert node_a.tolerance.min() >= 1e-4
    assert node_a.within > 0.99
    held = (node_a.time > 0.5) & (node_a.time < 3.0)
    away = np.abs(node_a.difference[held])
    assert np.all(node_a.tolerance[held] < 1.6 * away + 5e-4)
    assert beside.spikes.within > 0.9
    assert np.nanmedian(beside.spikes.rate_tolerance) == pytest.approx(
        np.median(np.abs(beside.spikes.rate_error)) * 4 / 3, rel=0.2
    )
    alone = twin(Circuit(), FORCE, FORCE.end, spike_times=found.spike_times)
    assert alone.spikes.within < 0.2, "without the force's band nothing is left open"


TRAIN = st.lists(st.integers(100, 5000), min_size=2, max_size=40).map(
    lambda steps: np.cumsum(steps) * 1e-4
)


@given(TRAIN)
def test_a_train_matches_itself(times):
    found = match(times, times)
    assert found.measured.size == times.size
    assert found.rate_error == pytest.approx(0.0, abs=1e-9)


@given(TRAIN, st.floats(-0.4, 0.4))
def test_a_small_shift_is_found_as_an_offset(times, part):
    shift = part * np.diff(times).min()
    found = match(times + shift, times)
    assert found.missed == found.extra == 0
    assert found.offsets == pytest.approx(shift, abs=1e-12)


def test_a_train_that_runs_faster_is_followed_beyond_an_interval():
    theirs = np.cumsum(np.linspace(0.05, 0.2, 40))
    ours = theirs * 0.97 - 0.01
    found = match(ours, theirs)
    assert found.missed == found.extra == 0
    assert found.offsets == pytest.approx(ours - theirs)
    assert found.offsets.min() < -0.1
    assert found.rate_error == pytest.approx(1 / 0.97 - 1)


def test_after_a_silence_the_offset_begins_anew():
    theirs = np.cumsum([0.1] * 20)
    both = np.concatenate([theirs, theirs + 30])
    found = match(np.concatenate([theirs * 0.96, theirs * 0.96 + 30]), both)
    assert found.missed == found.extra == 0


def test_what_noise_makes_of_intervals_adds_up_over_a_burst():
    rng, burst = np.random.default_rng(1), 0.1 * np.arange(1, 21)
    predicted = np.concatenate([burst, burst + 5, burst + 10])
    late = [np.cumsum(rng.normal(0, 1e-3, burst.size)) for _ in range(400)]
    told = [
        match(predicted + np.concatenate(late[i : i + 3]), predicted).scatter
        for i in range(0, 399, 3)
    ]
    # of half of the spikes, the first ten of each burst, 95 % lie within
    lies = np.abs(np.array(late))[:, [9, 10]]
    assert np.median(told) == pytest.approx(np.percentile(lies, 95), rel=0.1)


def test_single_spikes_of_presses_far_apart_tell_no_noise():
    """A sensor that warms fires ever later: that is a drift, not noise."""
    predicted = 0.4 + 45.0 * np.arange(8)
    late = np.array([0.06, 0.09, 0.05, 0.1, 0.07, 0.11, 0.08, 0.09])
    assert np.isnan(match(predicted + late, predicted).scatter)


@given(TRAIN, st.data())
def test_a_lost_spike_is_missed_and_a_false_one_is_extra(times, data):
    lost = data.draw(st.integers(0, times.size - 1))
    rest = np.delete(times, lost)
    assert match(rest, times).missed == 1
    assert match(times, rest).extra == 1
    assert match(rest, times).measured == pytest.approx(rest)


def test_an_error_of_the_rate_that_tells_nothing_is_no_power_of_ten():
    times = np.arange(1.0, 9.0)
    said = match(times * (1 + 1e-9), times).sentence
    assert "rate error below 0.001 % (median)" in said
    assert "rate error −0.1 %" in match(times * 1.001, times).sentence


def test_nothing_matches_nothing():
    assert match([], [1.0]).missed == 1
    assert match([1.0], []).extra == 1
    assert match([], []).offsets.size == 0
