"""Two clocks, told apart by the coil's edges; never by more than the edges allow."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tactile_lab.acquisition.alignment import (
    Edge,
    align,
    find_edges,
    find_list,
)
from tactile_lab.acquisition.coil_thread import Applied, PlayedList
from tactile_lab.current_list import CurrentList
from tactile_lab.lag import Lag
from tactile_lab.scope import CLOCK_ERROR
from tactile_lab.trace import Trace


def edges(times, offset, drift, before, after):
    """True steps at host `times`; samples are late by offset + drift * t."""
    return [
        Edge(t + offset + drift * t, t - b, t + a)
        for t, b, a in zip(times, before, after, strict=True)
    ]


@example(offset=0.0, drift=-0.00039390902289107886, seed=335, length=20.0)
@given(
    offset=st.floats(-0.2, 0.2),
    drift=st.floats(-5e-4, 5e-4),
    seed=st.integers(0, 1000),
    length=st.floats(20, 2000),
)
def test_the_corrected_time_is_right_within_the_stated_uncertainty(
    offset, drift, seed, length
):
    rng = np.random.default_rng(seed)
    times = np.sort(np.r_[rng.uniform(0, 2, 30), rng.uniform(length - 2, length, 30)])
    before, after = rng.uniform(0, 0.02, (2, times.size))
    told = align(edges(times, offset, drift, before, after), 0.0, length, 0.5)
    for at in (times[0], times[-1]):
        sampled = at + offset + drift * at
        corrected = told.offset + sampled * (1 + told.drift)
        # the edges of one end are up to 2 s apart, in which clocks part by 1 ms
        assert abs(corrected - at) <= told.uncertainty + 2e-3


@given(
    drift=st.floats(-CLOCK_ERROR, CLOCK_ERROR),
    seed=st.integers(0, 1000),
    known=st.floats(1, 100),
)
def test_far_from_the_edges_that_tell_it_a_time_is_as_uncertain_as_clocks_are(
    drift, seed, known
):
    """With all edges at its begin, an hour was said to be known as they are."""
    rng = np.random.default_rng(seed)
    times = np.sort(rng.uniform(0, known, 30))
    before, after = rng.uniform(0, 0.02, (2, times.size))
    told = align(edges(times, 0.0, drift, before, after), 0.0, 3600.0, 0.02)
    for at in (0.0, 3600.0):
        corrected = told.offset + at * (1 + drift) * (1 + told.drift)
        assert abs(corrected - at) <= told.uncertainty + 1e-3
    assert told.uncertainty <= 0.02 + CLOCK_ERROR * 3600


def test_edges_that_contradict_each_other_are_not_believed():
    torn = [Edge(1.0, 0.99, 1.0), Edge(9.0, 9.2, 9.21), Edge(9.001, 9.0, 9.001)]
    told = align(torn, 0.0, 10.0, 0.003)
    assert (told.offset, told.drift) == (0.0, 0.0)
    assert told.uncertainty == pytest.approx(0.003 + CLOCK_ERROR * 10)


def test_many_edges_beat_one():
    rng = np.random.default_rng(3)
    times = np.linspace(1, 5, 30)
    before, after = rng.uniform(0.001, 0.02, (2, 30))
    every = edges(times, 0.1, 0.0, before, after)
    one, many = (align(e, 0.0, 6.0, 0.5) for e in (every[:1], every))
    assert many.uncertainty < 0.8 * one.uncertainty
    assert many.offset == pytest.approx(-0.1, abs=many.uncertainty)


def test_without_edges_host_time_stands_with_its_own_uncertainty():
    told = align([], 10.0, 110.0, 0.003)
    assert (told.offset, told.drift) == (0.0, 0.0)
    assert told.uncertainty == pytest.approx(0.003 + CLOCK_ERROR * 100)


def test_edges_worse_than_the_host_clock_change_nothing():
    told = align([Edge(1.0, 0.9, 1.2)], 0.0, 2.0, 1e-6)
    assert (told.offset, told.drift) == (0.0, 0.0)


def test_an_edge_is_found_where_the_shunt_shows_it():
    time = np.arange(2000) * 1e-3
    current = np.where(time < 0.5, 0.1, 0.4).astype(np.float32)
    bins = Trace.bins(time, current, current, current, 1e-3)
    applied = [
        Applied(3.3, 3.31, 0.1, None),
        Applied(3.488, 3.505, 0.4, None),
        Applied(3.7, 3.71, 0.41, None),  # too small a step to be seen
    ]
    (edge,) = find_edges(applied, 3.0, bins)
    assert edge.sampled == pytest.approx(0.5, abs=1e-3)
    assert edge.earliest == pytest.approx(0.488)
    assert edge.latest == pytest.approx(0.507)


def test_edges_are_found_however_far_the_clocks_have_parted():
    """At 50 ppm none was, after 400 s of one stream; here they part by 180 ms."""
    drift, steps = 9e-5, 100.0 * np.arange(1, 21)
    time = np.concatenate([s + np.arange(-1.0, 1.0, 1e-3) for s in steps])
    level = np.searchsorted(steps, time / (1 + drift)) % 2 * 0.3
    current = level.astype(np.float32)
    bins = Trace.bins(time, current, current, current, 1e-3)
    applied = [Applied(0.0, 0.01, 0.0, None)]
    for number, at in enumerate(steps, 1):
        applied.append(Applied(at - 0.03, at + 0.02, number % 2 * 0.3, None))
    found = find_edges(applied, 0.0, bins)
    shown = [edge.sampled for edge in found]
    assert shown == pytest.approx(steps * (1 + drift), abs=2e-3)


def test_a_drifting_sample_clock_stays_within_the_stored_uncertainty(run_scene):
    ran = run_scene(
        "simulated.clock_error=9e-5",
        'protocol.levels=["200 mN"]',
        "protocol.rest=1 s",
        'record.signals=["coil_current", "V_K", "spikes"]',
        "record.sample_rate=0.5 MS/s",
    )
    exact = run_scene(
        'protocol.levels=["200 mN"]',
        "protocol.rest=1 s",
        'record.signals=["coil_current", "V_K", "spikes"]',
        "record.sample_rate=0.5 MS/s",
    )
    with ran.stored() as run, exact.stored() as truth:
        segment = run.records("segments")[0]
        assert segment["uncertainty"] > 0
        late = run.spikes["time"][-1] - truth.spikes["time"][-1]
        assert abs(late) <= segment["uncertainty"]


def played_list(frequency, stretch=1.0):
    """A list, and the shunt's bins under it, 14 ms after the host spoke."""
    time = np.arange(0, 0.6, 1e-3)
    over = 0.3 * np.sin(2 * np.pi * frequency * time) * (time > 0.1)
    current = 0.5 * np.clip(time / 0.1, 0, 1) + over
    current[-1] = 0.0
    points = CurrentList(current, np.full(time.size, 1e-3))
    axis = np.arange(0, 4.0, 1e-3)  # two seconds of rest follow
    rng = np.random.default_rng(1)
    # in the middle of each dwell: at its edge, rounding would choose between two
    seen = points.at((axis - 1.0135) / stretch) + rng.normal(0, 0.01, axis.size)
    codes = np.round(seen / 16e-3) * 16e-3
    bins = Trace.bins(axis, codes, codes, codes, 1e-3)
    return PlayedList(points, 101.0, 101.03), bins


