"""What the coil makes of a waveform it cannot follow."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_lab.planning.current import limited
from tactile_lab.waveform import Waveform

amperes = st.floats(-2, 2, allow_nan=False)
gaps = st.floats(1e-6, 1.0, allow_nan=False)


@st.composite
def waves(draw):
    time, points = 0.0, [(0.0, draw(amperes))]
    for _ in range(draw(st.integers(1, 8))):
        if draw(st.booleans()):
            points.append((time, draw(amperes)))  # a jump
        time += draw(gaps)
        points.append((time, draw(amperes)))
    return Waveform.through(points)


@given(waves(), st.floats(0.5, 20), st.floats(0.005, 0.2), amperes)
def test_slew_is_never_exceeded_and_the_start_is_where_the_coil_is(
    wave, slew, interval, before
):
    played, warning = limited(wave, slew, interval, before)
    if warning is None:
        assert played == wave
        assert wave.value[0] == before
    assert played.value[0] == before
    # a step of 1e-12 s can round to a slope a little too large
    rise = np.abs(np.diff(played.value))
    assert np.all(rise <= slew * np.diff(played.time) * (1 + 1e-6) + 1e-9)
    assert played.value[-1] == pytest.approx(wave.value[-1], abs=1e-9)
    late = abs(played.at(wave.end) - wave.value[-1]) / slew
    assert wave.end <= played.end <= wave.end + late + interval
    assert played.peak <= max(wave.peak, abs(before)) + 1e-9


def test_a_slow_waveform_is_left_alone():
    wave = Waveform.pulse(1.0, ramp=0.25, hold=2, rest=2)
    assert limited(wave, 5.0, 0.045) == (wave, None)


def test_a_jump_becomes_a_ramp_at_the_slew_limit():
    wave = Waveform.through([(0, 0), (1, 0), (1, 1), (2, 1)])
    played, warning = limited(wave, 5.0, 0.01)
    assert "jump" in warning
    assert played.at([1.0, 1.1, 1.2, 2.0]) == pytest.approx([0, 0.5, 1, 1])


def test_a_first_value_is_reached_from_where_the_coil_is():
    wave = Waveform.through([(0, 1), (2, 1)])
    played, warning = limited(wave, 5.0, 0.01, before=0.0)
    assert warning
    assert played.at([0.0, 0.1, 0.2, 2.0]) == pytest.approx([0, 0.5, 1, 1])
    assert limited(wave, 5.0, 0.01, before=1.0) == (wave, None)


def test_a_steep_ramp_is_caught_up_with_during_the_hold():
    wave = Waveform.pulse(1.0, ramp=0.1, hold=1.0)
    played, _ = limited(wave, 5.0, 0.01)
    assert played.at([0.1, 0.2, 1.1, 1.2]) == pytest.approx([0.5, 1.0, 1.0, 0.5])


def test_a_triangle_faster_than_the_slew_stays_below_its_peak():
    wave = Waveform.through([(0, 0), (0.1, 1), (0.2, 0), (1, 0)])
    played, _ = limited(wave, 5.0, 0.01)
    assert played.peak == pytest.approx(2 / 3)


def test_detail_finer_than_the_update_grid_is_sampled_with_a_warning():
    time = np.arange(0, 1.0005, 0.001)
    wave = Waveform(time, 0.01 * np.sin(2 * np.pi * 60 * time))
    played, warning = limited(wave, 1e3, 0.045)
    assert "45 ms" in warning
    assert played.time.size < 40


def test_a_finely_written_slow_waveform_is_left_alone():
    time = np.linspace(0, 10, 5001)
    wave = Waveform(time, np.sin(2 * np.pi * 0.1 * time))
    assert limited(wave, 5.0, 0.045, before=0.0)[1] is None


def test_the_last_value_is_reached_after_a_waveform_that_ends_too_early():
    played, warning = limited(Waveform.constant(0.0), 5.0, 0.05, before=0.8)
    assert warning is not None
    assert played.at(0.0) == 0.8
    assert played.at(0.16) == pytest.approx(0.0)
    assert played.steepest <= 5.0 * (1 + 1e-9)
