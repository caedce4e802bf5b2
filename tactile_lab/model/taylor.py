"""A step of V_C1 and V_C2 where T1 saturates, as power series: where it is not stiff.

How far the series go, where they end, what they miss there, and what either voltage at
the start moves, which needs no such digits (see `magnus`).
"""

from __future__ import annotations

import math

from tactile_lab.arrays import FloatArray
from tactile_lab.model.compiled import inner
from tactile_lab.model.integrator import to_series
from tactile_lab.model.lanes import apart, load, negative, same
from tactile_lab.model.magnus import moved
from tactile_lab.model.node_a import TAU, B_at, V_P_at
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
    TURN,
    V_END,
    V_P_END,
    Y_END,
    flow_near,
    with_node_a,
)
from tactile_lab.model.power_series import (
    FADES,
    FOURS,
    MOST,
    ROW,
    SLOPES,
    V_C1,
    V_C2,
    VOLTAGES,
    expand,
    four_at,
)
from tactile_lab.model.stretched_time import pace_at, stretch, time_at, w_at
from tactile_lab.model.tableau import ORDER, POINTS
from tactile_lab.model.transistor import (
    A_BY_1,
    A_BY_2,
    C2_BY_1,
    C2_BY_2,
    TO_A,
    TO_C2,
    of_junctions,
)

LEAST = 10
"""Lowest degree of a series."""
SAFETY, AIM = 2.0, 0.3
"""By how much the error told is larger than found, and the part of what is wanted that
steps are made for, as they reach all of it."""
FARTHEST, USUAL = 0.95, 0.5
"""Steps end where w is no more than the first, and mostly less than the second."""


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
def reached(c: FloatArray, degree: int, wanted: float) -> tuple[float, bool]:
    """How far the series go before their last two terms exceed `wanted`, as w.

    And whether what bounds it is that they would not be stable farther. The last term
    counts for what it is beside the one before at w = USUAL.
    """
    k = degree - 1
    size = max(abs(c[k, V_C1]), abs(c[k, V_C2]))
    size = max(size, USUAL * max(abs(c[degree, V_C1]), abs(c[degree, V_C2])), 1e-300)
    fades = max(abs(c[k, FADES]), USUAL * abs(c[degree, FADES]), 1e-300)
    room, stable = wanted / size, 0.5 / fades
    far = math.exp(math.log(min(room, stable)) / k)
    return min(far, FARTHEST), stable < min(room, 1.0)


@inner
def down(c: FloatArray, first: int, row: int, degree: int, x: float) -> float:
    """Sum of the terms below 0 of V_C2 or its slope at w = x, from `row` on.

    Over w^row: `first` tells which of the two, as `power_series` has them.
    """
    top, square = ROW * (degree - (degree - row) % 2) + first, same(x * x)
    even, odd = negative(load(c, top)), negative(load(c, top + ROW))
    for n in range(top - 2 * ROW, ROW * row + first - 1, -2 * ROW):
        even = negative(load(c, n)) + even * square
        odd = negative(load(c, n + ROW)) + odd * square
    return apart(even + odd * same(x))[1]


@inner
def highest(c: FloatArray, degree: int, x: float, end: float) -> float:
    """What V_C2 does not exceed up to w = x, where it is `end`.

    Above the chord between both lie only the terms that curve it down.
    """
    return float(max(c[0, V_C2], end) - down(c, VOLTAGES, 2, degree, x) * x * x)


@inner
def V_C2_at(c: FloatArray, degree: int, w: float) -> float:
    """V_C2 at w, V."""
    return apart(four_at(c, VOLTAGES, degree, w))[1]


@inner
def rising(
    c: FloatArray, degree: int, x: float, level: float, end: float, enough: float
) -> float:  # fmt: skip
    """The w at which V_C2 rises through `level`, to within `enough` V, 2 for nowhere.

    It is `end` at w = x. 0 where its terms do not prove that it rises all the way.
    """
    start, slope = c[0, V_C2], c[0, SLOPES + 1]
    if start >= level or slope + down(c, SLOPES, 1, degree, x) * x <= 0.0:
        return 0.0
    if end < level:
        return 2.0
    low, high = 0.0, x
    w: float = x * (level - start) / (end - start)
    for _ in range(100):
        above = V_C2_at(c, degree, w) - level
        if abs(above) <= enough or high - low <= 1e-16 * x:
            break
        if above > 0.0:
            high = w
        else:
            low = w
        w -= above / apart(four_at(c, SLOPES, degree, w))[1]
        if not low < w < high:
            w = 0.5 * (low + high)
    return w


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
    x: float, held: bool, V_P: float, p: float, degree: int, par: FloatArray,
    c: FloatArray, g: FloatArray, step: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """Let the step that starts at V_P end at w = x; g becomes `flow` there.

    Returns the slopes of both series there, V.
    """
    y, v, _, _ = apart(four_at(c, VOLTAGES, degree, x))
    to_y, to_v, _, _ = apart(four_at(c, SLOPES, degree, x))
    _, near, _, _ = apart(four_at(c, FOURS, degree, x))
    h = time_at(x, step[STRETCH], step[TURN])
    V_P = V_P_at(h, V_P, p, par[TAU])
    step[Y_END], step[V_END], step[LENGTH], step[REACH] = y, v, h, x
    step[V_P_END] = V_P
    flow_near(B_at(V_P, par), y, v, near, held, par, g)
    return to_y, to_v


@inner
def move(
    held: bool, degree: int, par: FloatArray, c: FloatArray, f: FloatArray,
    m: FloatArray, g: FloatArray, step: FloatArray,
) -> None:  # fmt: skip
    """Fill what a volt at the start moves at the end; f and g are `flow` there.

    In the middle the series tell it; Simpson's points are in w.
    """
    L, turn, x = step[STRETCH], step[TURN], step[REACH]
    P_m, W_m, held_back, B_m = apart(four_at(c, FOURS, degree, 0.5 * x))
    of_junctions(P_m - 1.0, W_m, par, m)
    # of the Jacobian, not the slopes: it depends on no voltage but by these
    with_node_a(held_back - B_m, held_back, 0.0, 0.0, held, par, m)
    k = x / 6.0
    middle, last = pace_at(0.5 * x, L, turn), pace_at(x, L, turn)
    moved(k * L, 4.0 * k * middle, k * last, f, m, g, step)


@inner
def expanded(
    room: float, y: float, v: float, held: bool, V_P: float, p: float,
    rate: float, wanted: float, degree: int, par: FloatArray, f: FloatArray,
    g: FloatArray, c: FloatArray, step: FloatArray,
) -> int:  # fmt: skip
    """A step from where `flow` is f that misses `wanted` V; returns its degree.

    Its error is told by how far the series' slope at the end is from the equations'
    there, which are left in `g`. It takes `room` s at most. Returns 0 where none is
    short enough.
    """
    L, turn = stretch(f, rate, held, par)
    step[STRETCH], step[TURN] = L, turn
    expand(y, v, held, V_P, p, rate, L, turn, degree, par, f, c)
    aim = AIM * wanted
    x, stiff = reached(c, degree, aim)
    first = max(time_at(x, L, turn), 0.1 / rate)
    whole = time_at(x, L, turn) >= room
    if whole:
        x = w_at(room, L, turn)
    for _ in range(8):
        to_y, to_v = end_at(x, held, V_P, p, degree, par, c, g, step)
        share, pace = SAFETY * x / (degree + 1), pace_at(x, L, turn)
        left_1 = share * abs(pace * g[TO_A] - to_y)
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
