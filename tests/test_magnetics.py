"""Force, field and current: Eq. (2), calibrations, and what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_lab.calibration import read_calibration
from tactile_lab.errors import LimitError, ParameterError, SceneError
from tactile_lab.magnetics import Magnet
from tactile_lab.waveform import Waveform

MAGNET = Magnet(r=6e-3)


def test_equation_2():
    expected = (
        0.163 * 2.827e-5 * 2.25e-3 * 0.011 / (4 * math.pi * 4e-7 * math.pi * 36e-6)
    )
    assert MAGNET.newtons_per_ampere == pytest.approx(expected, rel=1e-8)
    assert MAGNET.newtons_per_ampere == pytest.approx(0.2006, abs=1e-4)
    assert Magnet(r=6e-3, A2=2.25e-4).newtons_per_ampere == pytest.approx(
        0.02006, abs=1e-5
    )
    assert MAGNET.field(2.0) == pytest.approx(0.022)


@given(st.floats(-0.4, 0.4))
def test_force_and_current_are_inverse(level):
    wave = Waveform.pulse(level, ramp=0.1, hold=1.0)
    back = MAGNET.force_for(MAGNET.current_for(wave, 2.0))
    assert back.at(wave.time) == pytest.approx(wave.value, abs=1e-12)


def test_beyond_the_limit_the_reachable_force_is_named():
    wave = Waveform.pulse(0.5, ramp=0.1, hold=1.0)
    with pytest.raises(LimitError, match=r"500 mN .*−401\.2 mN to 401\.2 mN .*2 A"):
        MAGNET.current_for(wave, 2.0)
    assert MAGNET.current_for(wave).peak == pytest.approx(0.5 / 0.2006, rel=1e-3)


@pytest.mark.parametrize(
    "bad", [{"r": 0.0}, {"r": math.nan}, {"A2": -1.0}, {"B1": math.inf}]
)
def test_impossible_geometry(bad):
    with pytest.raises(ParameterError, match=next(iter(bad))):
        Magnet(**{"r": 6e-3, **bad})


@pytest.fixture
def calibrated(tmp_path):
    def make(text, **more):
        path = tmp_path / "cal.csv"
        path.write_text(text)
        return Magnet(r=6e-3, calibration=read_calibration(path), **more)

    return make


def test_a_bent_calibration_bends_the_current(calibrated):
    magnet = calibrated("current_A,force_N\n-1,-0.1\n0,0\n1,0.1\n2,0.15\n")
    wave = Waveform.through([(0, 0), (1, 0.15)])
    current = magnet.current_for(wave, 2.0)
    assert current.at([0.5, 2 / 3, 1.0]) == pytest.approx([0.75, 1.0, 2.0])
    assert magnet.force_for(current).at([0.3, 0.9]) == pytest.approx([0.045, 0.135])
    assert magnet.newtons_per_ampere == pytest.approx(0.1)


def test_drive_force_is_counted_from_zero_current(calibrated):
    magnet = calibrated("current_A,force_N\n-1,0.4\n0,0.5\n1,0.6\n")
    assert magnet.force([-1.0, 0.0, 1.0]) == pytest.approx([-0.1, 0.0, 0.1])


def test_a_falling_calibration_of_the_field(calibrated):
    magnet = calibrated("current_A,field_T\n-1,0.011\n0,0\n1,-0.011\n")
    wave = Waveform.through([(0, 0), (1, 0.1)])
    assert magnet.newtons_per_ampere == pytest.approx(-0.2006, abs=1e-4)
    assert magnet.current_for(wave, 1.0).at(1.0) == pytest.approx(
        -0.1 / 0.20062, rel=1e-4
    )
    assert magnet.field(0.5) == pytest.approx(-0.0055)


def test_outside_the_calibration_is_refused(calibrated):
    magnet = calibrated("current_A,force_N\n0,0\n1,0.1\n")
    with pytest.raises(LimitError, match="calibration"):
        magnet.current_for(Waveform.through([(0, 0), (1, -0.05)]), 2.0)
    with pytest.raises(LimitError, match=r"cal\.csv"):
        magnet.force(1.5)


def test_the_force_that_is_out_of_reach_is_the_one_named(calibrated):
    magnet = calibrated("current_A,force_N\n-0.1,-0.01\n0,0\n1,0.1\n")
    wave = Waveform.through([(0, 0), (1, 0.09), (2, -0.05)])
    with pytest.raises(LimitError, match="force −50 mN is beyond"):
        magnet.current_for(wave, 2.0)


def test_beyond_the_calibration_the_force_of_a_current_can_be_held(calibrated):
    magnet = calibrated("current_A,force_N\n-1,-0.1\n0,0\n1,0.1\n")
    swing = Waveform.through([(0, 0), (1, 2), (3, -2)])
    with pytest.raises(LimitError):
        magnet.force_for(swing)
    held = magnet.force_for(swing, beyond="hold")
    assert held.at([0.25, 0.5, 1, 2, 3]) == pytest.approx([0.05, 0.1, 0.1, 0, -0.1])


def test_what_is_known_of_a_force(calibrated):
    assert MAGNET.force_uncertainty is None
    measured = calibrated("current_A,field_T\n-1,-0.011\n1,0.011\n")
    assert measured.force_uncertainty is None
    stated = replace(
        measured.calibration,
        head={"uncertainty T (95 %)": "1e-4"},
        whole=True,
    )
    both = replace(measured, calibration=stated, geometry_uncertainty=0.05)
    absolute = math.sqrt(2) * 1e-4 * both.newtons_per_tesla
    assert both.force_uncertainty.of([0.0, 0.1]) == pytest.approx(
        [absolute, math.hypot(absolute, 5e-3)]
    )
    only = replace(MAGNET, geometry_uncertainty=0.05)
    assert only.force_uncertainty.of(0.1) == pytest.approx(5e-3)
    assert only.force_uncertainty.text == "±5 % (95 %)"
    # of r, A1, A2 and B1 nobody said that they are exact
    field_alone = replace(measured, calibration=stated)
    assert field_alone.force_uncertainty.unstated
    assert "mN (95 %; that of Eq. (2)'s geometry is not" in (
        field_alone.force_uncertainty.text
    )
    read = calibrated("current_A,force_N\n-1,-0.1\n1,0.1\n")
    head = replace(read.calibration, head={"uncertainty N (95 %)": "1e-3"}, whole=True)
    known = replace(read, calibration=head).force_uncertainty
    assert not known.unstated and known.text == "±1.4 mN (95 %)"


@given(st.lists(st.floats(-0.1, 0.15), min_size=1, max_size=6))
def test_kinks_keep_the_force(levels):
    from pathlib import Path

    from tactile_lab.calibration import Calibration

    curve = Calibration(
        np.array([-1.0, 0.0, 1.0, 2.0]), np.array([-0.1, 0, 0.1, 0.15]), "N", Path("c")
    )
    magnet = Magnet(r=6e-3, calibration=curve)
    wave = Waveform.through([(float(i), v) for i, v in enumerate(levels)])
    back = magnet.force_for(magnet.current_for(wave, 2.0))
    times = np.linspace(0, len(levels), 50)
    assert back.at(times) == pytest.approx(wave.at(times), abs=1e-9)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("current_A,field_T\n0,0\n", "two rows"),
        ("current_A,field_T\n1,0\n0,1\n", "line 3.*increase"),
        ("current_A,field_T\n-1,0\n0,1\n1,0.5\n", "line 4.*rise or fall"),
        ("current_A,field_T\n1,0\n2,1\n", "include 0 A"),
        ("I,B\n0,0\n1,1\n", "header"),
    ],
)
def test_bad_calibrations(tmp_path, text, told):
    path = tmp_path / "cal.csv"
    path.write_text(text)
    with pytest.raises(SceneError, match=f"(?s){told}"):
        read_calibration(path)
