"""Lists made from waveforms: near the wave, and within what a source can."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tactile_lab.current_list import CurrentList, ListCapability
from tactile_lab.errors import LimitError
from tactile_lab.waveform import Waveform

KEPCO = ListCapability(
    points=1002,
    shortest=0.5e-3,
    longest=10.0,
    resolution=1e-5,
    load_fixed=0.3,
    load_point=0.014,
)


@example([(1e-4, 1.0), (1e-4, 0.0)])
@given(
    st.lists(st.tuples(st.floats(1e-4, 8), st.floats(-2, 2)), min_size=1, max_size=30)
)
def test_it_is_playable_and_stays_within_a_step_of_the_wave(pieces):
    time = np.concatenate([[0.0], np.cumsum([length for length, _ in pieces]), [0]])
    time[-1] = time[-2] + 0.5
    wave = Waveform(time, np.array([0.0, *(value for _, value in pieces), 0.0]))
    points = KEPCO.following(wave)
    assert 1 < len(points) <= KEPCO.points
    assert points.dwells.min() >= KEPCO.shortest * (1 - 1e-9)
    assert points.dwells.max() <= KEPCO.longest
    assert points.currents[-1] == 0.0
    assert points.duration == pytest.approx(wave.end, abs=2 * KEPCO.shortest)
    # what flows in all is what was asked for: the force's mean is kept
    charge = float((points.currents * points.dwells).sum())
    asked = np.trapezoid(wave.value, wave.time)
    assert charge == pytest.approx(asked, abs=2e-5 * wave.end + 1e-9)
    start, end = points.starts[:-1], points.starts[1:]
    current = points.currents[:-1]
    ends = np.stack([wave.at(start), wave.at(end)])
    low, high = ends.min(axis=0), ends.max(axis=0)
    # a wave's extremes lie at its own corners: a peak may be shorter than a dwell
    within = (wave.time >= start[0]) & (wave.time < end[-1])
    corner, value = wave.time[within], wave.value[within]
    dwell = np.searchsorted(start, corner, side="right") - 1
    np.minimum.at(low, dwell, value)
    np.maximum.at(high, dwell, value)
    assert (low - 1e-5 <= current).all()
    assert (current <= high + 1e-5).all()


def test_a_pulse_is_met_to_half_a_percent_and_holds_cost_one_point():
    pulse = Waveform.pulse(1.0, ramp=0.25, hold=4.0, rest=1.0)
    points = KEPCO.following(pulse)
    assert len(points) < 410
    time = np.linspace(0, pulse.end, 20_001)
    assert np.abs(points.at(time) - pulse.at(time)).max() <= 0.0051


def test_what_does_not_fit_gets_coarser_points_and_what_never_fits_is_refused():
    phase = np.linspace(0, 1, 5001)
    wave = Waveform(10 * phase, np.sin(2 * np.pi * 20 * phase))
    points = KEPCO.following(wave)
    assert 900 < len(points) <= 1002
    with pytest.raises(LimitError, match="longer than"):
        KEPCO.following(Waveform.pulse(1.0, ramp=1, hold=6000))


def test_a_steep_list_says_how_steep():
    flat = CurrentList(np.array([0.1, 0.1, 0.0]), np.array([0.01, 0.01, 0.02]))
    # 0.1 A in the half dwell before and after each step
    assert flat.steepest == pytest.approx(10.0)
    assert flat.between(0.0, 0.005) == (0.1, 0.1)
    assert flat.between(-1.0, 0.005) == (0.0, 0.1)
    assert list(flat.at([-0.1, 0.0, 0.019, 0.02, 9.0])) == [0, 0.1, 0.1, 0, 0]
