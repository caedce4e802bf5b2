"""V_C1 and V_C2 together where T1 saturates: one step, and where V_C2 first fires."""

from __future__ import annotations

import math

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model.compiled import inner
from tactile_lab.model.integrator import TAU_L, V_RESET, series_at, to_series
from tactile_lab.model.node_a import DIVIDER, LAMBDA, TAU, V_T, B_at, V_P_at
from tactile_lab.model.scratch import room_for
from tactile_lab.model.tableau import (
    DIFFERENTIATE,
    NODES,
    ORDER,
    POINTS,
    TO_SERIES,
)
from tactile_lab.model.threshold import crossing
from tactile_lab.model.transistor import (
    A_BY_1,
    A_BY_2,
    C2_BY_1,
    C2_BY_2,
    OF_B,
    OF_Q,
    TO_A,
    TO_C2,
    currents,
)
from tactile_lab.model.truncation import carried, longer, missing, unseen

MOST_ITERATIONS = 10
CLOSED = -50.0
"""Exponent below which an exponential is nothing beside 1."""
COLUMNS = 3
"""Right-hand sides: the correction, and the effect of either voltage at the start."""
LENGTH, Y_END, V_END, LEFT_1, LEFT_2, STAYS_1, STAYS_2, GROWTH = range(8)
"""A step: its length, s; both voltages at its end, V; what they are wrong by within it
and at its end, V; how much longer the next may be."""
STRETCH, TURN, REACH, STIFF, V_P_END = range(8, 13)
"""Where it is a power series: L and c of `stretched_time`, w at its end, whether it
would not be stable farther, and V_P at its end, V."""
MOVED = 13
"""From here on, what a volt at the start moves at the end: V_C1 by V_C1, by V_C2, V_C2
by V_C1, by V_C2."""
STEP = 17
"""Numbers of a step."""
series_room = room_for(ORDER + 1)


@inner
def with_node_a(
    closing: float, held_back: float, y: float, v: float, held: bool, par: FloatArray,
    f: FloatArray,
) -> None:  # fmt: skip
    """Add to T1's currents in `f` what Eqs. (16) and (18) have.

    T2's current gives V_C1 the slope `closing` = `held_back` - B, V/s, with `held_back`
    = B exp(-V_C1/V_T).
    """
    f[TO_A] += par[LAMBDA] * (par[DIVIDER] - y) + closing
    f[A_BY_1] -= par[LAMBDA] + held_back / par[V_T]
    if held:
        f[TO_C2] = f[A_BY_2] = f[C2_BY_1] = f[C2_BY_2] = 0.0
    else:
        f[TO_C2] -= v / par[TAU_L]
        f[C2_BY_2] -= 1.0 / par[TAU_L]


@inner
def flow(
    B: float, y: float, v: float, held: bool, par: FloatArray, f: FloatArray
) -> None:
    """Eqs. (16) and (18) with T1's currents: dV_C1/dt, dV_C2/dt and the Jacobian.

    While the firing stage conducts (`held`), it keeps T1's collector at V_reset.
    """
    flow_near(B, y, v, 0.0, held, par, f)


@inner
def flow_near(
    B: float, y: float, v: float, near: float, held: bool, par: FloatArray,
    f: FloatArray,
) -> None:  # fmt: skip
    """`flow`, where T1's omega is `near` a value that is known."""
    currents(y, par[V_RESET] if held else v, near, par, f)
    x = -y / par[V_T]
    if x < CLOSED:
        q, Q = 0.0, -1.0
    elif x < -1.0:
        q = math.exp(x)
        Q = q - 1.0
    else:
        Q = math.expm1(x)
        q = 1.0 + Q
    f[OF_B], f[OF_Q] = B, Q
    with_node_a(B * Q, B * q, y, v, held, par, f)


@inner
def eliminate_all(matrix: FloatArray, right: FloatArray, columns: int) -> None:
    """Solve in place for the first `columns` of `right`, two pivots at a time.

    Without pivoting, as `node_a.eliminate`: the rows are scaled by the rates in them.
    """
    n = right.shape[0]
    for k in range(0, n, 2):
        p, q = matrix[k, k], matrix[k, k + 1]
        u = matrix[k + 1, k] / p
        r = matrix[k + 1, k + 1] - u * q
        matrix[k + 1, k + 1] = r
        for j in range(k + 2, n):
            matrix[k + 1, j] -= u * matrix[k, j]
        for c in range(columns):
            right[k + 1, c] -= u * right[k, c]
        by_p, by_r = 1.0 / p, 1.0 / r
        for i in range(k + 2, n):
            one = matrix[i, k] * by_p
            two = (matrix[i, k + 1] - one * q) * by_r
            for j in range(k + 2, n):
                matrix[i, j] -= one * matrix[k, j] + two * matrix[k + 1, j]
            for c in range(columns):
                right[i, c] -= one * right[k, c] + two * right[k + 1, c]
    for c in range(columns):
        for k in range(n - 2, -1, -2):
            one, two = right[k, c], right[k + 1, c]
            for j in range(k + 2, n):
                one -= matrix[k, j] * right[j, c]
                two -= matrix[k + 1, j] * right[j, c]
            right[k + 1, c] = two / matrix[k + 1, k + 1]
            right[k, c] = (one - matrix[k, k + 1] * right[k + 1, c]) / matrix[k, k]


