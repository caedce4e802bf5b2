"""Node A: V_C1 by collocation at 12 Radau IIA nodes, Eqs. (7), (8) and (16).

    V_P(s)   = V0 + (V0 - p tau) expm1(-s/tau)          s since the segment's start
    V_C1'(s) = lambda (D - V_C1) - B(s) (1 - exp(-V_C1/V_T))

with D the open divider's voltage, lambda = 1/tau_A and B = I_S exp(..)/C1. B is formed
from its logarithm, capped where V_C1 is zero to all digits.
"""

from __future__ import annotations

import math

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model import elementary
from tactile_lab.model.compiled import inner
from tactile_lab.model.matrix import product_of
from tactile_lab.model.tableau import (
    DIFFERENTIATE,
    DIFFERENTIATE_TURNED,
    NODES,
    ORDER,
    SCHUR_Q,
    SCHUR_Q_TURNED,
    SCHUR_T,
)

times = product_of(ORDER)

LOG_B_CAP = 230.0
MOST_ITERATIONS = 14
V_T, LAMBDA, DIVIDER, LOG_B0, PER_VOLT, TAU = range(6)
"""Where `par` holds V_T, lambda, D, ln(I_S/C1) + V_GS/(m V_T), 1/(m V_T) and tau."""
CHANGE, OF_B, RATE, RIGHT, MOVED = range(0, 5 * ORDER, ORDER)
"""Rows of a step's nodes: V_C1 less its start; B; h times -d/dV_C1 of Eq. (16); the
right-hand side, then the correction; the derivative of the polynomial.

One after the other in one array: nothing has to ask whether two rows overlap, so loops
over the nodes run four at a time."""
ROWS = 5 * ORDER


@inner
def V_P_at(s: float, V0: float, p: float, tau: float) -> float:
    """Closed form of Eq. (7) on a segment of constant slope p = k_F F', V."""
    e = math.expm1(-s / tau)
    return V0 + V0 * e - p * tau * e


@inner
def B_at(V_P: float, par: FloatArray) -> float:
    """I_S exp((V_GS + V_P)/(m V_T))/C1, V/s, capped."""
    return math.exp(min(par[LOG_B0] + V_P * par[PER_VOLT], LOG_B_CAP))


@inner
def slope_at(B: float, y: float, par: FloatArray) -> float:
    """Eq. (16), V/s."""
    slope: float = par[LAMBDA] * (par[DIVIDER] - y) + B * math.expm1(-y / par[V_T])
    return slope


@inner
def equilibrium(B: float, par: FloatArray) -> float:
    """The root of Eq. (16) in V_C1; Newton from the left of a convex function, V."""
    a = B / par[LAMBDA]
    y = max(0.0, par[DIVIDER] - a)
    for _ in range(100):
        e = math.expm1(-y / par[V_T])
        change = (par[DIVIDER] - y + a * e) / (1.0 + a / par[V_T] * (1.0 + e))
        y += change
        if abs(change) <= 1e-13 * y:
            break
    return float(min(max(y, 0.0), par[DIVIDER]))


@inner
def eliminate(matrix: FloatArray, right: FloatArray) -> None:
    """Solve in place by Gaussian elimination, in blocks of 2 x 2.

    Without pivoting: in `DIFFERENTIATE` plus any positive diagonal no entry grows by
    more than a few times, and each Newton iteration mends what the last one left.
    """
    for k in range(0, ORDER, 2):
        p, q = matrix[k, k], matrix[k, k + 1]
        r, s = matrix[k + 1, k], matrix[k + 1, k + 1]
        # the block's inverse takes its place
        reciprocal = 1.0 / (p * s - q * r)
        p, q, r, s = s * reciprocal, -q * reciprocal, -r * reciprocal, p * reciprocal
        matrix[k, k], matrix[k, k + 1] = p, q
        matrix[k + 1, k], matrix[k + 1, k + 1] = r, s
        for i in range(k + 2, ORDER):
            one = matrix[i, k] * p + matrix[i, k + 1] * r
            two = matrix[i, k] * q + matrix[i, k + 1] * s
            for j in range(k + 2, ORDER):
                matrix[i, j] -= one * matrix[k, j] + two * matrix[k + 1, j]
            right[i] -= one * right[k] + two * right[k + 1]
    for k in range(ORDER - 2, -1, -2):
        one, two = right[k], right[k + 1]
        for j in range(k + 2, ORDER):
            one -= matrix[k, j] * right[j]
            two -= matrix[k + 1, j] * right[j]
        right[k] = matrix[k, k] * one + matrix[k, k + 1] * two
        right[k + 1] = matrix[k + 1, k] * one + matrix[k + 1, k + 1] * two


