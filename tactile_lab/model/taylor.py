"""V_C1 and V_C2 where T1 saturates, as power series in time: for steps not stiff.

All coefficients follow from the state by recursion, as every function in the equations
solves a differential equation itself: x = exp(g) has x' = x g', and Wright's omega w of
z has w' = z' w/(1 + w). With them come those of what either voltage at the start moves.
Time is counted in units in which the fastest rate is 1, so that no coefficient leaves
the range of numbers.
"""

from __future__ import annotations

import math

from tactile_lab.arrays import FloatArray
from tactile_lab.model.compiled import inner
from tactile_lab.model.integrator import DIRECT, TAU_L, V_RESET, V_S, omega, to_series
from tactile_lab.model.node_a import DIVIDER, LAMBDA, PER_VOLT, TAU, V_T, B_at, V_P_at
from tactile_lab.model.pair import (
    GROWTH,
    LEFT_1,
    LEFT_2,
    LENGTH,
    MOVED,
    STAYS_1,
    STAYS_2,
    UNITS,
    V_END,
    Y_END,
    flow,
)
from tactile_lab.model.tableau import ORDER, POINTS
from tactile_lab.model.transistor import (
    E_DROP,
    E_LOG,
    I_S1,
    PER_F,
    PER_R,
    R_E,
    T1_BIAS,
    T1_C1,
    T1_C2,
    TO_A,
    TO_C2,
)

LEAST, MOST = 7, 22
"""Lowest and highest degree of a series."""
MOST_UNITS = 6.0
"""A step that accuracy lets be longer is stiff."""
SAFETY = 2.0
Y, V, TO_Y, TO_V, Y_BY_1, Y_BY_2, V_BY_1, V_BY_2 = range(8)
"""Rows: V_C1 and V_C2, V; their slopes, V per unit; and how far a volt more of either
at the start moves them."""
G, B, Q, X, APART, Z, W, U, A11, A12, A21, A22 = range(8, 20)
"""Rows: slope of V_P; B; exp(-V_C1/V_T) - 1; J/I_T1s; slope of V_C2 - V_C1; of z; omega
or, with "direct", I_F + I_T1s; w/(1 + w); the Jacobian."""
ROWS = 20


@inner
def product(a: FloatArray, b: FloatArray, n: int) -> float:
    """Coefficient n of the product of two series."""
    total = 0.0
    for j in range(n + 1):
        total += a[j] * b[n - j]
    return float(total)


@inner
def degree_for(wanted: float) -> int:
    """The degree that costs least where a step may miss by `wanted` V."""
    return min(max(int(0.6 * math.log(3.0 / wanted)) + 2, LEAST), MOST)


@inner
def expand(
    s: float, y: float, v: float, held: bool, V0: float, p: float, unit: float,
    degree: int, par: FloatArray, c: FloatArray,
) -> None:  # fmt: skip
    """Fill the rows of `c` at s after the segment's start, up to `degree`."""
    V_P = V_P_at(s, V0, p, par[TAU])
    v_t, leak, direct = par[V_T], par[I_S1], par[DIRECT] != 0.0
    to_a, to_c2 = unit / par[T1_C1], unit / par[T1_C2]
    a = 1.0 + par[PER_F]
    r = 1.0 + par[PER_R]
    per_w = 1.0 if direct else v_t / (a * par[R_E])
    c[Y, 0], c[V, 0] = y, v
    c[Y_BY_1, 0] = c[V_BY_2, 0] = 1.0
    c[Y_BY_2, 0] = c[V_BY_1, 0] = 0.0
    c[G, 0] = unit * (p - V_P / par[TAU])
    c[B, 0] = B_at(V_P, par)
    c[Q, 0] = math.expm1(-y / v_t)
    c[X, 0] = math.expm1(((par[V_RESET] if held else v) - y) / v_t)
    if direct:
        c[W, 0] = leak * math.exp((par[V_S] - y) / v_t)
    else:
        z = (par[V_S] - y + par[R_E] * leak * c[X, 0] + par[E_DROP]) / v_t
        c[W, 0] = omega(z + par[E_LOG])
        c[U, 0] = c[W, 0] / (1.0 + c[W, 0])
    for k in range(degree):
        first = 1.0 if k == 0 else 0.0
        per = 1.0 / (k + 1)
        closing = product(c[B], c[Q], k)
        I_F, J = per_w * c[W, k] - first * leak, leak * c[X, k]
        to_y = unit * (par[LAMBDA] * (first * par[DIVIDER] - c[Y, k]) + closing)
        to_y += to_a * (I_F * par[PER_F] + J * par[PER_R])
        to_v = 0.0
        if not held:
            to_v = to_c2 * (I_F - J * r + first * par[T1_BIAS])
            to_v -= unit * c[V, k] / par[TAU_L]
        c[TO_Y, k], c[TO_V, k] = to_y, to_v
        c[Y, k + 1], c[V, k + 1] = per * to_y, per * to_v
        J_v = leak / v_t * (c[X, k] + first)
        F_v = 0.0
        if direct:
            F_y = -c[W, k] / v_t
        else:
            F_v = leak / (a * v_t) * (product(c[U], c[X], k) + c[U, k])
            F_y = -c[U, k] / (a * par[R_E]) - F_v
        c[A11, k] = -unit * (first * par[LAMBDA] + (closing + c[B, k]) / v_t)
        c[A11, k] += to_a * (F_y * par[PER_F] - J_v * par[PER_R])
        c[A12, k] = c[A21, k] = c[A22, k] = 0.0
        if not held:
            c[A12, k] = to_a * (F_v * par[PER_F] + J_v * par[PER_R])
            c[A21, k] = to_c2 * (F_y + J_v * r)
            c[A22, k] = to_c2 * (F_v - J_v * r) - first * unit / par[TAU_L]
        for m in range(Y_BY_1, Y_BY_2 + 1):
            moved_y, moved_v = c[m], c[m + 2]
            moved_y[k + 1] = per * (
                product(c[A11], moved_y, k) + product(c[A12], moved_v, k)
            )
            moved_v[k + 1] = per * (
                product(c[A21], moved_y, k) + product(c[A22], moved_v, k)
            )
        c[B, k + 1] = per * par[PER_VOLT] * product(c[G], c[B], k)
        c[G, k + 1] = -per * unit / par[TAU] * c[G, k]
        c[Q, k + 1] = -per / v_t * (product(c[TO_Y], c[Q], k) + to_y)
        apart = -to_y if held else to_v - to_y
        c[APART, k] = apart
        c[X, k + 1] = per / v_t * (product(c[APART], c[X], k) + apart)
        if direct:
            c[W, k + 1] = -per / v_t * product(c[TO_Y], c[W], k)
            continue
        c[Z, k] = (par[R_E] * leak * (k + 1) * c[X, k + 1] - to_y) / v_t
        c[W, k + 1] = w = per * product(c[Z], c[U], k)
        c[U, k + 1] = 0.0
        inside = product(c[W], c[U], k + 1)
        c[U, k + 1] = (w - inside) / (1.0 + c[W, 0])