@pytest.mark.parametrize("frequency", [5, 20, 100, 150])
def test_a_list_is_found_as_a_whole_however_often_it_repeats_itself(frequency):
    played, bins = played_list(frequency)
    seen = find_list(played, 100.0, bins)
    assert seen.edge.sampled == pytest.approx(1.014, abs=1e-3)
    assert seen.edge.earliest == 1.0 and seen.edge.latest > 1.03
    assert seen.unlike < 0.02 and abs(seen.longer) < 1e-3


@pytest.mark.parametrize("frequency", [20, 100])
def test_a_list_begins_when_its_current_says_so_behind_l_over_r(frequency):
    """As if all of the current came late by L/R it was placed 0.1 to 0.5 ms off."""
    played, _ = played_list(frequency)
    flow, _ = Lag(coil=1.1e-3).follow(played.points.wave.shifted(1.0137))
    axis = np.arange(0, 4.0, 1e-3)
    codes = np.round(flow.mean(axis, 1e-3) / 16e-3) * 16e-3
    bins = Trace.bins(axis, codes, codes, codes, 1e-3)
    seen = find_list(played, 100.0, bins, 1.1e-3)
    assert seen.edge.sampled == pytest.approx(1.0137, abs=2e-5)


def test_a_long_vibration_is_not_taken_for_one_a_period_off():
    """Of 150 Hz for 5.4 s the place a period later or sooner looked more alike."""
    time = 2e-4 * np.arange(30_000)
    sine = 0.3 * np.sin(2 * np.pi * 150 * time) * ((time > 0.1) & (time < 5.5))
    current = 0.5 * np.clip(time / 0.1, 0, 1) + sine
    current[-1] = 0.0
    points = CurrentList(current, np.full(time.size, 2e-4))
    flow, _ = Lag(coil=1.1e-3).follow(points.wave)
    axis = np.arange(0, 10.0, 1e-3)
    for began in (1.0137, 1.0181):
        codes = np.round(flow.mean(axis - began, 1e-3) / 16e-3) * 16e-3
        bins = Trace.bins(axis, codes, codes, codes, 1e-3)
        seen = find_list(PlayedList(points, 101.0, 101.03), 100.0, bins, 1.1e-3)
        assert seen.edge.sampled == pytest.approx(began, abs=2e-5)


def test_dwells_that_the_source_rounded_are_seen_in_its_second_half():
    played, bins = played_list(20, stretch=1.015)
    seen = find_list(played, 100.0, bins)
    assert 3e-3 < seen.longer < 9e-3


def test_a_list_that_moves_too_little_tells_nothing():
    played, bins = played_list(20)
    still = PlayedList(
        CurrentList(played.points.currents / 30, played.points.dwells), 101.0, 101.03
    )
    assert find_list(still, 100.0, bins) is None
