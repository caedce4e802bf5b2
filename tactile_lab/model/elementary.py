"""exp and expm1 by arithmetic alone, so that a loop over nodes runs four at a time.

x = n ln 2 + r with |r| <= ln(2)/2, and exp(r) - 1 by its Taylor series to degree 13,
whose rest is below rounding. Right to two units in the last place.
"""

from __future__ import annotations

import math

import numpy as np

from tactile_lab.model.compiled import inner

LOG2_E = 1.0 / math.log(2.0)
LN_2 = float.fromhex("0x1.62e42fefap-1")
LN_2_LOW = float.fromhex("0x1.cf79abc9e3b39p-40")
"""ln 2 as a sum: n times the first is exact."""
ROUND = 1.5 * 2.0**52 + 1023.0
"""Added to a number, leaves it rounded in the last bits, biased as an exponent is."""
LEAST = -700.0
"""Below, exp is nothing."""
(C_2, C_3, C_4, C_5, C_6, C_7, C_8, C_9, C_10, C_11, C_12, C_13) = (
    1.0 / math.factorial(n) for n in range(2, 14)
)


@inner
def parts(x: float) -> tuple[float, float]:
    """2^n and exp(r) - 1, for x up to 709."""
    x = max(x, LEAST)
    shifted = x * LOG2_E + ROUND
    n = shifted - ROUND
    r = (x - n * LN_2) - n * LN_2_LOW
    p = C_13
    p = p * r + C_12
    p = p * r + C_11
    p = p * r + C_10
    p = p * r + C_9
    p = p * r + C_8
    p = p * r + C_7
    p = p * r + C_6
    p = p * r + C_5
    p = p * r + C_4
    p = p * r + C_3
    p = p * r + C_2
    exponent = np.int64(np.float64(shifted).view(np.int64) << np.int64(52))
    return exponent.view(np.float64), r + r * r * p


@inner
def exp(x: float) -> float:
    """Exponential of x up to 709; 1e-304 below -700."""
    power, p = parts(x)
    result: float = power + power * p
    return result


@inner
def expm1(x: float) -> float:
    """Exponential of x up to 709, less 1."""
    power, p = parts(x)
    result: float = (power - 1.0) + power * p
    return result
