"""Noise with lines of known size: what is told of them holds."""

import numpy as np
import pytest

from tactile_lab.analysis.noise import noise
from tactile_lab.errors import NotIdentifiableError

RATE = 20_000.0


def made(seconds: float, white: float, **lines: float) -> np.ndarray:
    """White noise of so many V rms, and sines such as f50=0.01 V rms."""
    rng = np.random.default_rng(7)
    time = np.arange(round(seconds * RATE)) / RATE
    values = white * rng.standard_normal(time.size) + 3.0
    for name, rms in lines.items():
        values += np.sqrt(2) * rms * np.sin(2 * np.pi * float(name[1:]) * time + 1)
    return values


def test_the_density_of_white_noise_is_flat_and_its_integral_the_variance() -> None:
    found = noise(made(8, 1e-3), 1 / RATE)
    expected = 1e-3 / np.sqrt(RATE / 2)
    assert np.median(found.density) == pytest.approx(expected, rel=0.05)
    power = np.sum(found.density**2) * found.resolution
    assert np.sqrt(power) == pytest.approx(found.rms, rel=0.01)
    assert found.rms == pytest.approx(1e-3, rel=0.01)
    assert found.segments == 15
    assert found.lines == ()
    frequency, density = found.thinned(100)
    assert frequency.size <= 100 and np.all(np.diff(frequency) > 0)
    assert np.median(density) == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize("off", [0.0, 0.05, -0.3])
def test_hum_and_its_harmonics_have_their_size(off: float) -> None:
    values = made(6, 1e-3, **{f"f{50 + off}": 5e-3, f"f{150 + 3 * off}": 1e-3})
    lines = {one.frequency: one for one in noise(values, 1 / RATE).lines}
    assert set(lines) == {50.0, 150.0}
    assert lines[50.0].rms == pytest.approx(5e-3, rel=0.02)
    assert lines[150.0].rms == pytest.approx(1e-3, rel=0.05)


def test_a_multiple_of_both_mains_counts_to_the_one_that_hums() -> None:
    found = noise(made(6, 1e-4, f60=1e-2, f300=1e-3), 1 / RATE)
    assert {(one.mains, one.frequency) for one in found.lines} == {
        (60.0, 60.0),
        (60.0, 300.0),
    }


def test_noise_alone_seldom_shows_a_line() -> None:
    rng = np.random.default_rng(11)
    told = sum(len(noise(rng.standard_normal(8000), 1 / 2000).lines) for _ in range(40))
    assert told <= 12, "of 800 looked for"


@pytest.mark.parametrize("rate", [1999, 2000])
def test_the_last_bin_is_counted_twice_only_below_half_the_rate(rate: int) -> None:
    at = (rate // 2) / rate
    values = np.cos(2 * np.pi * at * np.arange(4 * rate))
    found = noise(values, 1 / rate)
    assert found.frequency[-1] == pytest.approx(rate // 2)
    power = np.sum(found.density**2) * found.resolution
    assert power == pytest.approx(np.mean(values**2), rel=1e-3)


def test_a_short_stretch_is_refused() -> None:
    with pytest.raises(NotIdentifiableError, match=r"1 s were seen, 2 are needed"):
        noise(np.zeros(20_000), 1 / RATE)
