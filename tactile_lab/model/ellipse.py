"""Errors of two voltages together: an ellipse, carried through linear maps."""

from __future__ import annotations

import math

from tactile_lab.arrays import FloatArray
from tactile_lab.model.compiled import inner

E_11, E_12, E_22 = range(3)
"""The ellipse of possible errors of V_C1 (1) and V_C2 (2), V^2: e' E^-1 e <= 1. During
a reset the second axis is the time at which it ends, s."""


@inner
def transform(E: FloatArray, a: float, b: float, c: float, d: float) -> None:
    """The ellipse after e := [[a, b], [c, d]] e."""
    p, q, r = E[E_11], E[E_12], E[E_22]
    E[E_11] = a * a * p + 2.0 * a * b * q + b * b * r
    E[E_12] = a * c * p + (a * d + b * c) * q + b * d * r
    E[E_22] = c * c * p + 2.0 * c * d * q + d * d * r


@inner
def widen(E: FloatArray, one: float, two: float) -> None:
    """An ellipse that holds the sum of any error in it and one of +-one, +-two."""
    old, new = math.sqrt(E[E_11] + E[E_22]), math.sqrt(2.0 * (one * one + two * two))
    if new == 0.0:
        return
    grow = 1.0 + new / old if old > 0.0 else 1.0
    add = 2.0 * (1.0 + old / new)
    E[E_11] = E[E_11] * grow + add * one * one
    E[E_12] *= grow
    E[E_22] = E[E_22] * grow + add * two * two
