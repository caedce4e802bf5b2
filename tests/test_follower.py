"""What a TL074 follower makes of a spike and of a reset."""

import numpy as np
import pytest

from tactile_lab.follower import Follower

TL074 = Follower(1 / (2 * np.pi * 3e6), 13e6)
DECAY = 1.5e-6


@pytest.mark.parametrize(
    ("amplitude", "peak"), [(1.0, 0.88), (2.0, 0.86), (5.0, 0.79), (10.0, 0.68)]
)
def test_the_peak_is_compressed_as_measured(amplitude: float, peak: float) -> None:
    pulse = TL074.spike(amplitude, DECAY)
    assert pulse is not None
    assert pulse.value.max() / amplitude == pytest.approx(peak, abs=0.01)


def test_the_pulse_is_1_24_to_1_40_us_wide() -> None:
    for amplitude in (1.0, 3.2, 10.0):
        pulse = TL074.spike(amplitude, DECAY)
        assert pulse is not None
        width = np.count_nonzero(pulse.value > pulse.value.max() / 2) * pulse.step
        assert 1.2e-6 < width < 1.45e-6


def test_a_small_pulse_is_the_exact_linear_answer() -> None:
    pole = TL074.pole
    pulse = TL074.spike(0.1, DECAY)
    assert pulse is not None
    time = np.arange(pulse.value.size) * pulse.step
    exact = 0.1 / (1 - pole / DECAY) * (np.exp(-time / DECAY) - np.exp(-time / pole))
    assert pulse.value == pytest.approx(exact, abs=1e-4 * 0.1)
    assert abs(pulse.value[-1]) < 1e-6


def test_a_reset_lags_by_slew_and_pole() -> None:
    pulse = TL074.edge(3.2)
    assert pulse is not None
    assert pulse.value[0] == pytest.approx(3.2)
    time = np.arange(pulse.value.size) * pulse.step
    assert np.interp(0.1e-6, time, pulse.value) == pytest.approx(3.2 - 1.3, abs=0.01)
    assert abs(pulse.value[-1]) < 1e-5
    assert np.all(np.diff(pulse.value) <= 1e-12)


def test_an_ideal_follower_changes_nothing() -> None:
    ideal = Follower(0.0, np.inf)
    pulse = ideal.spike(3.2, DECAY)
    assert pulse is not None and pulse.value[0] == 3.2
    assert ideal.edge(3.2) is None


def test_without_cathode_resistor_there_is_no_spike() -> None:
    assert TL074.spike(3.2, 0.0) is None


def test_a_slow_spike_passes_unchanged() -> None:
    pulse = TL074.spike(3.2, 1e-3)
    assert pulse is not None
    time = np.arange(pulse.value.size) * pulse.step
    late = time > 1e-5
    exact = 3.2 * np.exp(-time / 1e-3)
    assert pulse.value[late] == pytest.approx(exact[late], rel=2e-3, abs=1e-4)


def test_a_spike_shorter_than_the_follower_lasts_as_the_follower_lets_it() -> None:
    """C2 of 2 pF: it decays in 20 ns, and the output comes to 0.4 V at 13 V/us."""
    pulse, ideal = TL074.spike(3.213, 20e-9), Follower(0.0, np.inf).spike(3.213, 20e-9)
    assert pulse is not None and ideal is not None
    assert pulse.peak == pytest.approx(0.4, abs=0.01)
    assert pulse.width(0.5) == 0.0
    assert pulse.width(0.2) == pytest.approx(85e-9, abs=2e-9)
    assert ideal.peak == 3.213
    assert ideal.width(0.2) == pytest.approx(20e-9 * np.log(3.213 / 0.2), rel=2e-3)
