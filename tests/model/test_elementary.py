"""exp, expm1 and T1's current of many points at once, beside their definitions."""

import math

import numpy as np
import pytest
from numba import njit

from tactile_lab.model import elementary
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.integrator import Q_along
from tactile_lab.model.packed import parameters
from tactile_lab.model.tableau import ORDER
from tactile_lab.model.transistor import I_S1, R_E

EPS = np.finfo(float).eps


@njit
def both(x, exps, less_one):
    for i in range(x.size):
        exps[i] = elementary.exp(x[i])
        less_one[i] = elementary.expm1(x[i])


@njit
def along(points, par):
    Q_along(points, par)


def test_exponentials_are_right_to_the_last_digits():
    signs = np.array([-1.0, 1.0])
    x = np.outer(signs, np.concatenate([np.geomspace(1e-300, 699.0, 4001), [0.0]]))
    x = np.concatenate([x.ravel(), np.linspace(-40.0, 40.0, 8001)])
    exps, less_one = np.empty((2, x.size))
    both(x, exps, less_one)
    # the argument's own last digit is not ours: both take it as it is
    assert exps == pytest.approx([math.exp(v) for v in x], rel=3 * EPS, abs=0)
    assert less_one == pytest.approx([math.expm1(v) for v in x], rel=4 * EPS, abs=0)
    assert less_one[4001] == 0.0


@pytest.mark.parametrize("t1", ["emitter_resistor", "direct"])
@pytest.mark.parametrize("span", [1e-6, 0.01, 0.3, 4.9])
def test_current_of_all_points_solves_its_equation(t1, span):
    """At any distance from the first point, be it too far for the iteration."""
    circuit = Circuit(t1=t1)
    par = parameters(circuit)
    for start in (0.02, 2.0, 4.3, 4.95):
        points = np.zeros(3 * (ORDER + 1))
        V = np.clip(start + span * np.linspace(0.0, -1.0, ORDER + 1), 0.0, 5.0)
        for way in (V, V[::-1]):
            points[: ORDER + 1] = way
            along(points, par)
            Q = points[ORDER + 1 : 2 * (ORDER + 1)]
            I_C = Q / circuit.R_L - circuit.I_bias
            drop = par[R_E] * I_C if t1 == "emitter_resistor" else 0.0
            U = circuit.V_S - way - drop
            rounding = 8 * EPS * (circuit.V_S + np.abs(drop)) / circuit.V_T
            current = par[I_S1] * np.expm1(U / circuit.V_T)
            scale = np.abs(current) + par[I_S1]
            assert np.all(np.abs(I_C - current) <= 4 * rounding * scale)
