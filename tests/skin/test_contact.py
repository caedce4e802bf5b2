"""Closed forms of stress against what they are integrals of."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from scipy.integrate import quad

from tactile_lab.skin import contact

DEPTH = 1e-3


@njit
def stress(load, strength, x, y):
    """Compiled functions call each other only."""
    return contact.stress(load, strength, x, y, DEPTH)


def ball(per_modulus):
    return np.array([contact.SPHERE, 0, 0, per_modulus])


def punch(a):
    return np.array([contact.PUNCH, 0, 0, a])


def around(P_of_s, a, r, z):
    """Boussinesq's point forces summed over a round contact of radius a."""

    def ring(u):
        s = a * math.sin(u)  # takes the punch's singular edge away
        angle = np.linspace(0, math.pi, 2001)
        rho2 = s * s + r * r - 2 * r * s * np.cos(angle) + z * z
        kernel = np.trapezoid(3 * z**3 / (math.pi * rho2**2.5), angle)
        return P_of_s(s, a * math.cos(u)) * s * a * math.cos(u) * kernel

    return quad(ring, 0, math.pi / 2, epsrel=1e-9)[0]


@pytest.mark.parametrize("r", [0.0, 0.7e-3, 4e-3])
@pytest.mark.parametrize("P", [0.01, 1.0])
def test_a_ball_presses_as_hertz_says(P, r):
    per_modulus = 5e-3 / 1e6
    a = (0.75 * P * per_modulus) ** (1 / 3)
    p0 = 1.5 * P / (math.pi * a * a)
    summed = around(lambda s, rest: p0 * rest / a, a, r, DEPTH)
    found = stress(ball(per_modulus), P, 0.6 * r, 0.8 * r)
    assert found == pytest.approx(summed, rel=1e-6)


@pytest.mark.parametrize("r", [0.0, 1e-3, 2e-3, 6e-3])
def test_a_flat_punch_presses_most_at_its_rim(r):
    a = 2e-3
    summed = around(lambda s, rest: 1 / (2 * math.pi * a * rest), a, r, DEPTH)
    assert stress(punch(a), 1.0, r, 0.0) == pytest.approx(summed, rel=1e-6)


@given(st.floats(1e-8, 1e-5), st.floats(0, 5e-3))
def test_a_tiny_contact_is_a_point_force(a, r):
    point = 3 * DEPTH**3 / (2 * math.pi * (r * r + DEPTH * DEPTH) ** 2.5)
    assert stress(punch(a), 1.0, r, 0.0) == pytest.approx(point, rel=1e-3)


def test_a_strip_is_a_sum_of_line_loads_and_a_wide_one_presses_evenly():
    strip = np.array([contact.STRIP, 0, 0, 1, 0, -0.4e-3, 0.6e-3])
    x = 0.3e-3
    summed = quad(
        lambda s: 2 * DEPTH**3 / (math.pi * ((x - s) ** 2 + DEPTH**2) ** 2),
        -0.4e-3,
        0.6e-3,
    )[0]
    found = stress(strip, 1.0, x, 5.0)
    assert found == pytest.approx(summed, rel=1e-9)
    wide = np.array([contact.STRIP, 0, 0, 0.6, 0.8, -10, 10])
    assert stress(wide, 7.0, 0.1, 0.2) == pytest.approx(7.0)


def test_a_wave_of_pressure_is_a_sum_of_strips_and_fades_with_depth():
    k = 2 * math.pi / 4e-3
    wave = np.array([contact.WAVE, 0, 0, k, 0, 0.5, 1.0])
    x = 0.7e-3
    summed = quad(
        lambda s: (
            math.cos(k * s + 0.5)
            * 2
            * DEPTH**3
            / (math.pi * ((x - s) ** 2 + DEPTH**2) ** 2)
        ),
        -0.2,
        0.2,
        limit=2000,
        points=[x],
    )[0]
    found = stress(wave, 1.0, x, 0.0)
    assert found == pytest.approx(summed, rel=1e-5)
