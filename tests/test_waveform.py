"""Waveforms: piecewise linear, explicit jumps, right-continuous."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_lab.errors import ParameterError
from tactile_lab.waveform import Waveform

values = st.floats(-1e3, 1e3, allow_nan=False)


@st.composite
def waveforms(draw, start=None):
    time, points = draw(st.floats(0, 5) if start is None else start), []
    for _ in range(draw(st.integers(1, 10))):
        points.append((time, draw(values)))
        if draw(st.booleans()):
            points.append((time, draw(values)))
        time += draw(st.floats(1e-3, 5))
    return Waveform.through(points)


@given(waveforms())
def test_points_are_met_and_jumps_take_the_later_value(wave):
    last = {float(t): float(v) for t, v in zip(wave.time, wave.value, strict=True)}
    times = np.array(list(last))
    assert np.array_equal(wave.at(times), np.array(list(last.values())))


@given(waveforms(), st.floats(-10, 100))
def test_values_stay_between_the_points(wave, time):
    slack = 1e-9 * (1 + wave.peak)
    assert wave.value.min() - slack <= wave.at(time) <= wave.value.max() + slack


@given(waveforms())
def test_held_before_and_after(wave):
    assert wave.at(wave.start - 1) == wave.value[0]
    assert wave.at(wave.end + 1) == wave.value[-1]
    assert wave.at(-np.inf) == wave.value[0]


def middles(wave):
    return ((wave.time[1:] + wave.time[:-1]) / 2)[np.diff(wave.time) > 0]


@given(waveforms(), waveforms(start=st.just(0.0)))
def test_one_after_the_other(first, second):
    both = first.then(second)
    assert both.end == pytest.approx(first.end + second.end)
    middle = middles(first)
    assert both.at(middle) == pytest.approx(first.at(middle), abs=1e-9)
    middle = middles(second)
    assert both.at(first.end + middle) == pytest.approx(second.at(middle), abs=1e-6)
    assert both.at(first.end) == second.at(0.0), "the later value holds at a jump"


@given(waveforms(), st.floats(-5, 5))
def test_shift_and_scale(wave, by):
    assert wave.shifted(1.0).at(wave.time + 1.0) == pytest.approx(wave.at(wave.time))
    assert wave.scaled(by).at(wave.time) == pytest.approx(by * wave.at(wave.time))


def test_what_was_before_leaves_a_jump_from_the_first_value():
    wave = Waveform.pulse(2.0, ramp=1.0, hold=1.0)
    late = wave.shifted(-0.5).since(0.0)
    assert late == Waveform(
        np.array([0.0, 0.0, 0.5, 1.5, 2.5]), np.array([0.0, 1.0, 2.0, 2.0, 0.0])
    )
    assert wave.shifted(0.5).since(0.0) == wave.shifted(0.5)


@given(waveforms())
def test_segments_cover_the_whole_and_equal_waveforms_hash_alike(wave):
    pieces = list(wave.segments())
    assert sum(end - start for start, end, _, _ in pieces) == pytest.approx(
        wave.end - wave.start
    )
    same = Waveform(wave.time.copy(), wave.value.copy())
    assert same == wave
    assert hash(same) == hash(wave)


def test_between_points_it_is_linear():
    wave = Waveform.through([(0, 0), (2, 1)])
    assert wave.at([[0.5], [1.0]]) == pytest.approx(np.array([[0.25], [0.5]]))


def test_pulse():
    wave = Waveform.pulse(0.1, ramp=0.25, hold=2.0, rest=1.0)
    assert wave.at([0, 0.125, 0.25, 2.25, 2.375, 2.5, 3.5]) == pytest.approx(
        [0, 0.05, 0.1, 0.1, 0.05, 0, 0]
    )
    assert (wave.end, wave.peak, wave.steepest) == (3.5, 0.1, pytest.approx(0.4))


def test_a_pulse_without_ramps_jumps():
    wave = Waveform.pulse(0.1, ramp=0.0, hold=1.0, rest=1.0)
    assert wave.at([0, 0.5, 1.0]) == pytest.approx([0.1, 0.1, 0.0])
    assert wave.steepest == np.inf
    assert wave.value[0] == 0.0


def test_a_first_value_is_no_jump():
    assert Waveform.through([(0, 1), (1, 1)]).steepest == 0.0


@pytest.mark.parametrize(
    ("time", "value", "told"),
    [
        ([], [], "at least one"),
        ([0, 1], [0], "as many"),
        ([0, np.nan], [0, 0], "time number 2"),
        ([0, 1], [0, np.inf], "value number 2"),
        ([1, 0], [0, 0], "must not decrease"),
        ([0, 0, 0], [0, 1, 2], "three points"),
    ],
)
def test_impossible_waveforms_are_refused(time, value, told):
    with pytest.raises(ParameterError, match=told):
        Waveform(np.array(time, dtype=float), np.array(value, dtype=float))


def test_a_waveform_cannot_be_changed_and_keeps_its_own_numbers():
    time = np.array([0.0, 1.0])
    wave = Waveform(time, np.array([0.0, 1.0]))
    time[1] = 5.0
    assert wave.end == 1.0
    with pytest.raises(ValueError, match="read-only"):
        wave.value[0] = 3.0


def test_when_a_late_staircase_leaves_and_arrives():
    late = Waveform.through(
        [(0, 0), (0.07, 0), (0.07, 0.05), (0.12, 0.05), (0.12, 0.1), (5, 0.1), (5, 0)]
    )
    assert late.departure(0.0, 4.0) == pytest.approx(0.07)
    assert late.arrival(2.5, 0.0) == pytest.approx(0.12)
    assert late.departure(1.0, 4.0) is None, "it never leaves"
    slow = Waveform.through([(0, 0), (1, 0), (2, 0.001), (3, 1)])
    assert (slow.departure(0, 3), slow.departure(0, 3, near=0)) == (2.0, 1.0)
    assert Waveform.pulse(1.0, ramp=0.0, hold=2.0).departure(0.0, 3.0) == 0.0
    assert slow.departure(2.5, 3.0) == 2.5, "it is on its way"
    assert late.arrival(2.5, 1.0) == 1.0, "it was there"
