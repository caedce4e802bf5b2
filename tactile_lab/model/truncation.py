"""What a collocated step and its series are wrong by, and how long the next may be."""

from __future__ import annotations

import math

from tactile_lab.arrays import FloatArray
from tactile_lab.model.compiled import inner
from tactile_lab.model.tableau import NODES, ORDER

NOISE = 2e-16
"""Coefficients below this share of the largest value are rounding."""
SAFETY = 3.0


@inner
def ratio(a: FloatArray, top: int) -> float:
    """By how much two further coefficients are smaller, from the last up to `top`."""
    before = max(abs(a[top - 2]), abs(a[top - 3]))
    last = max(abs(a[top]), abs(a[top - 1]))
    found: float = last / before if last < before else 1.0
    return found


@inner
def missing(a: FloatArray, largest: float) -> float:
    """What the series is wrong by: the sum of a geometric continuation.

    A coefficient may vanish by chance, so three are looked at, and of what they promise
    the worst is taken. What is rounding of values up to `largest` counts for nothing.
    """
    noise = NOISE * largest
    q2 = max(ratio(a, ORDER), ratio(a, ORDER - 1), ratio(a, ORDER - 2))
    if abs(a[ORDER]) > noise:
        # a change at the step's end shows in the last coefficient first
        fell = min(abs(a[ORDER]) / max(abs(a[ORDER - 1]), 1e-300), 0.7)
        q2 = max(q2, fell * fell)
    q = q2**0.5
    last = max(
        abs(a[ORDER]) - noise, (abs(a[ORDER - 1]) - noise) * q,
        (abs(a[ORDER - 2]) - noise) * q2, 0.0,
    )  # fmt: skip
    return float(SAFETY * last * q / max(1.0 - q, 0.1))


@inner
def longer(a: FloatArray, largest: float, wanted: float, decays: float) -> float:
    """By how much a step may be longer so that its series misses `wanted`.

    Coefficient n grows with the n-th power of the step. The first one missing is told
    by the decay of the last that are more than rounding. Where they fall as those of
    exp(-s rate) do, `decays` being rate h, what is left of it has decayed in the next.
    """
    noise = max(4.0 * NOISE * largest, 3e-3 * wanted)
    top = ORDER
    while top > 3 and abs(a[top]) <= noise:
        top -= 1
    q2 = ratio(a, top)
    following = max(abs(a[top]), abs(a[top - 1])) * q2 ** (0.5 * (ORDER + 1 - top))
    of_layer = decays / (4.0 * top)
    if 0.36 < q2 / (of_layer * of_layer) < 2.3:
        following *= math.exp(-decays)
    found: float = (wanted / max(following, 1e-300)) ** (1.0 / (ORDER + 1))
    return 0.85 * found


@inner
def carried(a: FloatArray, left: float) -> float:
    """What of `left` is still wrong at the end of a collocated step.

    That is its order's gain, unless the coefficients end before they fall.
    """
    return left if abs(a[ORDER]) > 0.3 * abs(a[ORDER - 1]) else 3e-3 * left


@inner
def unseen(slope: float, rate: float, h: float, left: float, a: FloatArray) -> float:
    """Error of a change that is over before the first node, which no node sees, V.

    The residual at u = 0 sees it, from the true `slope` there: what it exceeds a smooth
    series' own one by, times the time to the first node or, if that is shorter, the
    time 1/`rate` in which the voltage forgets.
    """
    of_series = 0.0
    sign = 2.0
    for n in range(1, ORDER + 1):
        of_series += sign * n * n * a[n]
        sign = -sign
    residual = max(abs(h * slope - of_series) - 300.0 * left, 0.0)
    found: float = residual * min(NODES[0], 1.0 / (h * rate))
    return found
