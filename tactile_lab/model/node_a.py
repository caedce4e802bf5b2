"""Node A: V_C1 by collocation at 12 Radau IIA nodes, Eqs. (7), (8) and (16).

    V_P(s)   = V0 + (V0 - p tau) expm1(-s/tau)          s since the segment's start
    V_C1'(s) = lambda (D - V_C1) - B(s) (1 - exp(-V_C1/V_T))

with D the open divider's voltage, lambda = 1/tau_A and B = I_S exp(..)/C1. B is formed
from its logarithm, capped where V_C1 is zero to all digits.
"""

from __future__ import annotations

import math

import numpy as np

from tactile_lab.model.circuit import FloatArray
from tactile_lab.model.compiled import inner
from tactile_lab.model.tableau import DIFFERENTIATE, NODES

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
    """Solve in place by Gaussian elimination with partial pivoting."""
    n = right.size
    for k in range(n):
        pivot, largest = k, abs(matrix[k, k])
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > largest:
                pivot, largest = i, abs(matrix[i, k])
        if pivot != k:
            for j in range(k, n):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            right[k], right[pivot] = right[pivot], right[k]
        reciprocal = 1.0 / matrix[k, k]
        for i in range(k + 1, n):
            factor = matrix[i, k] * reciprocal
            for j in range(k + 1, n):
                matrix[i, j] -= factor * matrix[k, j]
            right[i] -= factor * right[k]
    for k in range(n - 1, -1, -1):
        total = right[k]
        for j in range(k + 1, n):
            total -= matrix[k, j] * right[j]
        right[k] = total / matrix[k, k]


@inner
def collocate(
    s: float,
    h: float,
    y0: float,
    V0: float,
    p: float,
    low: float,
    high: float,
    par: FloatArray,
    W: FloatArray,
    B: FloatArray,
    matrix: FloatArray,
    right: FloatArray,
) -> int:
    """One step from s to s + h: fill W with V_C1 - y0 at the nodes.

    Newton's iterates are kept within [low, high], between which the exact solution
    lies. Returns the iterations, or -1 where they do not converge.
    """
    n = W.size
    enough = 4e-9 * math.sqrt(par[V_T])
    for i in range(n):
        B[i] = B_at(V_P_at(s + h * NODES[i], V0, p, par[TAU]), par)
        W[i] = 0.0
    for iteration in range(MOST_ITERATIONS):
        for i in range(n):
            y = y0 + W[i]
            q = math.exp(-y / par[V_T])
            e = q - 1.0 if q < 0.5 else math.expm1(-y / par[V_T])
            rate = h * (par[LAMBDA] + B[i] * q / par[V_T])
            scale = 1.0 / (1.0 + rate)
            total = h * (par[LAMBDA] * (par[DIVIDER] - y) + B[i] * e)
            for j in range(n):
                total -= DIFFERENTIATE[i, j] * W[j]
                matrix[i, j] = DIFFERENTIATE[i, j] * scale
            matrix[i, i] += rate * scale
            right[i] = total * scale
        eliminate(matrix, right)
        largest = 0.0
        for i in range(n):
            if not abs(right[i]) < np.inf:
                return -1
            V = min(max(y0 + W[i] + right[i], low), high)
            change = V - y0 - W[i]
            W[i] += change if V in (low, high) else right[i]
            largest = max(largest, abs(right[i]))
        if largest < enough:
            return iteration + 1
    return -1
