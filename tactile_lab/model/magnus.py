"""What a volt at a step's start moves at its end, and a step at rest.

It tells how errors go on and needs few digits: Magnus's exponential of the Jacobian of
V_C1 and V_C2, of order 4.
"""

from __future__ import annotations

import math

from tactile_lab.arrays import FloatArray
from tactile_lab.model.compiled import inner
from tactile_lab.model.pair import (
    GROWTH,
    LEFT_1,
    LEFT_2,
    LENGTH,
    MOVED,
    STAYS_1,
    STAYS_2,
    V_END,
    Y_END,
)
from tactile_lab.model.tableau import ORDER
from tactile_lab.model.transistor import (
    A_BY_1,
    A_BY_2,
    C2_BY_1,
    C2_BY_2,
    TO_A,
    TO_C2,
)


@inner
def moved(
    first: float, middle: float, last: float, a: FloatArray, m: FloatArray,
    b: FloatArray, step: FloatArray,
) -> None:  # fmt: skip
    """What a volt at the start moves at the end: a, m, b are `flow` there and between.

    Magnus's exponential of order 4: of Simpson's sum of the Jacobians, of which the
    weights are given, s, less three times the commutator of the first term with the
    last.
    """
    p = first * a[A_BY_1] + middle * m[A_BY_1] + last * b[A_BY_1]
    q = first * a[A_BY_2] + middle * m[A_BY_2] + last * b[A_BY_2]
    r = first * a[C2_BY_1] + middle * m[C2_BY_1] + last * b[C2_BY_1]
    s = first * a[C2_BY_2] + middle * m[C2_BY_2] + last * b[C2_BY_2]
    k = 3.0 * first * last
    turn = k * (a[A_BY_2] * b[C2_BY_1] - b[A_BY_2] * a[C2_BY_1])
    apart_a, apart_b = a[A_BY_1] - a[C2_BY_2], b[A_BY_1] - b[C2_BY_2]
    p, s = p - turn, s + turn
    q -= k * (apart_a * b[A_BY_2] - apart_b * a[A_BY_2])
    r += k * (apart_a * b[C2_BY_1] - apart_b * a[C2_BY_1])
    mean, half = 0.5 * (p + s), 0.5 * (p - s)
    square = half * half + q * r
    root = math.sqrt(abs(square))
    if root < 1e-3:
        scale = math.exp(mean)
        even, odd = scale * (1.0 + 0.5 * square), scale * (1.0 + square / 6.0)
    elif square > 0.0:
        slow, fast = 0.5 * math.exp(mean + root), 0.5 * math.exp(mean - root)
        even, odd = slow + fast, (slow - fast) / root
    else:
        scale = math.exp(mean)
        even, odd = scale * math.cos(root), scale * math.sin(root) / root
    step[MOVED], step[MOVED + 1] = even + odd * half, odd * q
    step[MOVED + 2], step[MOVED + 3] = odd * r, even - odd * half


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
    moved(h / 6.0, h / 1.5, h / 6.0, f, f, f, step)
    # Cramer's rule
    by_all = abs(f[A_BY_1] * f[C2_BY_2] - f[A_BY_2] * f[C2_BY_1])
    one, two = abs(f[TO_A]), abs(f[TO_C2])
    step[LEFT_1] = (one * abs(f[C2_BY_2]) + two * abs(f[A_BY_2])) / by_all
    step[LEFT_2] = (one * abs(f[C2_BY_1]) + two * abs(f[A_BY_1])) / by_all
    step[STAYS_1], step[STAYS_2] = step[LEFT_1], step[LEFT_2]
    step[LENGTH], step[GROWTH] = h, 1.0
