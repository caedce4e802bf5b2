"""What a converter's steps leave open, by the scatter of means."""

import numpy as np
import pytest

from tactile_lab.analysis.converter import step_bias


def means(level, noise, samples=500, seed=3):
    """Means of bins of a converter with steps of 1."""
    rng = np.random.default_rng(seed)
    return np.array([np.round(v + rng.normal(0, noise, samples)).mean() for v in level])


@pytest.mark.parametrize("rest", [0.5, 0.45, 0.3])
def test_a_rest_at_the_edge_of_a_code_is_no_large_noise(rest):
    """Toggling there seemed to smooth the steps, which were off by 0.2 elsewhere."""
    level = np.concatenate([np.full(1000, rest), np.linspace(0, 2, 500)])
    level[1100::50] += 3.0  # as forces come and go
    seen = means(level, 0.127)
    assert step_bias(seen, 1.0, 500) > np.quantile(np.abs(seen - level), 0.97)


def test_two_codes_that_a_level_toggles_between_smooth_nothing():
    """Of levels by an edge 6 % lay within what was told, under noise of 0.1 codes."""
    rng, right, n = np.random.default_rng(1), 0, 1000
    for _ in range(n):
        level = 0.5 + rng.uniform(-0.1, 0.1)
        codes = np.round(level + rng.normal(0, 0.1, (60, 100)))
        seen, extent = codes.mean(axis=1), np.ptp(codes, axis=1)
        off = abs(seen.mean() - level)
        right += off <= step_bias(seen, 1.0, 100, extent) + 2 * seen.std() / 60**0.5
    assert right >= 0.95 * n


def test_noise_that_smooths_is_seen_at_rest_and_under_way():
    for rest in (0.0, 0.25, 0.5):
        level = np.concatenate([np.full(1000, rest), np.linspace(0, 2, 500)])
        assert step_bias(means(level, 0.6), 1.0, 500) < 0.01
