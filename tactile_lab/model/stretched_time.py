"""The variable that V_C1 and V_C2 are power series in: time, stretched beside poles.

As T1's collector junction opens, V_C2 - V_C1 is a logistic curve, V_T ln(1 + exp(..)):
it has poles beside the real axis, and a series in time ends where they are as near as
its end. In w instead, with

    t = L w (1 - c w)/(1 - w^2)

the plane without two cuts, from the nearest poles away from the real axis, is the disc
|w| < 1, and all later times lie in it. L is twice the distance of the poles, c the
cosine of the angle at which they are seen. c = -1 is the plane without a cut into the
past, where omega's logarithm has its singularity.
"""

from __future__ import annotations

import math

from tactile_lab.arrays import FloatArray
from tactile_lab.model.compiled import inner
from tactile_lab.model.integrator import DIRECT, TAU_L
from tactile_lab.model.node_a import V_T
from tactile_lab.model.transistor import (
    A_BY_2,
    C2_BY_2,
    I_S1,
    OF_W,
    OF_X,
    R_E,
    TO_A,
    TO_C2,
)

FAR = 10.0
"""Poles so many times their height ahead do not bound a step yet: omega does."""
AHEAD = 3.0
"""A step aims no farther than so many times the distance of poles ahead."""
MOST_UNITS = 300.0
"""Longest L in units of the fastest rate: coefficients stay in the range of numbers."""
TINY = 1e-30


@inner
def stretch(
    f: FloatArray, rate: float, held: bool, par: FloatArray
) -> tuple[float, float]:
    """L, s, and c for a series that starts where `flow` is f, its fastest rate `rate`.

    Any L above 0 and c from -1 to 1 are right; these have the series reach far.
    """
    apart = (f[TO_C2] - f[TO_A]) / par[V_T]
    closing = f[A_BY_2] - f[C2_BY_2] - (0.0 if held else 1.0 / par[TAU_L])
    # D' = r - closing exp(D - D(0)): the poles are where 1 = -closing/D'(0) exp(r t)
    r = apart + max(closing, 0.0)
    by = 1.0 / max(abs(r), TINY * rate)
    share = abs(apart) / max(closing, TINY * rate)
    ahead = math.log(min(max(share, TINY), 1.0 / TINY)) * by
    height = math.pi * by
    if apart <= 0.0:
        ahead, height = -abs(ahead), 0.0
    distance = math.sqrt(ahead * ahead + height * height)
    skew = ahead / distance if distance > 0.0 else -1.0
    if ahead > FAR * height:
        skew, distance = -1.0, AHEAD * distance
        if par[DIRECT] == 0.0:
            W = f[OF_W]
            J_slope = par[I_S1] * (1.0 + f[OF_X]) * apart
            z_slope = abs(par[R_E] * J_slope - f[TO_A]) / par[V_T]
            past = (1.0 + W) * (1.0 + W) / (W * z_slope + TINY * rate)
            distance = min(distance, past)
    longest = MOST_UNITS / rate
    L = 2.0 * distance
    return (L if 0.0 < L < longest else longest), skew


@inner
def time_at(w: float, L: float, c: float) -> float:
    """Time at w, s."""
    return L * w * (1.0 - c * w) / (1.0 - w * w)


@inner
def pace_at(w: float, L: float, c: float) -> float:
    """dt/dw at w, s."""
    below = 1.0 - w * w
    return L * (1.0 + w * w - 2.0 * c * w) / (below * below)


@inner
def w_at(t: float, L: float, c: float) -> float:
    """The w of a time, s, from 0."""
    apart = 2.0 * t - L * c
    return 2.0 * t / (L + math.sqrt(apart * apart + L * L * (1.0 - c * c)))
