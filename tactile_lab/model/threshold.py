"""Where on a step of V_C1 the circuit may fire: V_C1 below its critical value."""

from __future__ import annotations

from tactile_lab.arrays import FloatArray
from tactile_lab.model.compiled import inner
from tactile_lab.model.integrator import Y_CRITICAL, series_at
from tactile_lab.model.node_a import TAU, B_at, V_P_at, slope_at
from tactile_lab.model.tableau import ORDER


@inner
def crossing(
    a: FloatArray, level: float, low: float, high: float, f_low: float, f_high: float,
    enough: float,
) -> float:  # fmt: skip
    """Where the series a, monotone on [low, high], passes `level`.

    At both ends it is above it by `f_low` and `f_high`. It misses the level there by
    `enough`, or by rounding if that is more. Anderson and Bjorck's false position.
    """
    u, last = high, 0.0
    for _ in range(100):
        if high - low <= 1e-16 or f_low == f_high:
            break
        u = low - f_low * (high - low) / (f_high - f_low)
        f = (a[0] - level) + series_at(a, ORDER, 2.0 * u - 1.0)
        if abs(f) <= enough:
            break
        # an end that stays twice counts for less than it is
        share = 1.0
        if f * last > 0.0:
            share = 1.0 - f / last if abs(f) < abs(last) else 0.5
        last = f
        if (f > 0.0) == (f_low > 0.0):
            low, f_low, f_high = u, f, share * f_high
        else:
            high, f_high, f_low = u, f, share * f_low
    return u


@inner
def above_threshold(
    a: FloatArray,
    y0: float,
    y1: float,
    s: float,
    h: float,
    V0: float,
    p: float,
    par: FloatArray,
    fires: FloatArray,
) -> None:
    """Fill `fires` with the intervals of u where V_C1 < its critical value.

    The step's series a goes from y0 to y1.

    On one segment V_P is monotone, so V_C1'' at V_C1' = 0 has one sign: V_C1 has at
    most one extremum per segment. Each monotone part has no or exactly one crossing.
    """  # fmt: skip
    level = par[Y_CRITICAL]
    fires[0] = fires[1] = 0.0
    fires[2] = fires[3] = split = 1.0
    f0 = slope_at(B_at(V_P_at(s, V0, p, par[TAU]), par), y0, par)
    f1 = slope_at(B_at(V_P_at(s + h, V0, p, par[TAU]), par), y1, par)
    middle_y = y1
    if f0 * f1 < 0.0 and (y0 < level) == (y1 < level):
        low, high = 0.0, 1.0
        for _ in range(50):
            split = 0.5 * (low + high)
            middle_y = a[0] + series_at(a, a.size - 1, 2.0 * split - 1.0)
            B = B_at(V_P_at(s + h * split, V0, p, par[TAU]), par)
            if (slope_at(B, middle_y, par) > 0.0) == (f0 > 0.0):
                low = split
            else:
                high = split
    if (y0 < level) == (middle_y < level):
        if y0 < level:
            fires[1] = split
    else:
        u = crossing(
            a, level, 0.0, split, y0 - level, middle_y - level, 1e-16 * abs(level)
        )
        if y0 < level:
            fires[1] = u
        else:
            fires[0], fires[1] = u, split
    if split < 1.0:
        if (y1 < level) == (middle_y < level):
            if y1 < level:
                fires[2] = split
        else:
            u = crossing(
                a, level, split, 1.0, middle_y - level, y1 - level, 1e-16 * abs(level)
            )
            if y1 < level:
                fires[2] = u
            else:
                fires[2], fires[3] = split, u
