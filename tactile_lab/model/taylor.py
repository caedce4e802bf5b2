"""V_C1 and V_C2 where T1 saturates, as power series: for steps not stiff.

All coefficients follow from the state by recursion, as every function in the equations
solves a differential equation itself: x = exp(g) has x' = x g', and Wright's omega W of
z has W' = W g' with g' = z' - W', for W + ln W = z. They hold in any variable; the
series are in w, in which no pole is near (see `stretched_time`), and what the equations
say of a derivative by time is stretched as time is. What either voltage at the start
moves needs no such digits (see `magnus`).
"""

from __future__ import annotations

import math

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model.compiled import inner
from tactile_lab.model.integrator import DIRECT, TAU_L, to_series
from tactile_lab.model.magnus import moved
from tactile_lab.model.node_a import DIVIDER, LAMBDA, PER_VOLT, TAU, V_T, B_at, V_P_at
from tactile_lab.model.pair import (
    GROWTH,
    LEFT_1,
    LEFT_2,
    LENGTH,
    REACH,
    STAYS_1,
    STAYS_2,
    STIFF,
    STRETCH,
    TERMS,
    TURN,
    V_END,
    Y_END,
    flow_near,
    with_node_a,
)
from tactile_lab.model.stretched_time import pace_at, stretch, time_at, w_at
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

LEAST, MOST = 10, 36
"""Lowest and highest degree of a series."""
PER = 1.0 / np.arange(1.0, MOST + 1.0)
SAFETY, AIM = 2.0, 0.3
"""By how much the error told is larger than found, and the part of what is wanted that
steps are made for, as they reach all of it."""
Y, V, TO_Y, TO_V, G, B, Q, P, APART, W, LOG, FADES, IN_TIME = range(13)
"""Rows: V_C1 and V_C2, V; their slopes by w; that of V_P; B; exp(-V_C1/V_T) - 1;
1 + J/I_T1s and the slope of its logarithm, (V_C2 - V_C1)/V_T; omega or, with "direct",
I_F + I_T1s, and the slope of its logarithm; exp(-rate t); B in time."""
ROWS = 13
FARTHEST = 0.95
"""A step ends where w is no more."""
LEFT_OUT = 0.02
"""What B's series leaves out may have this part of what is wanted."""
MOST_IN_TIME = 8
"""Highest degree of B's series in time."""
MOST_L = 2.0
"""Steps are of so many L at most, but for few."""
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
def fastest(f: FloatArray) -> float:
    """Magnitude of the largest eigenvalue of `flow`'s Jacobian, 1/s, at least."""
    half = 0.5 * (f[A_BY_1] - f[C2_BY_2])
    square = half * half + f[A_BY_2] * f[C2_BY_1]
    rate: float = math.sqrt(abs(square)) - 0.5 * (f[A_BY_1] + f[C2_BY_2])
    return rate


@inner
def expand_fast_B(
    turn: float, leak: float, degree: int, par: FloatArray, c: FloatArray
) -> None:
    """Fill the row B from its value and V_P's slope at first, by recursion in w."""
    now, last, before, one, two, three, four = c[G, 0], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    c[B, 0] = c[IN_TIME, 0]
    for k in range(degree):
        slope = (now - 2.0 * turn * last + before) + (2.0 * two - four)
        c[G, k] = slope
        c[B, k + 1] = par[PER_VOLT] * product(c, G, B, k) * PER[k]
        now, last, before = leak * slope * PER[k], now, last
        one, two, three, four = slope, one, two, three


