"""V_C1 and V_C2 where T1 saturates, as power series in time: for steps not stiff.

All coefficients follow from the state by recursion, as every function in the equations
solves a differential equation itself: x = exp(g) has x' = x g', and Wright's omega w of
z has w' = w g' with g' = z' - w', for w + ln w = z. Time is counted in units of the
fastest rate, so that no coefficient leaves the range of numbers. What either voltage at
the start moves needs no such digits: it is Magnus's exponential of the Jacobian, of
order 4.
"""

from __future__ import annotations

import math

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model.compiled import inner
from tactile_lab.model.integrator import DIRECT, TAU_L, to_series
from tactile_lab.model.node_a import DIVIDER, LAMBDA, PER_VOLT, TAU, V_T, B_at, V_P_at
from tactile_lab.model.pair import (
    GROWTH,
    LEFT_1,
    LEFT_2,
    LENGTH,
    MOVED,
    STAYS_1,
    STAYS_2,
    TERMS,
    UNITS,
    V_END,
    Y_END,
    flow_near,
    with_node_a,
)
from tactile_lab.model.tableau import ORDER, POINTS
from tactile_lab.model.transistor import (
    A_BY_1,
    A_BY_2,
    C2_BY_1,
    C2_BY_2,
    I_S1,
    OF_Q,
    OF_W,
    OF_X,
    PER_F,
    PER_R,
    R_E,
    T1_BIAS,
    T1_C1,
    T1_C2,
    TO_A,
    TO_C2,
    of_junctions,
)

LEAST, MOST = 10, 30
"""Lowest and highest degree of a series."""
PER = 1.0 / np.arange(1.0, MOST + 1.0)
SAFETY = 2.0
Y, V, TO_Y, TO_V, G, B, Q, P, APART, W, LOG = range(11)
"""Rows: V_C1 and V_C2, V; their slopes, V per unit; slope of V_P; B;
exp(-V_C1/V_T) - 1; 1 + J/I_T1s and the slope of its logarithm, (V_C2 - V_C1)/V_T;
omega or, with "direct", I_F + I_T1s, and the slope of its logarithm."""
ROWS = 11
ROUNDING = 1e-17
"""A term below this share of the first is nothing."""
NOTHING = 1e-20
"""A junction's exponential below this is left out: the rest of its series is, too."""


@inner
def product(c: FloatArray, one: int, two: int, n: int) -> float:
    """Coefficient n of the product of two rows of `c`: four sums, none waits."""
    p = q = r = s = 0.0
    j = 0
    while j + 3 <= n:
        p += c[one, j] * c[two, n - j]
        q += c[one, j + 1] * c[two, n - j - 1]
        r += c[one, j + 2] * c[two, n - j - 2]
        s += c[one, j + 3] * c[two, n - j - 3]
        j += 4
    while j <= n:
        p += c[one, j] * c[two, n - j]
        j += 1
    return (p + q) + (r + s)


@inner
def degree_for(wanted: float) -> int:
    """The degree that costs least where a step may miss by `wanted` V."""
    return min(max(int(0.7 * math.log(3.0 / wanted)) + 8, LEAST), MOST)


@inner
def longest(degree: int) -> float:
    """Units up to which a series of exp(-x) to that degree stays below 1/2."""
    return 0.37 * degree + 1.0


@inner
def fastest(f: FloatArray) -> float:
    """Magnitude of the largest eigenvalue of `flow`'s Jacobian, 1/s, at least."""
    half = 0.5 * (f[A_BY_1] - f[C2_BY_2])
    square = half * half + f[A_BY_2] * f[C2_BY_1]
    rate: float = math.sqrt(abs(square)) - 0.5 * (f[A_BY_1] + f[C2_BY_2])
    return rate


@inner
def expand_B(
    V_P: float, p: float, unit: float, degree: int, par: FloatArray, c: FloatArray
) -> int:
    """Fill the rows G and B from B's first; returns how many are not rounding."""
    c[G, 0] = unit * (p - V_P / par[TAU])
    leak, far = -unit / par[TAU], longest(degree)
    # what matters at the end of the longest step
    least = far * ROUNDING * c[B, 0]
    for k in range(degree):
        total = 0.0
        for j in range(k + 1):
            total += c[G, j] * c[B, k - j]
        c[B, k + 1] = par[PER_VOLT] * total * PER[k]
        c[G, k + 1] = leak * c[G, k] * PER[k]
        least /= far
        if max(abs(c[B, k]), far * abs(c[B, k + 1])) <= least:
            for j in range(k, degree + 1):
                c[B, j] = 0.0
            return k
    return degree


