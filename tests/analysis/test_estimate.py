"""A number with its interval, as it is printed."""

import math

import numpy as np
import pytest

from tactile_lab.analysis.estimate import Estimate, correlated


@pytest.mark.parametrize(
    ("value", "half", "text"),
    [
        (3.1, 0.2, "3.10 s (2.90 to 3.30 s, 95 %)"),
        (8.6923, 0.03, "8.69 s (8.66 to 8.72 s, 95 %)"),
        (11.0, 0.5, "11.0 s (10.5 to 11.5 s, 95 %)"),
        (9.98, 0.42, "9.98 s (9.56 to 10.40 s, 95 %)"),
        (12345.0, 200.0, "12300 s (12100 to 12500 s, 95 %)"),
        (1.3e-9, 1e-10, "1.30e−09 s (1.20e−09 to 1.40e−09 s, 95 %)"),
        (8.69, 0.001, "8.690 s (8.689 to 8.691 s, 95 %)"),
        (1.4, 0.0033, "1.400 s (1.397 to 1.403 s, 95 %)"),
        (1.4, 4e-5, "1.40000 s (1.39996 to 1.40004 s, 95 %)"),
        (-2e-3, 1e-3, "−0.00200 s (−0.00300 to −0.00100 s, 95 %)"),
        (0.0, 0.5, "0.000 s (−0.500 to 0.500 s, 95 %)"),
    ],
)
def test_a_value_and_the_ends_of_its_interval_end_at_one_digit(value, half, text):
    assert Estimate(value, half / 2, value - half, value + half).text("s") == text


def test_its_level_can_be_said_once_beside_many():
    """A cell said "8.68 s (8.66 to 8.7)"."""
    told = Estimate(8.68, 0.01, 8.66, 8.70)
    assert told.text("s", level="") == "8.68 s (8.66 to 8.70 s)"
    bound = Estimate(0.02, 0.01, 0.02, 0.31)
    assert bound.text("Hz", level="") == "0.020 Hz (at its bound; below 0.310 Hz)"


@pytest.mark.parametrize(
    ("value", "half", "unit", "text"),
    [
        (65.3e-12, 2e-12, "A", "65.3 pA (63.3 to 67.3 pA, 95 %)"),
        (0.039, 1e-3, "V m/N", "0.0390 V m/N (0.0380 to 0.0400 V m/N, 95 %)"),
        (1.02, 0.01, "", "1.02 (1.01 to 1.03, 95 %)"),
    ],
)
def test_a_number_has_the_unit_that_suits_it(value, half, unit, text):
    assert Estimate(value, half / 2, value - half, value + half).shown(unit) == text


def test_a_cause_that_acts_more_one_way_widens_that_side_more():
    told = Estimate(1.0, 0.1, 0.8, 1.2).spanned((0.7, 1.5), (0.9, 1.0))
    assert told.low == pytest.approx(1 - math.sqrt(0.2**2 + 0.3**2 + 0.1**2))
    assert told.high == pytest.approx(1 + math.sqrt(0.2**2 + 0.5**2))
    assert told.value == 1.0
    # both ends on one side: the other does not grow
    assert Estimate(1.0, 0.1, 0.8, 1.2).spanned((1.1, 1.2)).low == 0.8


def test_the_error_of_what_spans_its_ends_is_that_of_its_mean_side():
    told = Estimate(1.0, 0.1, 0.8, 1.2).spanned((0.9, 1.1))
    more = (0.1 / 1.959964) ** 2
    assert told.error == pytest.approx(math.sqrt(0.1**2 + more), rel=1e-6)


def test_a_factor_below_zero_exchanges_the_ends():
    told = Estimate(2.0, 0.5, 1.0, 4.0).scaled(-2.0)
    assert (told.value, told.error, told.low, told.high) == (-4.0, 1.0, -8.0, -2.0)


@pytest.mark.parametrize(
    ("good", "low", "high"), [(8, 0.4902, 0.9433), (0, 0.0, 0.2775), (10, 0.7225, 1.0)]
)
def test_a_share_has_wilson_s_interval(good, low, high):
    """Wilson, J. Am. Stat. Assoc. 22, 209 (1927), of 10 draws."""
    told = Estimate.share(good, 10)
    assert told.value == good / 10
    assert (told.low, told.high) == pytest.approx((low, high), abs=5e-5)


def test_what_swings_back_is_counted_less_the_farther_it_is():
    """What codes left of V_C1 had its first swing counted whole, and no other."""
    rng = np.random.default_rng(0)
    wave = np.sin(np.arange(2000) / 20) + rng.normal(0, 0.1, 2000)
    alike, less = correlated(wave), correlated(wave, swings=True)
    assert 0.6 * alike < less < 0.8 * alike
    noise = rng.normal(0, 1, 2000)
    assert correlated(noise) == correlated(noise, swings=True) == 1.0
