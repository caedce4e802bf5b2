"""What follows from a circuit's numbers, for Python and for compiled code alike.

Each function takes whatever has a circuit's numbers as attributes, SI: Python passes a
`Circuit`, the batch kernel one record of an array (see `batch`). So a rule stands once,
and a batch gives the same as a single solve to the last bit.
"""

from __future__ import annotations

import math
from typing import Any

Numbers = Any
"""A `Circuit`, or a record with its numbers and fire_voltage, reset_voltage, ..."""


def k_F(c: Numbers) -> float:
    """Piezoelectric voltage per force, Eqs. (3)-(6), V/N."""
    volts: float = 6 * c.g31 * c.h * (c.L - c.d) / (c.a * c.b * c.b)
    return volts


def tau_A(c: Numbers) -> float:
    """Time constant of node A without the PiezoFET, Eq. (16), s."""
    time: float = c.C1 / (1 / c.R1 + 1 / c.R2)
    return time


def critical_V_C1(c: Numbers, direct: bool) -> float:
    """V_C1 below which V_C2 can reach V_fire, from Eqs. (17) and (18), V.

    Infinite where I_bias alone reaches it. `direct`: T1 without R3 in its emitter.
    """
    current: float = c.fire_voltage / c.R_L - c.I_bias
    if current <= -c.I_T1s:
        return math.inf
    U: float = c.V_T * math.log1p(current / c.I_T1s)
    if not direct:
        U += c.R3 * current
    V: float = c.V_S - U
    return V


def critical_force(c: Numbers, V: float, volts_per_newton: float) -> float:
    """The least force at which a film that does not leak would keep it firing, N.

    Held from rest, it moves node A to `V`, its critical voltage, where T1's current
    just keeps V_C2 at V_fire: there I_DS, Eq. (8), draws what R1 and R2 give, Eq. (16).
    NaN where no force does.
    """
    drawn = (c.V_S - V) / c.R1 - V / c.R2
    if not (math.isfinite(V) and V > 0 and drawn > 0 and volts_per_newton != 0):
        return math.nan
    gate = c.m * c.V_T * math.log(drawn / (c.I_S * -math.expm1(-V / c.V_T)))
    force: float = (gate - c.V_GS) / volts_per_newton
    return force