@inner
def collocate_pair(
    s: float,
    h: float,
    y0: float,
    v0: float,
    held: bool,
    V0: float,
    p: float,
    low: float,
    high: float,
    most: float,
    wanted: float,
    par: FloatArray,
    W: FloatArray,
    f: FloatArray,
    matrix: FloatArray,
    right: FloatArray,
) -> tuple[int, float]:
    """One step from s to s + h: fill W with V_C1 - y0, then V_C2 - v0 at the nodes.

    Newton's iterates keep V_C1 in [low, high] and V_C2 - V_C1 below `most`, as the
    exact solution does. The last columns of `right` then hold the change of either
    voltage by either at the start. Returns the iterations, or -1, and what another one
    would still change, V: a thousandth of `wanted` at most.
    """
    n = ORDER
    enough = math.sqrt(2e-3 * wanted * par[V_T])
    for i in range(2 * n):
        W[i] = 0.0
    for iteration in range(MOST_ITERATIONS):
        for i in range(n):
            B = B_at(V_P_at(s + h * NODES[i], V0, p, par[TAU]), par)
            flow(B, y0 + W[i], v0 + W[n + i], held, par, f)
            up = 1.0 / (1.0 + h * (abs(f[A_BY_1]) + abs(f[A_BY_2])))
            down = 1.0 / (1.0 + h * (abs(f[C2_BY_1]) + abs(f[C2_BY_2])))
            one, two = h * f[TO_A], h * f[TO_C2]
            for j in range(n):
                d = DIFFERENTIATE[i, j]
                one -= d * W[j]
                two -= d * W[n + j]
                matrix[i, j] = d * up
                matrix[n + i, n + j] = d * down
                matrix[i, n + j] = matrix[n + i, j] = 0.0
            matrix[i, i] -= h * f[A_BY_1] * up
            matrix[i, n + i] -= h * f[A_BY_2] * up
            matrix[n + i, i] -= h * f[C2_BY_1] * down
            matrix[n + i, n + i] -= h * f[C2_BY_2] * down
            right[i, 0], right[n + i, 0] = one * up, two * down
            right[i, 1], right[n + i, 1] = h * f[A_BY_1] * up, h * f[C2_BY_1] * down
            right[i, 2], right[n + i, 2] = h * f[A_BY_2] * up, h * f[C2_BY_2] * down
        eliminate_all(matrix, right, COLUMNS)
        largest = 0.0
        for i in range(n):
            change_y, change_v = right[i, 0], right[n + i, 0]
            if not (abs(change_y) < np.inf and abs(change_v) < np.inf):
                return -1, 0.0
            y = min(max(y0 + W[i] + change_y, low), high)
            W[i] = y - y0 if y in (low, high) else W[i] + change_y
            v = y0 + W[i] + most
            clipped = not held and v0 + W[n + i] + change_v > v
            W[n + i] = v - v0 if clipped else W[n + i] + change_v
            largest = max(largest, abs(change_y), abs(change_v))
        if largest < enough:
            return iteration + 1, 0.5 * largest * largest / par[V_T]
    return -1, 0.0


@inner
def series_of(start: float, W: FloatArray, first: int, a: FloatArray) -> None:
    """Series of start + W[first:first + ORDER], its last digits kept."""
    part = series_room()
    part[0] = 0.0
    for i in range(ORDER):
        part[i + 1] = W[first + i]
    to_series(part, a)
    a[0] += start