@inner
def value(row: FloatArray, degree: int, x: float) -> float:
    """The series at x units."""
    total = row[degree]
    for k in range(degree - 1, -1, -1):
        total = total * x + row[k]
    return float(total)


@inner
def reached(c: FloatArray, degree: int, wanted: float) -> float:
    """How far the series go before their last two terms exceed `wanted`, units."""
    far = 1e300
    for k in (degree - 1, degree):
        size = max(abs(c[Y, k]), abs(c[V, k]), 1e-300)
        far = min(far, (wanted / size) ** (1.0 / k))
    return far


@inner
def highest(row: FloatArray, degree: int, x: float) -> float:
    """What the series does not exceed up to x units."""
    total = abs(row[degree])
    for k in range(degree - 1, 0, -1):
        total = total * x + abs(row[k])
    return float(row[0] + total * x)


@inner
def to_chebyshev(
    row: FloatArray, degree: int, x: float, part: FloatArray, a: FloatArray
) -> None:
    """The series from 0 to x units as one of Chebyshev's, its last digits kept."""
    part[0] = 0.0
    for i in range(1, ORDER + 1):
        at = x * POINTS[i]
        total = row[degree]
        for k in range(degree - 1, 0, -1):
            total = total * at + row[k]
        part[i] = total * at
    to_series(part, a)
    a[0] += row[0]


@inner
def end_at(c: FloatArray, degree: int, x: float, step: FloatArray) -> None:
    """Let the step end after x units."""
    step[Y_END], step[V_END] = value(c[Y], degree, x), value(c[V], degree, x)
    for m in range(4):
        step[MOVED + m] = value(c[Y_BY_1 + m], degree, x)


@inner
def expanded(
    s: float, room: float, y: float, v: float, held: bool, V0: float, p: float,
    rate: float, wanted: float, par: FloatArray, f: FloatArray, c: FloatArray,
    step: FloatArray,
) -> int:  # fmt: skip
    """A step from s of at most `room` s that misses `wanted` V; returns its degree.

    Its error is told by how far the series' slope at the end is from the equations'
    there. Returns 0 where not accuracy but stability would keep it short.
    """
    degree = degree_for(wanted)
    unit = 1.0 / rate
    expand(s, y, v, held, V0, p, unit, degree, par, c)
    x = reached(c, degree, wanted)
    step[LENGTH] = (x if x > 0.1 else 0.1) * unit
    if not x < MOST_UNITS:
        return 0
    x = min(x, room * rate)
    for _ in range(8):
        end_at(c, degree, x, step)
        B_end = B_at(V_P_at(s + x * unit, V0, p, par[TAU]), par)
        flow(B_end, step[Y_END], step[V_END], held, par, f)
        share = SAFETY * x / (degree + 1)
        left_1 = share * abs(unit * f[TO_A] - value(c[TO_Y], degree - 1, x))
        left_2 = share * abs(unit * f[TO_C2] - value(c[TO_V], degree - 1, x))
        if max(left_1, left_2) <= 3.0 * wanted:
            step[LENGTH] = x * unit if x < room * rate else room
            step[LEFT_1] = step[STAYS_1] = left_1
            step[LEFT_2] = step[STAYS_2] = left_2
            step[GROWTH], step[UNITS] = 1.0, x
            return degree
        x *= 0.7
    return 0
