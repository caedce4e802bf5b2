"""What a collocated step and its series are wrong by."""

from __future__ import annotations

from tactile_lab.model.circuit import FloatArray
from tactile_lab.model.compiled import inner
from tactile_lab.model.tableau import NODES, ORDER


@inner
def missing(a: FloatArray) -> float:
    """What the series is wrong by: one coefficient may vanish by chance, not three."""
    found: float = max(10.0 * abs(a[ORDER]), abs(a[ORDER - 1]), 0.1 * abs(a[ORDER - 2]))
    return found


@inner
def carried(a: FloatArray, left: float) -> float:
    """What of `left` is still wrong at the end of a collocated step.

    That is its order's gain, unless the coefficients end before they fall.
    """
    return left if abs(a[ORDER]) > 0.2 * abs(a[ORDER - 1]) else 0.01 * left


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
    residual = max(abs(h * slope - of_series) - 100.0 * left, 0.0)
    found: float = residual * min(NODES[0], 1.0 / (h * rate))
    return found