@inner
def expand_B(
    V_P: float, p: float, L: float, turn: float, degree: int, enough: float,
    par: FloatArray, c: FloatArray,
) -> int:  # fmt: skip
    """Fill the rows B and, as a series in t/L, IN_TIME; returns the degree of that.

    It leaves out what gives V_C1 less than `enough` V, for V_P is slow; where it is
    not, only B is filled, and 0 returned.
    """
    leak, size = -L / par[TAU], L
    c[G, 0] = L * (p - V_P / par[TAU])
    c[IN_TIME, 0] = B_at(V_P, par)
    few = 0
    while True:
        if few == MOST_IN_TIME:
            expand_fast_B(turn, leak, degree, par, c)
            return 0
        total = 0.0
        for j in range(few + 1):
            total += c[G, j] * c[IN_TIME, few - j]
        c[IN_TIME, few + 1] = par[PER_VOLT] * total * PER[few]
        c[G, few + 1] = leak * c[G, few] * PER[few]
        few += 1
        size *= MOST_L
        if size * (abs(c[IN_TIME, few - 1]) + abs(c[IN_TIME, few])) < enough:
            break
    # t/L = w (1 - c w)/(1 - w^2) times the highest, then Horner's scheme
    one, two = c[IN_TIME, few], -turn * c[IN_TIME, few]
    for k in range(1, degree + 1, 2):
        c[B, k], c[B, k + 1] = one, two
    c[B, 0] = c[IN_TIME, few - 1]
    for n in range(few - 2, -1, -1):
        before, last, one, two = 0.0, c[B, 0], 0.0, 0.0
        c[B, 0] = c[IN_TIME, n]
        for k in range(1, degree + 1):
            now = c[B, k]
            one, two = two + (last - turn * before), one
            c[B, k] = one
            before, last = last, now
    return few


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
    s: float, y: float, v: float, held: bool, V0: float, p: float, rate: float,
    L: float, turn: float, degree: int, wanted: float, par: FloatArray,
    f: FloatArray, c: FloatArray,
) -> int:  # fmt: skip
    """Fill the rows of `c` at s after the segment's start, where `flow` is f.

    The last row is what exp(-rate t) would be: how far the series stay stable.
    """
    c[Q, 0] = f[OF_Q]
    v_t, leak, direct = par[V_T], par[I_S1], par[DIRECT] != 0.0
    per_t = 1.0 / v_t
    open_1 = 1.0 + c[Q, 0] > NOTHING
    W_0, P_0 = f[OF_W], 1.0 + f[OF_X]
    P_0 = P_0 if P_0 > NOTHING else 0.0
    # what each coefficient of P and W gives to both slopes
    to_a, to_c2 = L / par[T1_C1], 0.0 if held else L / par[T1_C2]
    per_w = 1.0 if direct else v_t / ((1.0 + par[PER_F]) * par[R_E])
    P_to_y, P_to_v = to_a * leak * par[PER_R], -to_c2 * leak * (1.0 + par[PER_R])
    W_to_y, W_to_v = to_a * per_w * par[PER_F], to_c2 * per_w
    leak_1, leak_2 = L * par[LAMBDA], 0.0 if held else L / par[TAU_L]
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
    V_P = V_P_at(s, V0, p, par[TAU])
    few = expand_B(V_P, p, L, turn, degree, LEFT_OUT * wanted, par, c)
    # slopes by w from L times those by time: (1 - w^2)^2 of the former are
    # (1 - 2 c w + w^2) of the latter
    turn *= 2.0
    more_y = more_v = more_e = 0.0
    of_y = of_v = of_e = y_1 = y_2 = y_3 = v_1 = v_2 = v_3 = e_1 = e_2 = e_3 = 0.0
    fade, fades = -L * rate, L * rate > 1.0
    e_k = 1.0 if fades else 0.0
    for k in range(degree):
        per = PER[k]
        if fades:
            last_e, of_e = of_e, fade * e_k
            to_e = of_e + more_e
            more_e = (last_e - turn * of_e) + (2.0 * e_1 - e_3)
            e_1, e_2, e_3 = to_e, e_1, e_2
            e_k = per * to_e
        c[FADES, k + 1] = e_k
        last_y, last_v = of_y, of_v
        of_P, of_W = slopes_known(c, k)
        closing = product(c, B, Q, k) if open_1 else -c[B, k]
        # the last coefficients at last: all else waits for them
        of_y = (L * closing + still_y - leak_1 * y_k + P_to_y * P_k) + W_to_y * W_k
        of_v = (still_v - leak_2 * v_k + P_to_v * P_k) + W_to_v * W_k
        still_y = still_v = 0.0
        to_y, to_v = of_y + more_y, of_v + more_v
        more_y = (last_y - turn * of_y) + (2.0 * y_1 - y_3)
        more_v = (last_v - turn * of_v) + (2.0 * v_1 - v_3)
        y_1, y_2, y_3, v_1, v_2, v_3 = to_y, y_1, y_2, to_v, v_1, v_2
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
def two_at(
    c: FloatArray, one: int, two: int, degree: int, x: float
) -> tuple[float, float]:
    """Two of the series at w = x: even and odd terms apart, none waits for long."""
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
    """V_C1, V_C2, their slopes and W at w = x, as `two_at` has them."""
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
def reached(c: FloatArray, degree: int, wanted: float) -> tuple[float, bool]:
    """How far the series go before their last two terms exceed `wanted`, as w.

    And whether what bounds it is that they would not be stable farther.
    """
    far, stiff = 0.0, False
    for k in (degree - 1, degree):
        room = wanted / max(abs(c[Y, k]), abs(c[V, k]), 1e-300)
        stable = 0.5 / max(abs(c[FADES, k]), 1e-300)
        reach = math.log(min(room, stable)) / k
        if reach < far:
            far, stiff = reach, stable < room
    return min(math.exp(far), FARTHEST), stiff


