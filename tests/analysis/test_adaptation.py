import numpy as np
import pytest
from scipy.special import stdtrit

from tactile_lab.analysis.adaptation import fit_adaptation
from tactile_lab.analysis.estimate import student_95
from tactile_lab.errors import NotIdentifiableError


def spikes_of_the_law(alpha, beta, gamma, hold, *, shape=None, seed=0):
    """Spikes whose rescaled intervals are 1, or gamma distributed with that shape."""
    rng = np.random.default_rng(seed)
    time = np.linspace(0, hold, 40_001)
    count = alpha / beta * np.expm1(beta * time) + gamma * time
    many = int(count[-1] * 2) + 20
    steps = np.ones(many) if shape is None else rng.gamma(shape, 1 / shape, many)
    marks = np.cumsum(steps) - rng.uniform(0, 1) * steps[0]
    return np.interp(marks[marks < count[-1]], count, time)


@pytest.mark.parametrize(
    "law", [(12.0, -0.7, 4.0), (30.0, -1.0, 0.5), (20.0, -0.4, 0.0)]
)
def test_a_train_of_the_law_gives_the_law_back(law):
    times = spikes_of_the_law(*law, hold=10.0)
    fit = fit_adaptation(times + 5.0, (5.0, 15.0))
    assert [fit.alpha.value, fit.beta.value, fit.gamma.value] == pytest.approx(
        law, rel=1e-3, abs=2e-3
    )
    assert fit.r_squared > 0.9999
    assert fit.irregularity < 1e-4
    assert fit.rate(5.0) == pytest.approx(law[0] + law[2], rel=1e-3)


def test_intervals_cover_the_truth_about_95_times_in_100():
    law, hits, repeats = (15.0, -0.6, 4.0), np.zeros(3), 80
    for seed in range(repeats):
        times = spikes_of_the_law(*law, hold=10.0, shape=100, seed=seed)
        fit = fit_adaptation(times, (0.0, 10.0))
        found = (fit.alpha, fit.beta, fit.gamma)
        hits += [e.low <= v <= e.high for e, v in zip(found, law, strict=True)]
    assert np.all(hits / repeats > 0.88)
    assert np.all(hits / repeats < 1.0)


def test_gamma_never_falls_below_zero():
    for seed in range(30):
        times = spikes_of_the_law(20.0, -0.5, 0.0, hold=8.0, shape=30, seed=seed)
        fit = fit_adaptation(times, (0.0, 8.0))
        assert fit.gamma.value >= 0
        assert fit.gamma.low >= 0


def test_gamma_at_its_bound_says_so_and_has_a_profile_interval():
    times = spikes_of_the_law(20.0, -0.5, 0.0, hold=8.0, shape=30, seed=2)
    fits = [fit_adaptation(times, (0.0, 8.0)) for _ in range(1)]
    for seed in range(3, 30):
        times = spikes_of_the_law(20.0, -0.5, 0.0, hold=8.0, shape=30, seed=seed)
        fits.append(fit_adaptation(times, (0.0, 8.0)))
    bound = [fit.gamma for fit in fits if fit.gamma.value == 0]
    assert len(bound) > 3
    assert all(gamma.low == 0 < gamma.high < 4.0 for gamma in bound)
    assert "at its bound; below" in bound[0].text("Hz")


def test_a_systematic_misfit_is_told_from_irregularity():
    scattered = spikes_of_the_law(15.0, -0.6, 4.0, hold=10.0, shape=100, seed=5)
    assert not fit_adaptation(scattered, (0.0, 10.0)).systematic
    time = np.linspace(0, 10, 40_001)
    bent = np.cumsum(18 / (1 + time)) * (time[1] - time[0])
    train = np.interp(np.arange(0.5, bent[-1]), bent, time)
    fit = fit_adaptation(train, (0.0, 10.0))
    assert fit.systematic
    assert fit.drawn[0][-1] == fit.last == train[-1]


def test_time_constant_is_one_over_beta_with_its_interval():
    times = spikes_of_the_law(12.0, -0.5, 4.0, hold=10.0, shape=50, seed=1)
    fit = fit_adaptation(times, (0.0, 10.0))
    tau = fit.time_constant
    assert tau.value == pytest.approx(-1 / fit.beta.value)
    assert tau.low == pytest.approx(-1 / fit.beta.low)
    assert tau.high == pytest.approx(-1 / fit.beta.high)


def test_only_intervals_within_the_hold_count():
    times = spikes_of_the_law(12.0, -0.7, 4.0, hold=10.0)
    noise = np.concatenate([[-0.3, -0.2], times, [10.1, 10.2]])
    assert fit_adaptation(noise, (0, 10)).beta == fit_adaptation(times, (0, 10)).beta


def test_too_few_intervals():
    with pytest.raises(NotIdentifiableError, match="9 intervals in the hold, 10 are"):
        fit_adaptation(np.arange(10) * 0.1, (0.0, 2.0))


def test_a_hold_shorter_than_two_time_constants():
    times = spikes_of_the_law(20.0, -0.3, 2.0, hold=3.0)
    with pytest.raises(NotIdentifiableError, match=r"exceeds the hold of 3 s"):
        fit_adaptation(times, (0.0, 3.0))


@pytest.mark.parametrize("slope", [0.0, 0.2])
def test_a_rate_that_does_not_fall(slope):
    count = np.arange(40)
    times = count * 0.1 if slope == 0 else np.log1p(slope * count * 0.1) / slope
    with pytest.raises(NotIdentifiableError, match="does not fall"):
        fit_adaptation(times, (0.0, 5.0))


@pytest.mark.parametrize("freedom", [1, 2, 3, 7, 30, 1000, 1_000_000])
def test_students_quantile(freedom):
    assert student_95(freedom) == pytest.approx(stdtrit(freedom, 0.975), rel=1e-8)


def test_a_fall_within_the_first_interval_is_no_law():
    """Of a sensor over a grating: it stood as 3.0 ms (2.6 to 3.7 ms), alpha 50 MHz."""
    train = [
        0.1101, 0.1537, 0.2193, 0.2408, 0.3130, 0.3361, 0.4093, 0.4343, 0.5083,
        0.5342, 0.6093, 0.6352, 0.7114, 0.7370, 0.8139,
    ]  # fmt: skip
    with pytest.raises(NotIdentifiableError, match="below the shortest interval"):
        fit_adaptation(train, (0.18, 0.82))