@inner
def solve_shifted(r: float, right: FloatArray, turned: FloatArray) -> None:
    """Solve (DIFFERENTIATE + r) x = right in place, by its Schur form."""
    times(SCHUR_Q, right, turned)
    for k in range(ORDER - 2, -1, -2):
        one, two = turned[k], turned[k + 1]
        for j in range(k + 2, ORDER):
            one -= SCHUR_T[k, j] * turned[j]
            two -= SCHUR_T[k + 1, j] * turned[j]
        a, b = SCHUR_T[k, k] + r, SCHUR_T[k, k + 1]
        c, d = SCHUR_T[k + 1, k], SCHUR_T[k + 1, k + 1] + r
        reciprocal = 1.0 / (a * d - b * c)
        turned[k] = (d * one - b * two) * reciprocal
        turned[k + 1] = (a * two - c * one) * reciprocal
    times(SCHUR_Q_TURNED, turned, right)


@inner
def B_along(
    s: float, h: float, V0: float, p: float, par: FloatArray, nodes: FloatArray
) -> None:
    """Fill B at the nodes of a step from s to s + h."""
    level = par[LOG_B0] + V0 * par[PER_VOLT]
    swing = (V0 - p * par[TAU]) * par[PER_VOLT]
    per_tau = 1.0 / par[TAU]
    for i in range(ORDER):
        e = elementary.expm1(-(s + h * NODES[i]) * per_tau)
        nodes[OF_B + i] = elementary.exp(min(level + swing * e, LOG_B_CAP))


@inner
def residual(h: float, y0: float, par: FloatArray, nodes: FloatArray) -> None:
    """Fill the right-hand side and its rate: Eq. (16) times h less what is moved."""
    leak, divider, per_t = par[LAMBDA], par[DIVIDER], 1.0 / par[V_T]
    for i in range(ORDER):
        y = y0 + nodes[CHANGE + i]
        power, part = elementary.parts(-y * per_t)
        part *= power
        slope = leak * (divider - y) + nodes[OF_B + i] * ((power - 1.0) + part)
        nodes[RIGHT + i] = h * slope - nodes[MOVED + i]
        nodes[RATE + i] = h * (leak + nodes[OF_B + i] * (power + part) * per_t)


@inner
def collocate(
    s: float,
    h: float,
    y0: float,
    B_s: float,
    V0: float,
    p: float,
    low: float,
    high: float,
    wanted: float,
    par: FloatArray,
    nodes: FloatArray,
    matrix: FloatArray,
) -> tuple[int, float]:
    """One step from s, where B is `B_s`, to s + h: fill the rows of `nodes`.

    Where V_C1 stays so far above V_T that exp(-V_C1/V_T) is next to nothing, the
    equation is linear and solved by the Schur form of the rule, else by Newton's
    iteration and elimination, to a thousandth of `wanted` V. The iterates are kept
    within [low, high], between which the exact solution lies. Returns the iterations,
    -1 where they do not converge, and what another one would still change, V.
    """
    right, moved = nodes[RIGHT:MOVED], nodes[MOVED:]
    B_along(s, h, V0, p, par, nodes)
    most = max(B_s, nodes[OF_B + ORDER - 1])  # V_P is monotone
    closing = most * math.exp(-low / par[V_T]) / (par[V_T] * par[LAMBDA])
    linear = closing < 1e-3
    # what the next iteration would change: by the part left out and by rounding, or
    # by the square of this one's change over 2 V_T
    slope = 0.0
    if linear:
        enough = 1e-3 * wanted / max(closing, 2e-14)
    else:
        enough = math.sqrt(2e-3 * wanted * par[V_T])
        slope = h * slope_at(B_s, y0, par)
    for i in range(ORDER):
        y = min(max(y0 + slope * NODES[i], low), high)
        nodes[CHANGE + i] = y - y0 if slope != 0.0 else 0.0
    for iteration in range(MOST_ITERATIONS):
        times(DIFFERENTIATE_TURNED, nodes, moved)
        residual(h, y0, par, nodes)
        if not linear:
            for i in range(ORDER):
                for j in range(ORDER):
                    matrix[i, j] = DIFFERENTIATE[i, j]
                matrix[i, i] += nodes[RATE + i]
        if linear:
            solve_shifted(h * par[LAMBDA], right, moved)
        else:
            eliminate(matrix, right)
        largest = 0.0
        for i in range(ORDER):
            if not abs(right[i]) < np.inf:
                return -1, 0.0
            before = nodes[CHANGE + i]
            V = min(max(y0 + before + right[i], low), high)
            kept = V in (low, high)
            nodes[CHANGE + i] = V - y0 if kept else before + right[i]
            largest = max(largest, abs(right[i]))
        if largest < enough:
            share = max(closing, 2e-14) if linear else 0.5 * largest / par[V_T]
            return iteration + 1, largest * share
    return -1, 0.0
