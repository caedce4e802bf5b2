"""Vector strength, its interval, and the frequency that spikes tell."""

import numpy as np
import pytest

from tactile_lab.analysis.phase_locking import (
    mains_locking,
    phase_locking,
    phases_of,
    rayleigh,
    strongest_frequency,
)
from tactile_lab.errors import NotIdentifiableError


def drawn(rng, kappa, presentations=10, each=8):
    return [rng.vonmises(0.7, kappa, each) for _ in range(presentations)]


def test_equal_phases_have_strength_one_and_even_ones_none():
    locked = phase_locking([np.full(10, 0.3)] * 6)
    assert locked.strength.value == pytest.approx(1.0)
    assert locked.phase == pytest.approx(0.3) and locked.locked
    even = phase_locking([np.linspace(-np.pi, np.pi, 20, endpoint=False)] * 6)
    assert even.strength.value < 1e-9 and not even.locked
    assert even.strength.low < 1e-9


@pytest.mark.parametrize("kappa", [0.5, 1.0, 3.0])
def test_the_interval_covers_the_truth(kappa):
    """Von Mises phases have the strength I1(kappa)/I0(kappa)."""
    from scipy.special import i0, i1

    truth = float(i1(kappa) / i0(kappa))
    rng = np.random.default_rng(5)
    found = [phase_locking(drawn(rng, kappa)) for _ in range(300)]
    covered = np.mean([one.strength.low <= truth <= one.strength.high for one in found])
    assert 0.91 <= covered <= 0.99
    near = np.mean([abs(one.phase - 0.7) <= one.phase_half for one in found])
    assert 0.91 <= near <= 0.99


def test_spikes_of_one_presentation_are_not_counted_as_independent():
    """Presentations that differ from each other leave more open than their spikes."""
    rng = np.random.default_rng(2)
    shifts = rng.normal(0, 1.0, 8)
    together = [shift + rng.normal(0, 0.05, 30) for shift in shifts]
    honest = phase_locking(together).strength
    pooled = phase_locking([np.concatenate(together)]).strength
    assert honest.half > 2 * pooled.half


def test_the_chance_is_that_of_even_phases():
    rng = np.random.default_rng(7)
    phases = rng.uniform(-np.pi, np.pi, (4000, 12))
    strength = np.abs(np.exp(1j * phases).mean(axis=1))
    chances = np.array([rayleigh(float(one), 12) for one in strength])
    assert np.mean(chances < 0.05) == pytest.approx(0.05, abs=0.012)


def test_phase_zero_is_where_the_force_is_largest():
    def force(time):
        return 0.2 + 0.01 * time + 0.05 * np.sin(2 * np.pi * 40 * (time - 0.003))

    peaks = 0.003 + (np.arange(10) + 0.25) / 40
    window = (0.0, 0.26)
    assert phases_of(peaks, force, 40.0, window) == pytest.approx(0, abs=0.01)
    late = phases_of(peaks + 0.25 / 40, force, 40.0, window)
    assert late == pytest.approx(np.pi / 2, abs=0.01)
    with pytest.raises(NotIdentifiableError, match="less than one cycle"):
        phases_of(peaks, force, 2.0, window)
    with pytest.raises(NotIdentifiableError, match="has nothing"):
        phases_of(peaks, lambda t: 0 * t, 40.0, window)


def test_too_few_spikes_claim_nothing():
    with pytest.raises(NotIdentifiableError, match="3 spikes"):
        phase_locking([np.zeros(2), np.zeros(1), np.empty(0)])
    with pytest.raises(NotIdentifiableError):
        strongest_frequency([np.zeros(1)] * 4, 1.0, 2.0, 1.0)


def test_the_strongest_frequency_is_the_stimulus_not_the_sensor_s_own():
    """Each scan fires at 31 Hz by itself, and at 23 Hz with all others."""
    rng = np.random.default_rng(3)
    scans = []
    for _ in range(8):
        locked = np.sort(rng.choice(np.arange(20), 8, replace=False)) / 23.0
        own = (rng.uniform() + np.arange(8)) / 31.0
        scans.append(np.concatenate([locked + rng.normal(0, 2e-3, 8), own]))
    found, chance = strongest_frequency(scans, 12.0, 35.0, 0.9)
    assert found == pytest.approx(23.0, abs=0.6) and chance < 0.01


def test_a_frequency_of_chance_is_called_chance():
    rng = np.random.default_rng(11)
    chances = [
        strongest_frequency([rng.uniform(0, 0.9, 40)], 12.0, 35.0, 0.9)[1]
        for _ in range(200)
    ]
    assert np.mean(np.array(chances) < 0.05) < 0.08


def test_spikes_that_the_mains_make_are_known_from_a_sensors_own():
    rng = np.random.default_rng(0)
    hum = np.arange(0, 8, 0.02) + rng.normal(0, 1e-3, 400)
    found = mains_locking(np.sort([*hum, *rng.uniform(0, 8, 50)]))
    assert found is not None and found.mains == 50.0
    assert found.strength == pytest.approx(0.84, abs=0.05)
    now_and_then = np.sort(rng.choice(hum, 150, replace=False))
    assert mains_locking(now_and_then).mains == 50.0
    assert mains_locking(np.arange(300) / 60.05).mains == 60.0
    adapting = np.cumsum(1 / np.linspace(40, 10, 200))
    for own in (adapting, np.arange(500) / 25.03, np.arange(200) / 37.0, hum[:10]):
        assert mains_locking(own) is None
