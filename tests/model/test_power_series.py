"""Power series where T1 saturates, beside what they are series of; and their lanes."""

import math

import numpy as np
import pytest
from numba import njit

from tactile_lab.model.circuit import Circuit
from tactile_lab.model.lanes import (
    apart,
    load,
    negative,
    same,
    side_by_side,
    spread,
    store,
)
from tactile_lab.model.node_a import B_at
from tactile_lab.model.packed import parameters
from tactile_lab.model.pair import flow
from tactile_lab.model.power_series import (
    FOURS,
    MOST,
    ROW,
    SLOPES,
    V_C2,
    VOLTAGES,
    expand,
    four_at,
)
from tactile_lab.model.scratch import room_for
from tactile_lab.model.stretched_time import pace_at, time_at
from tactile_lab.model.taylor import highest, rising
from tactile_lab.model.transistor import FLOW, OF_W, OF_X, TO_A, TO_C2

DEGREE, RATE, L, TURN = 30, 700.0, 2e-3, 0.2
RISE = 5.0
four_room = room_for(4)
series_room, flow_room = room_for(MOST + 2, ROW), room_for(FLOW)


@njit
def reckoned(a, b):
    four = four_room()
    one, two = side_by_side(*a), side_by_side(*b)
    store(four, 0, one - two)
    return apart(one + two * same(3.0)), apart(spread(one, 2) * load(four, 0))


@njit
def below_0(a):
    return apart(negative(side_by_side(*a)))


@njit
def told(of_V_C2, x, level):
    c = series_room()
    degree = of_V_C2.size - 1
    for k in range(degree + 2):
        for n in range(ROW):
            c[k, n] = 0.0
    end = 0.0
    for k in range(degree, -1, -1):
        c[k, V_C2] = of_V_C2[k]
        end = end * x + of_V_C2[k]
        if k:
            c[k - 1, SLOPES + 1] = k * of_V_C2[k]
    return rising(c, degree, x, level, end, 1e-15), highest(c, degree, x, end)


@njit
def at_the_end(par, V_C1, V_C2, V_P, w, found, slopes):
    c, f = series_room(), flow_room()
    flow(B_at(V_P, par), V_C1, V_C2, False, par, f)
    expand(V_C1, V_C2, False, V_P, RISE, RATE, L, TURN, DEGREE, par, f, c)
    found[:4] = apart(four_at(c, VOLTAGES, DEGREE, w))
    found[4:8] = apart(four_at(c, FOURS, DEGREE, w))
    found[8:] = apart(four_at(c, SLOPES, DEGREE, w))
    flow(B_at(found[2], par), found[0], found[1], False, par, f)
    slopes[0], slopes[1], slopes[2], slopes[3] = f[TO_A], f[TO_C2], f[OF_X], f[OF_W]


def test_lanes_are_four_numbers_each_by_itself():
    a, b = (1.0, 2.0, 4.0, 8.0), (0.5, 0.25, 0.125, 3.0)
    summed, spread_out = reckoned(a, b)
    assert summed == tuple(x + 3.0 * y for x, y in zip(a, b, strict=True))
    assert spread_out == tuple(4.0 * (x - y) for x, y in zip(a, b, strict=True))


@pytest.mark.parametrize(
    ("circuit", "V_C1", "V_C2", "V_P", "w"),
    [
        (Circuit(saturation=True), 2.7, 3.12, 0.3, 0.2),
        (Circuit(saturation=True), 0.1, 0.3, 0.3, 0.01),
        (Circuit(saturation=True, t1="direct", I_T1s=2.873e-20), 4.45, 4.8, 0.1, 0.2),
    ],
    ids=["opens", "low", "direct"],
)
def test_series_are_of_what_the_equations_say(circuit, V_C1, V_C2, V_P, w):
    par = parameters(circuit)
    found, equations = np.empty(12), np.empty(4)
    at_the_end(par, V_C1, V_C2, V_P, w, found, equations)
    dy, dv, X_end, W_end = equations
    y, v, pressed, fades, P, W, held_back, B, to_y, to_v, to_V_P, _ = found
    t, pace = time_at.py_func(w, L, TURN), pace_at.py_func(w, L, TURN)
    kept = math.exp(-t / circuit.tau)
    final = RISE * circuit.tau
    assert pressed == pytest.approx(final + (V_P - final) * kept, rel=1e-13)
    assert to_V_P == pytest.approx(pace * (RISE - pressed / circuit.tau), rel=1e-9)
    grown = math.exp((pressed - V_P) / (circuit.m * circuit.V_T))
    assert pytest.approx(B_at.py_func(V_P, par) * grown, rel=1e-12) == B
    assert held_back == pytest.approx(B * math.exp(-y / circuit.V_T), rel=1e-9)
    assert pytest.approx(X_end + 1.0, rel=1e-9) == P
    assert pytest.approx(W_end, rel=1e-9) == W
    assert (to_y, to_v) == pytest.approx((pace * dy, pace * dv), rel=1e-8)
    assert fades == pytest.approx(math.exp(-RATE * t), rel=1e-9)
    # both have moved, or nothing would be shown
    assert abs(v - V_C2) + abs(y - V_C1) > 0.2 * circuit.V_T


def test_of_four_lanes_what_is_below_0_is_left():
    assert below_0((1.0, -2.0, 0.0, -0.5)) == (0.0, -2.0, 0.0, -0.5)


@pytest.mark.parametrize("degree", [3, 4, 11, 12])
def test_a_crossing_is_where_a_series_that_rises_meets_the_level(degree):
    rng = np.random.default_rng(degree)
    for _ in range(50):
        series = rng.normal(size=degree + 1)
        x = rng.uniform(0.1, 0.9)
        w = np.linspace(0.0, x, 2001)
        values = np.polynomial.polynomial.polyval(w, series)
        level = rng.uniform(values.min(), values.max())
        found, bound = told(series, x, level)
        assert values.max() <= bound + 1e-12
        if found == 0.0:
            continue  # not proven; some other way is taken
        assert np.all(np.diff(values) > 0.0), "only what rises is answered"
        if values[-1] < level:
            assert found == 2.0
        else:
            there = np.polynomial.polynomial.polyval(found, series)
            assert there == pytest.approx(level, abs=1e-12)


def test_that_a_series_rises_is_told_of_those_that_do():
    series = np.array([1.0, 2.0, 0.5, -0.1, 0.02])
    found, _ = told(series, 0.8, 2.0)
    assert np.polynomial.polynomial.polyval(found, series) == pytest.approx(2.0)
    assert told(series, 0.8, 3.5)[0] == 2.0
    assert told(np.array([1.0, 2.0, -5.0]), 0.8, 1.1)[0] == 0.0
    assert told(series, 0.8, 0.9)[0] == 0.0, "it begins above the level"
