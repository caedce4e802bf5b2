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
    step[LENGTH], step[GROWTH] = h, 1.0