@inner
def slopes_known(c: FloatArray, k: int) -> tuple[float, float]:
    """Coefficient k of the slopes of P and W but for what it takes APART and LOG there.

    Both at once, of two sums each: none waits for another.
    """
    of_P = of_W = more_P = more_W = 0.0
    j = k % 2
    if j:
        of_P, of_W = c[APART, 0] * c[P, k], c[LOG, 0] * c[W, k]
    while j < k:
        of_P += c[APART, j] * c[P, k - j]
        of_W += c[LOG, j] * c[W, k - j]
        more_P += c[APART, j + 1] * c[P, k - j - 1]
        more_W += c[LOG, j + 1] * c[W, k - j - 1]
        j += 2
    return of_P + more_P, of_W + more_W


@inner
def expand(
    s: float, y: float, v: float, held: bool, V0: float, p: float, unit: float,
    degree: int, par: FloatArray, f: FloatArray, c: FloatArray,
) -> int:  # fmt: skip
    """Fill the rows of `c` at s after the segment's start, where `flow` is f.

    Returns how many coefficients of B are more than rounding.
    """
    # B anew: at the end of a step before, its series had it, to rounding each time
    V_P = V_P_at(s, V0, p, par[TAU])
    c[B, 0], c[Q, 0] = B_at(V_P, par), f[OF_Q]
    few = expand_B(V_P, p, unit, degree, par, c)
    v_t, leak, direct = par[V_T], par[I_S1], par[DIRECT] != 0.0
    per_t = 1.0 / v_t
    open_1 = 1.0 + c[Q, 0] > NOTHING
    W_0, P_0 = f[OF_W], 1.0 + f[OF_X]
    P_0 = P_0 if P_0 > NOTHING else 0.0
    # what each coefficient of P and W gives to both slopes
    to_a, to_c2 = unit / par[T1_C1], 0.0 if held else unit / par[T1_C2]
    per_w = 1.0 if direct else v_t / ((1.0 + par[PER_F]) * par[R_E])
    P_to_y, P_to_v = to_a * leak * par[PER_R], -to_c2 * leak * (1.0 + par[PER_R])
    W_to_y, W_to_v = to_a * per_w * par[PER_F], to_c2 * per_w
    leak_1, leak_2 = unit * par[LAMBDA], 0.0 if held else unit / par[TAU_L]
    # what stands still, of no further coefficient
    still_y = leak_1 * par[DIVIDER] - to_a * leak * (par[PER_F] + par[PER_R])
    still_v = to_c2 * (par[T1_BIAS] + leak * par[PER_R])
    # what they give to those of P and W: with R3, z' = to_z P' - V_C1'/V_T
    emitter = 0.0 if direct else 1.0
    to_z = emitter * par[R_E] * leak * per_t
    own = 1.0 / (1.0 + emitter * W_0)
    by = P_0 * per_t
    known_P, by_v = own * W_0 * to_z, own * W_0 * to_z * by
    by_y = by_v + own * W_0 * per_t
    c[Y, 0], c[V, 0], c[P, 0], c[W, 0] = y_k, v_k, P_k, W_k = y, v, P_0, W_0
    for k in range(degree):
        per = PER[k]
        of_P, of_W = slopes_known(c, k)
        closing = 0.0
        if open_1:
            for j in range(min(k, few) + 1):
                closing += c[B, j] * c[Q, k - j]
        else:
            closing = -c[B, k]
        # the last coefficients at last: all else waits for them
        to_y = (unit * closing + still_y - leak_1 * y_k + P_to_y * P_k) + W_to_y * W_k
        to_v = (still_v - leak_2 * v_k + P_to_v * P_k) + W_to_v * W_k
        still_y = still_v = 0.0
        to_W = (own * of_W + known_P * of_P) + (by_v * to_v - by_y * to_y)
        to_P = of_P + by * (to_v - to_y)
        y_k, v_k, P_k, W_k = per * to_y, per * to_v, per * to_P, per * to_W
        c[TO_Y, k], c[TO_V, k], c[APART, k] = to_y, to_v, (to_v - to_y) * per_t
        c[LOG, k] = (to_z * to_P - to_y * per_t) - emitter * to_W
        c[Y, k + 1], c[V, k + 1], c[P, k + 1], c[W, k + 1] = y_k, v_k, P_k, W_k
        c[Q, k + 1] = 0.0
        if open_1:
            c[Q, k + 1] = -per * per_t * (product(c, TO_Y, Q, k) + to_y)
    # sums take two terms at a time
    c[TO_Y, degree] = c[TO_V, degree] = 0.0
    for n in range(ROWS):
        c[n, degree + 1] = 0.0
    return few


@inner
def B_of(c: FloatArray, few: int, x: float) -> float:
    """B's series at x units, of which the terms from `few` on are rounding."""
    total = 0.0
    for k in range(few - 1, -1, -1):
        total = total * x + c[B, k]
    return total


