"""The leaky integrator: V_C2 between spikes in closed form, Eqs. (17) and (18).

With Q = R_L (I_C + I_bias) as a Chebyshev series on a piece, tau_L P' = Q - P has a
particular solution P as a series, and V_C2 = P + c exp(-t/tau_L) between resets.
"""

from __future__ import annotations

import math

from tactile_lab.arrays import FloatArray
from tactile_lab.model import elementary
from tactile_lab.model.compiled import inner
from tactile_lab.model.matrix import product_of
from tactile_lab.model.node_a import V_T
from tactile_lab.model.tableau import ORDER, TO_SERIES_TURNED

DIRECT, V_S, T1_LOG, T1_DROP, T1_SCALE, T1_SHIFT = range(6, 12)
TAU_L, V_FIRE, V_RESET, T_EPS, Y_CRITICAL, Y_SATURATED = range(12, 18)
"""Where `par` holds what T1 and the integrator need."""
PARAMETERS = 18

SHORT = 24.0
"""Pieces of up to so many tau_L can resolve exp(-t/tau_L)."""
MOST_TERMS = 40
NEAR = 2e-4
"""What w + ln w may miss z by for the next iterate of omega to be right to rounding."""
MOST_ROUNDS = 4

times = product_of(ORDER + 1)


@inner
def omega(z: float) -> float:
    """Wright omega: w + ln w = z, by Fritsch, Shafer and Crowley's iteration."""
    if z < -1.0:
        w = math.exp(z)
        if z < -40.0:
            return w
        w *= 1.0 - w / (1.0 + w)
    elif z < 3.0:
        w = 0.567 + z * (0.362 + 0.0737 * z - 0.003 * z * z)
        w = max(w, 0.2)
    else:
        log = math.log(z)
        one = 1.0 / z
        w = z - log + log * one * (1.0 + one * (0.5 * log - 1.0))
    for _ in range(1 if z > 20.0 else 2):
        r = z - w - math.log(w)
        one = 1.0 + w
        a = one * (one + 2.0 / 3.0 * r)
        w *= 1.0 + r * (a - 0.5 * r) / (one * (a - r))
    return w


@inner
def omega_near(z: float, w: float) -> float:
    """Omega of z from w, which is near it: one iteration where that is enough."""
    if z <= 20.0 or not 0.5 * z < w < z:
        return omega(z)
    r = z - w - math.log(w)
    if abs(r) > NEAR:
        return omega(z)
    one = 1.0 + w
    a = one * (one + 2.0 / 3.0 * r)
    return w * (1.0 + r * (a - 0.5 * r) / (one * (a - r)))


@inner
def Q_at(y: float, par: FloatArray) -> float:
    """R_L (I_C + I_bias) at V_C1 = y, Eq. (17), V."""
    U = par[V_S] - y
    if par[DIRECT] != 0.0:
        direct: float = par[T1_SCALE] * math.expm1(min(U / par[V_T], 600.0))
        return direct + float(par[T1_SHIFT])
    z = (U + par[T1_DROP]) / par[V_T] + par[T1_LOG]
    Q: float = par[T1_SCALE] * omega(z) + par[T1_SHIFT]
    return Q


@inner
def Q_along(points: FloatArray, par: FloatArray) -> None:
    """Fill the second row of `points` with `Q_at` the first one's V_C1.

    The third holds ln w. Omega is found as in `omega`, but at all points side by side,
    and by ln w, whose exponential is w: from Taylor's series about the first point.
    """
    row = ORDER + 1
    points[row] = Q_at(points[0], par)
    rounds = 0 if par[DIRECT] != 0.0 else MOST_ROUNDS
    scale, shift, per_t = par[T1_SCALE], par[T1_SHIFT], 1.0 / par[V_T]
    top = (par[V_S] + par[T1_DROP]) * per_t + par[T1_LOG]
    z_0 = top - points[0] * per_t
    w_0 = (points[row] - shift) / scale
    rise = 1.0 / (1.0 + w_0)
    bend = w_0 * rise * rise * rise
    turn = bend * rise * rise * (2.0 * w_0 - 1.0) / 6.0
    for i in range(1, row):
        z = top - points[i] * per_t
        d = z - z_0
        log_w = z_0 - w_0 + d * (rise + d * (d * turn - 0.5 * bend))
        points[2 * row + i] = min(log_w, z, 700.0)
    for _ in range(rounds):
        far = 0
        for i in range(1, row):
            log_w = points[2 * row + i]
            w = elementary.exp(log_w)
            r = top - points[i] * per_t - w - log_w
            far += 0 if abs(r) < NEAR else 1
            one = 1.0 + w
            c = one * (one + 2.0 / 3.0 * r)
            change = r * (c - 0.5 * r) / (one * (c - r))
            points[row + i] = scale * (w * (1.0 + change)) + shift
            d = min(max(change, -0.5), 0.5)
            points[2 * row + i] = log_w + d * (1.0 - d * (0.5 - d * (1.0 / 3.0)))
        if far == 0:
            return
    for i in range(1, row):
        points[row + i] = Q_at(points[i], par)