@inner
def highest(row: FloatArray, degree: int, x: float, end: float) -> float:
    """What the series does not exceed up to w = x, where it is `end`.

    Above the chord between both lie only the terms that curve it down.
    """
    top, square = degree - degree % 2, x * x
    even, odd = min(row[top], 0.0), min(row[top + 1], 0.0)
    for k in range(top - 2, 0, -2):
        even = even * square + min(row[k], 0.0)
        odd = odd * square + min(row[k + 1], 0.0)
    return float(max(row[0], end) - (even + x * odd) * square)


@inner
def to_chebyshev(
    row: FloatArray, degree: int, x: float, part: FloatArray, a: FloatArray
) -> None:
    """The series from 0 to w = x as one of Chebyshev's in w, its last digits kept."""
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
def in_time(
    row: FloatArray, degree: int, half: int, step: FloatArray, part: FloatArray,
    a: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """The first or second half of a step's series as one of Chebyshev's in time.

    Returns when it begins, s after the step, and how long it is.
    """
    L, turn = step[STRETCH], step[TURN]
    begins, length = 0.0, time_at(0.5 * step[REACH], L, turn)
    if half == 1:
        begins, length = length, step[LENGTH] - length
    first = 0.0
    for i in range(ORDER + 1):
        w = w_at(begins + length * POINTS[i], L, turn)
        value = 0.0
        for k in range(degree, 0, -1):
            value = (value + row[k]) * w
        first = value if i == 0 else first
        part[i] = value - first
    to_series(part, a)
    a[0] += row[0] + first
    return begins, length


@inner
def end_at(
    x: float, held: bool, degree: int, par: FloatArray, c: FloatArray, g: FloatArray,
    step: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """Let the step end at w = x; g becomes `flow` there.

    Returns the slopes of both series there, V.
    """
    y, v, to_y, to_v, near = ends_at(c, degree, x)
    h = time_at(x, step[STRETCH], step[TURN])
    step[Y_END], step[V_END], step[LENGTH], step[REACH] = y, v, h, x
    few = int(step[TERMS])
    row, u = (IN_TIME, h / step[STRETCH]) if few else (B, x)
    B_end = 0.0
    for k in range(few if few else degree, -1, -1):
        B_end = B_end * u + c[row, k]
    flow_near(B_end, y, v, near, held, par, g)
    return to_y, to_v


@inner
def move(
    held: bool, degree: int, par: FloatArray, c: FloatArray, f: FloatArray,
    m: FloatArray, g: FloatArray, step: FloatArray,
) -> None:  # fmt: skip
    """Fill what a volt at the start moves at the end; f and g are `flow` there.

    In the middle the series tell it.
    """
    x = w_at(0.5 * step[LENGTH], step[STRETCH], step[TURN])
    P_m, W_m = two_at(c, P, W, degree, x)
    B_m, Q_m = c[B, 0], -1.0
    if 1.0 + c[Q, 0] > NOTHING:
        B_m, Q_m = two_at(c, B, Q, degree, x)
    of_junctions(P_m - 1.0, W_m, par, m)
    # of the Jacobian, not the slopes: it depends on no voltage but by these
    with_node_a(B_m, Q_m, 1.0 + Q_m, 0.0, 0.0, held, par, m)
    moved(step[LENGTH], f, m, g, step)


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
    L, turn = stretch(f, rate, held, par)
    step[STRETCH], step[TURN] = L, turn
    step[TERMS] = expand(s, y, v, held, V0, p, rate, L, turn, degree, wanted, par, f, c)
    aim = AIM * wanted
    x, stiff = reached(c, degree, aim)
    first = max(time_at(x, L, turn), 0.1 / rate)
    whole = time_at(x, L, turn) >= room
    if whole:
        x = w_at(room, L, turn)
    for _ in range(8):
        to_y, to_v = end_at(x, held, degree, par, c, g, step)
        share, pace = SAFETY * x / (degree + 1), pace_at(x, L, turn)
        left_1 = share * abs(pace * g[TO_A] - to_y) + LEFT_OUT * wanted
        left_2 = share * abs(pace * g[TO_C2] - to_v)
        if max(left_1, left_2) <= 3.0 * aim:
            if whole:
                step[LENGTH] = room
            step[STIFF] = 1.0 if stiff and not whole else 0.0
            step[LEFT_1] = step[STAYS_1] = left_1
            step[LEFT_2] = step[STAYS_2] = left_2
            step[GROWTH] = 1.0
            return degree
        x *= 0.8
        whole = False
    step[LENGTH] = first
    return 0
