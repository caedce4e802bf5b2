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
from tactile_lab.model.compiled import inner
from tactile_lab.model.tableau import (
    DIFFERENTIATE,
    NODES,
    ORDER,
    SCHUR_Q,
    SCHUR_Q_TURNED,
    SCHUR_T,
)

LOG_B_CAP = 230.0
MOST_ITERATIONS = 14
V_T, LAMBDA, DIVIDER, LOG_B0, PER_VOLT, TAU = range(6)
"""Where `par` holds V_T, lambda, D, ln(I_S/C1) + V_GS/(m V_T), 1/(m V_T) and tau."""


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
    """Solve in place by Gaussian elimination.

    Without pivoting: in `DIFFERENTIATE` plus any positive diagonal no entry grows by
    more than a few times, and each Newton iteration mends what the last one left.
    """
    for k in range(0, ORDER, 2):
        # two columns at a time: half as many passes over the rest
        p, q = matrix[k, k], matrix[k, k + 1]
        u = matrix[k + 1, k] / p
        r = matrix[k + 1, k + 1] - u * q
        matrix[k + 1, k + 1] = r
        for j in range(k + 2, ORDER):
            matrix[k + 1, j] -= u * matrix[k, j]
        right[k + 1] -= u * right[k]
        by_p, by_r = 1.0 / p, 1.0 / r
        for i in range(k + 2, ORDER):
            one = matrix[i, k] * by_p
            two = (matrix[i, k + 1] - one * q) * by_r
            for j in range(k + 2, ORDER):
                matrix[i, j] -= one * matrix[k, j] + two * matrix[k + 1, j]
            right[i] -= one * right[k] + two * right[k + 1]
    for k in range(ORDER - 2, -1, -2):
        one, two = right[k], right[k + 1]
        for j in range(k + 2, ORDER):
            one -= matrix[k, j] * right[j]
            two -= matrix[k + 1, j] * right[j]
        right[k + 1] = two / matrix[k + 1, k + 1]
        right[k] = (one - matrix[k, k + 1] * right[k + 1]) / matrix[k, k]


@inner
def matrix_times(columns: FloatArray, values: FloatArray, result: FloatArray) -> None:
    """Fill ORDER of `result` with a matrix, given by its columns, times `values`."""
    for n in range(0, ORDER, 4):  # four sums at once: none waits for another
        a = b = c = d = 0.0
        for i in range(columns.shape[0]):
            value = values[i]
            a += columns[i, n] * value
            b += columns[i, n + 1] * value
            c += columns[i, n + 2] * value
            d += columns[i, n + 3] * value
        result[n], result[n + 1], result[n + 2], result[n + 3] = a, b, c, d


@inner
def solve_shifted(r: float, right: FloatArray, turned: FloatArray) -> None:
    """Solve (DIFFERENTIATE + r) x = right in place, by its Schur form."""
    matrix_times(SCHUR_Q, right, turned)
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
    matrix_times(SCHUR_Q_TURNED, turned, right)


@inner
def collocate(
    s: float,
    h: float,
    y0: float,
    V0: float,
    p: float,
    low: float,
    high: float,
    wanted: float,
    par: FloatArray,
    W: FloatArray,
    B: FloatArray,
    matrix: FloatArray,
    right: FloatArray,
) -> tuple[int, float]:
    """One step from s to s + h: fill W with V_C1 - y0 at the nodes.

    Where V_C1 stays so far above V_T that exp(-V_C1/V_T) is next to nothing, the
    equation is linear and solved by the Schur form of the rule, else by Newton's
    iteration and elimination, to a thousandth of `wanted` V. The iterates are kept
    within [low, high], between which the exact solution lies. Returns the iterations,
    -1 where they do not converge, and what another one would still change, V.
    """
    most = 0.0
    for i in range(ORDER):
        B[i] = B_at(V_P_at(s + h * NODES[i], V0, p, par[TAU]), par)
        most = max(most, B[i])
    closing = most * math.exp(-low / par[V_T]) / (par[V_T] * par[LAMBDA])
    linear = closing < 1e-3
    # what the next iteration would change: by the part left out and by rounding, or
    # by the square of this one's change over 2 V_T
    slope = 0.0
    if linear:
        enough = 1e-3 * wanted / max(closing, 2e-14)
    else:
        enough = math.sqrt(2e-3 * wanted * par[V_T])
        slope = h * slope_at(B_at(V_P_at(s, V0, p, par[TAU]), par), y0, par)
    for i in range(ORDER):
        W[i] = min(max(y0 + slope * NODES[i], low), high) - y0 if slope != 0.0 else 0.0
    for iteration in range(MOST_ITERATIONS):
        for i in range(ORDER):
            y = y0 + W[i]
            e, q = -1.0, 0.0
            if closing > 1e-20:
                q = math.exp(-y / par[V_T])
                e = q - 1.0 if q < 0.5 else math.expm1(-y / par[V_T])
            total = h * (par[LAMBDA] * (par[DIVIDER] - y) + B[i] * e)
            if iteration or slope != 0.0:
                for j in range(ORDER):
                    total -= DIFFERENTIATE[i, j] * W[j]
            right[i] = total
            if not linear:
                rate = h * (par[LAMBDA] + B[i] * q / par[V_T])
                scale = 1.0 / (1.0 + rate)
                for j in range(ORDER):
                    matrix[i, j] = DIFFERENTIATE[i, j] * scale
                matrix[i, i] += rate * scale
                right[i] = total * scale
        if linear:
            solve_shifted(h * par[LAMBDA], right, matrix[0])
        else:
            eliminate(matrix, right)
        largest = 0.0
        for i in range(ORDER):
            if not abs(right[i]) < np.inf:
                return -1, 0.0
            V = min(max(y0 + W[i] + right[i], low), high)
            change = V - y0 - W[i]
            W[i] += change if V in (low, high) else right[i]
            largest = max(largest, abs(right[i]))
        if largest < enough:
            share = max(closing, 2e-14) if linear else 0.5 * largest / par[V_T]
            return iteration + 1, largest * share
    return -1, 0.0