@inner
def two_at(
    c: FloatArray, one: int, two: int, degree: int, x: float
) -> tuple[float, float]:
    """Two of the series at x units: even and odd terms apart, none waits for long."""
    top, square = degree - degree % 2, x * x
    a, odd_a = c[one, top], c[one, top + 1]
    b, odd_b = c[two, top], c[two, top + 1]
    for k in range(top - 2, -1, -2):
        a, odd_a = a * square + c[one, k], odd_a * square + c[one, k + 1]
        b, odd_b = b * square + c[two, k], odd_b * square + c[two, k + 1]
    return a + x * odd_a, b + x * odd_b


@inner
def ends_at(
    c: FloatArray, degree: int, x: float
) -> tuple[float, float, float, float, float]:
    """V_C1, V_C2, their slopes and W after x units, as `two_at` has them."""
    top, square = degree - degree % 2, x * x
    a, odd_a = c[Y, top], c[Y, top + 1]
    b, odd_b = c[V, top], c[V, top + 1]
    p, odd_p = c[TO_Y, top], c[TO_Y, top + 1]
    q, odd_q = c[TO_V, top], c[TO_V, top + 1]
    w, odd_w = c[W, top], c[W, top + 1]
    for k in range(top - 2, -1, -2):
        a, odd_a = a * square + c[Y, k], odd_a * square + c[Y, k + 1]
        b, odd_b = b * square + c[V, k], odd_b * square + c[V, k + 1]
        p, odd_p = p * square + c[TO_Y, k], odd_p * square + c[TO_Y, k + 1]
        q, odd_q = q * square + c[TO_V, k], odd_q * square + c[TO_V, k + 1]
        w, odd_w = w * square + c[W, k], odd_w * square + c[W, k + 1]
    return a + x * odd_a, b + x * odd_b, p + x * odd_p, q + x * odd_q, w + x * odd_w


@inner
def reached(c: FloatArray, degree: int, wanted: float) -> float:
    """How far the series go before their last two terms exceed `wanted`, units."""
    far = 600.0
    for k in (degree - 1, degree):
        size = max(abs(c[Y, k]), abs(c[V, k]), 1e-300)
        far = min(far, math.log(wanted / size) / k)
    return math.exp(far)


@inner
def highest(row: FloatArray, degree: int, x: float) -> float:
    """What the series does not exceed up to x units."""
    top, square = degree - degree % 2, x * x
    even, odd = abs(row[top]), abs(row[top + 1])
    for k in range(top - 2, 0, -2):
        even = even * square + abs(row[k])
        odd = odd * square + abs(row[k + 1])
    return float(row[0] + (even * x + odd * square + abs(row[1])) * x)


@inner
def to_chebyshev(
    row: FloatArray, degree: int, x: float, part: FloatArray, a: FloatArray
) -> None:
    """The series from 0 to x units as one of Chebyshev's, its last digits kept."""
    for i in range(ORDER + 1):
        part[i] = row[degree]
    for k in range(degree - 1, 0, -1):
        for i in range(ORDER + 1):  # side by side: none waits for another
            part[i] = part[i] * (x * POINTS[i]) + row[k]
    for i in range(ORDER + 1):
        part[i] *= x * POINTS[i]
    to_series(part, a)
    a[0] += row[0]


@inner
def moved(
    h: float, a: FloatArray, m: FloatArray, b: FloatArray, step: FloatArray
) -> None:
    """What a volt at the start moves at the end of h s: `flow` at start, middle, end.

    Magnus's exponential of order 4: of Simpson's mean of the Jacobians less h^2/12
    times the first one's commutator with the last.
    """
    k = h / 6.0
    p = k * (a[A_BY_1] + 4.0 * m[A_BY_1] + b[A_BY_1])
    q = k * (a[A_BY_2] + 4.0 * m[A_BY_2] + b[A_BY_2])
    r = k * (a[C2_BY_1] + 4.0 * m[C2_BY_1] + b[C2_BY_1])
    s = k * (a[C2_BY_2] + 4.0 * m[C2_BY_2] + b[C2_BY_2])
    k = h * h / 12.0
    turn = k * (a[A_BY_2] * b[C2_BY_1] - b[A_BY_2] * a[C2_BY_1])
    apart_a, apart_b = a[A_BY_1] - a[C2_BY_2], b[A_BY_1] - b[C2_BY_2]
    p, s = p - turn, s + turn
    q -= k * (apart_a * b[A_BY_2] - apart_b * a[A_BY_2])
    r += k * (apart_a * b[C2_BY_1] - apart_b * a[C2_BY_1])
    mean, half = 0.5 * (p + s), 0.5 * (p - s)
    square = half * half + q * r
    root = math.sqrt(abs(square))
    if square > 0.0 and root > 300.0:
        # the other eigenvalue has nothing left to say
        even = 0.5 * math.exp(mean + root)
        mean, odd = 0.0, even / root
    elif root < 1e-3:
        even, odd = 1.0 + 0.5 * square, 1.0 + square / 6.0
    elif square > 0.0:
        up = math.exp(root)
        even, odd = 0.5 * (up + 1.0 / up), 0.5 * (up - 1.0 / up) / root
    else:
        even, odd = math.cos(root), math.sin(root) / root
    scale = math.exp(mean)
    step[MOVED], step[MOVED + 1] = scale * (even + odd * half), scale * odd * q
    step[MOVED + 2], step[MOVED + 3] = scale * odd * r, scale * (even - odd * half)