@inner
def Q_gain(Q: float, par: FloatArray) -> float:
    """-dQ/dV_C1 where Q has this value."""
    w = (Q - par[T1_SHIFT]) / par[T1_SCALE]
    if par[DIRECT] != 0.0:
        w += 1.0
    else:
        w /= 1.0 + w
    gain: float = par[T1_SCALE] / par[V_T] * w
    return gain


@inner
def to_series(values: FloatArray, series: FloatArray) -> None:
    """Chebyshev coefficients of the polynomial through values at POINTS."""
    times(TO_SERIES_TURNED, values, series)


@inner
def series_at(series: FloatArray, degree: int, x: float) -> float:
    """Sum of c_n T_n(x) over n = 1 .. degree (without c_0), by Clenshaw."""
    b1 = b2 = 0.0
    x2 = 2.0 * x
    for n in range(degree, 0, -1):
        b1, b2 = (series[n] - b2) + x2 * b1, b1
    return x * b1 - b2


@inner
def both_at(q: FloatArray, P: FloatArray, degree: int, x: float) -> tuple[float, float]:
    """The series q and P at x, both whole; a zero follows either's last coefficient.

    Clenshaw's recurrence in T_2(x) for even and odd terms apart: four sums, none of
    which waits for another.
    """
    y = 4.0 * x * x - 2.0
    P_0 = P_2 = P_1 = P_3 = 0.0
    q_0 = q_2 = q_1 = q_3 = 0.0
    top = degree // 2
    for k in range(top, ORDER // 2, -1):
        P_0, P_2 = (P[2 * k] - P_2) + y * P_0, P_0
        P_1, P_3 = (P[2 * k + 1] - P_3) + y * P_1, P_1
    for k in range(min(top, ORDER // 2), 0, -1):
        P_0, P_2 = (P[2 * k] - P_2) + y * P_0, P_0
        P_1, P_3 = (P[2 * k + 1] - P_3) + y * P_1, P_1
        q_0, q_2 = (q[2 * k] - q_2) + y * q_0, q_0
        q_1, q_3 = (q[2 * k + 1] - q_3) + y * q_1, q_1
    of_P = (0.5 * y * P_0 - P_2) + x * ((P[1] - P_3) + (y - 1.0) * P_1)
    of_q = (0.5 * y * q_0 - q_2) + x * ((q[1] - q_3) + (y - 1.0) * q_1)
    return q[0] + of_q, P[0] + of_P


@inner
def needed(q: FloatArray, P: FloatArray, degree: int, least: float) -> int:
    """The degree up to which either series has a coefficient above `least`."""
    while degree > 1 and abs(P[degree]) <= least:
        if degree <= ORDER and abs(q[degree]) > least:
            break
        degree -= 1
    P[degree + 1] = 0.0
    return degree


@inner
def particular(q: FloatArray, r: float, largest: float, P: FloatArray) -> int:
    """Series of a P with (1/r) dP/du + P = Q, r = piece / tau_L; returns its degree.

    It is the one polynomial that solves the equation, where that is no larger than Q,
    `largest` V: its rounding then is no more than Q's own. Else, for up to SHORT, it is
    the one that starts at Q(0), by the tridiagonal recursion of the integrated
    equation. Returns 0 where neither will do.
    """
    # P_n = q_n - (2/r) (dP/dx)_n, from the top; d_n the coefficients of dP/dx
    later = d = size = 0.0
    per = 2.0 / r
    top = ORDER
    while top > 1 and abs(q[top]) <= 2e-16 * largest:
        P[top] = 0.0
        top -= 1
    P[top] = q[top]
    for n in range(top - 1, -1, -1):
        following = later + 2.0 * (n + 1) * P[n + 1]
        later, d = d, following
        change = per * (following if n else 0.5 * following)
        P[n] = q[n] - change
        size += abs(change)
    if size <= largest:
        return top
    if r > SHORT:
        return 0
    degree = min(ORDER + 2 + math.ceil(r), MOST_TERMS)
    half = 0.5 * r
    # P_n = alpha_n - beta_n P_(n-1), from the top; beta kept in P's upper half
    alpha = beta = 0.0
    for n in range(degree, 0, -1):
        below = q[n - 1] if n - 1 <= ORDER else 0.0
        above = q[n + 1] if n + 1 <= ORDER else 0.0
        if n == 1:
            below *= 2.0
        d = 1.0 / (2.0 * n + half * beta)
        alpha = half * (below - above + alpha) * d
        beta = half * (2.0 if n == 1 else 1.0) * d
        P[n] = alpha
        P[MOST_TERMS + 1 + n] = beta
    # P = X + P_0 Y with Y_0 = 1; P(-1) = Q(-1) fixes P_0
    X = 0.0
    Y = 1.0
    x_n, y_n, sign = 0.0, 1.0, 1.0
    wanted = q[0]
    for n in range(1, degree + 1):
        sign = -sign
        x_n = P[n] - P[MOST_TERMS + 1 + n] * x_n
        y_n = -P[MOST_TERMS + 1 + n] * y_n
        X += sign * x_n
        Y += sign * y_n
        if n <= ORDER:
            wanted += sign * q[n]
    P[0] = (wanted - X) / Y
    for n in range(1, degree + 1):
        P[n] -= P[MOST_TERMS + 1 + n] * P[n - 1]
    return degree