@inner
def end_inside(
    u: float, y: float, v: float, W: FloatArray, right: FloatArray, step: FloatArray
) -> None:
    """Let a collocated step end at the fraction u of it."""
    step[Y_END], step[V_END] = y, v
    for m in range(4):
        step[MOVED + m] = 1.0 if m in (0, 3) else 0.0
    for i in range(ORDER):
        # the polynomial that is 1 at node i and 0 at the others
        weight = 1.0 if u == 1.0 and i == ORDER - 1 else 0.0
        if u < 1.0:
            x = 2.0 * u - 1.0
            weight = TO_SERIES[0, i + 1] + series_at(TO_SERIES[:, i + 1], ORDER, x)
        step[Y_END] += weight * W[i]
        step[V_END] += weight * W[ORDER + i]
        for m in range(4):
            step[MOVED + m] += weight * right[ORDER * (m // 2) + i, 1 + m % 2]


@inner
def shortened(a: FloatArray, u: float, part: FloatArray, b: FloatArray) -> None:
    """Fill b with the series a on the fraction u of its step."""
    for i in range(ORDER + 1):
        part[i] = series_at(a, ORDER, 2.0 * u * POINTS[i] - 1.0)
    to_series(part, b)
    b[0] += a[0]


@inner
def collocated(
    s: float, h: float, y: float, v: float, held: bool, V0: float, p: float,
    low: float, high: float, most: float, wanted: float, slopes: FloatArray,
    par: FloatArray, W: FloatArray, f: FloatArray, matrix: FloatArray,
    right: FloatArray, a: FloatArray, b: FloatArray, step: FloatArray,
) -> int:  # fmt: skip
    """A step from s to s + h, `slopes` being `flow` at s; returns the iterations.

    Fills a and b with the series of V_C1 and V_C2. Returns -1 where it does not
    converge or misses `wanted` V, and in `step` how long to make it instead.
    """
    done, unsolved = collocate_pair(
        s, h, y, v, held, V0, p, low, high, most, wanted, par, W, f, matrix, right
    )
    step[LENGTH] = 0.2 * h
    if done < 0:
        return -1
    series_of(y, W, 0, a)
    series_of(v, W, ORDER, b)
    end_inside(1.0, y, v, W, right, step)
    big_1, big_2 = max(abs(y), abs(step[Y_END])), max(abs(v), abs(step[V_END]))
    left_1, left_2 = missing(a, big_1), missing(b, big_2)
    layer_1 = unseen(slopes[TO_A], -slopes[A_BY_1], h, left_1, a) + unsolved
    layer_2 = unsolved
    if not held:
        layer_2 += unseen(slopes[TO_C2], -slopes[C2_BY_2], h, left_2, b)
    growth = min(longer(a, big_1, wanted, 0.0), longer(b, big_2, wanted, 0.0))
    step[LENGTH] = h * min(max(0.1, growth), 0.5)
    if max(left_1 + layer_1, left_2 + layer_2) > 3.0 * wanted + unsolved:
        return -1
    step[LENGTH], step[GROWTH] = h, min(max(growth, 0.2), 30.0)
    step[LEFT_1], step[LEFT_2] = left_1 + layer_1, left_2 + layer_2
    step[STAYS_1] = carried(a, left_1) + layer_1
    step[STAYS_2] = carried(b, left_2) + layer_2
    return done


@inner
def first_crossing(
    a: FloatArray, level: float, error: float, part: FloatArray, d: FloatArray
) -> tuple[float, bool]:
    """Where the series a first reaches `level` from below, and whether in doubt.

    An interval is left behind where the sum of its coefficients' sizes keeps it below;
    it holds one crossing where its derivative's sum keeps one sign; else it is halved,
    down to pieces flat to within `error`, where only that can decide (in doubt).
    Returns u in (0, 1], or 2 where there is none.
    """
    u, width = 0.0, 1.0
    doubt = False
    while u < 1.0:
        top = u + width if u + width < 1.0 else 1.0
        if width == 1.0:
            for n in range(ORDER + 1):
                d[n] = a[n]
            d[0] -= level
        else:
            for i in range(ORDER + 1):
                x = 2.0 * (u + (top - u) * POINTS[i]) - 1.0
                part[i] = (a[0] - level) + series_at(a, ORDER, x)
            to_series(part, d)
        size = steep = 0.0
        first, last, sign = d[0], d[0], 1.0
        for n in range(1, ORDER + 1):
            sign = -sign
            first, last = first + sign * d[n], last + d[n]
            size += abs(d[n])
            if n > 1:
                steep += n * n * abs(d[n])
        if d[0] + size >= -error:
            if steep < abs(d[1]):
                if d[1] > 0.0 and last >= 0.0:
                    u = crossing(a, level, u, top, first, last, 1e-3 * error)
                    return u, doubt
                if d[1] < 0.0 and first >= -error:
                    doubt = True
            elif size > error and width > 1e-12:
                width *= 0.5
                continue
            else:
                doubt = True
                if d[0] + size >= 0.0 and max(first, last) >= 0.0:
                    return top, doubt
        u = top
        width = min(2.0 * width, 1.0 - u)
    return 2.0, doubt