@inner
def rested(
    h: float, y: float, v: float, f: FloatArray, a: FloatArray, b: FloatArray,
    step: FloatArray,
) -> None:  # fmt: skip
    """A step of h s on which both voltages stay where they are, to rounding.

    It is wrong by how far the equilibrium is, which `flow` at the start tells.
    """
    for i in range(ORDER + 1):
        a[i] = b[i] = 0.0
    a[0], b[0] = y, v
    step[Y_END], step[V_END] = y, v
    moved(h, f, f, f, step)
    # Cramer's rule
    by_all = abs(f[A_BY_1] * f[C2_BY_2] - f[A_BY_2] * f[C2_BY_1])
    one, two = abs(f[TO_A]), abs(f[TO_C2])
    step[LEFT_1] = (one * abs(f[C2_BY_2]) + two * abs(f[A_BY_2])) / by_all
    step[LEFT_2] = (one * abs(f[C2_BY_1]) + two * abs(f[A_BY_1])) / by_all
    step[STAYS_1], step[STAYS_2] = step[LEFT_1], step[LEFT_2]
    step[LENGTH], step[GROWTH], step[UNITS] = h, 1.0, 1e300


@inner
def end_at(
    s: float, x: float, unit: float, held: bool, V0: float, p: float, degree: int,
    par: FloatArray, c: FloatArray, g: FloatArray, step: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """Let the step end after x units; g becomes `flow` there.

    Returns the slopes of both series there, V per unit.
    """
    y, v, to_y, to_v, near = ends_at(c, degree, x)
    step[Y_END], step[V_END] = y, v
    few = int(step[TERMS])
    if few < degree:
        B_end = B_of(c, few, x)
    else:
        B_end = B_at(V_P_at(s + x * unit, V0, p, par[TAU]), par)
    flow_near(B_end, y, v, near, held, par, g)
    return to_y, to_v


@inner
def move(
    x: float, unit: float, held: bool, degree: int, par: FloatArray, c: FloatArray,
    f: FloatArray, m: FloatArray, g: FloatArray, step: FloatArray,
) -> None:  # fmt: skip
    """Fill what a volt at the start moves after x units; f and g are `flow` there.

    In the middle the series tell it.
    """
    P_m, W_m = two_at(c, P, W, degree, 0.5 * x)
    B_m, Q_m = c[B, 0], -1.0
    if 1.0 + c[Q, 0] > NOTHING:
        B_m, Q_m = two_at(c, B, Q, degree, 0.5 * x)
    of_junctions(P_m - 1.0, W_m, par, m)
    # of the Jacobian, not the slopes: it depends on no voltage but by these
    with_node_a(B_m, Q_m, 1.0 + Q_m, 0.0, 0.0, held, par, m)
    moved(x * unit, f, m, g, step)


@inner
def expanded(
    s: float, room: float, y: float, v: float, held: bool, V0: float, p: float,
    rate: float, wanted: float, degree: int, par: FloatArray, f: FloatArray,
    g: FloatArray, c: FloatArray, step: FloatArray,
) -> int:  # fmt: skip
    """A step from s, where `flow` is f, that misses `wanted` V; returns its degree.

    Its error is told by how far the series' slope at the end is from the equations'
    there, which are left in `g`. It takes `room` s at most. Returns 0 where none is
    short enough.
    """
    unit = 1.0 / rate
    step[TERMS] = expand(s, y, v, held, V0, p, unit, degree, par, f, c)
    x = reached(c, degree, wanted)
    step[LENGTH] = (x if x > 0.1 else 0.1) * unit
    x = min(x, longest(degree), room * rate)
    for _ in range(8):
        to_y, to_v = end_at(s, x, unit, held, V0, p, degree, par, c, g, step)
        share = SAFETY * x / (degree + 1)
        left_1 = share * abs(unit * g[TO_A] - to_y)
        left_2 = share * abs(unit * g[TO_C2] - to_v)
        if max(left_1, left_2) <= 3.0 * wanted:
            step[LENGTH] = x * unit if x < room * rate else room
            step[LEFT_1] = step[STAYS_1] = left_1
            step[LEFT_2] = step[STAYS_2] = left_2
            step[GROWTH], step[UNITS] = 1.0, x
            return degree
        x *= 0.7
    return 0
