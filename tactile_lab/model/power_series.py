"""V_C1 and V_C2 where T1 saturates, as power series in the w of `stretched_time`.

All coefficients follow from the state by recursion. With P = exp((V_C2 - V_C1)/V_T),
Wright's omega W of z and B exp(-V_C1/V_T), the equations are linear in the voltages and
in four functions, and of each of these what follows is the product of itself with the
slope of its logarithm: that is known from the voltages, for W from z' - W'. So a
coefficient takes one sum of products of all four at a time (see `lanes`).
"""

from __future__ import annotations

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model.compiled import inner
from tactile_lab.model.integrator import DIRECT, TAU_L
from tactile_lab.model.lanes import Lanes, load, same, side_by_side, spread, store
from tactile_lab.model.node_a import DIVIDER, LAMBDA, PER_VOLT, TAU, V_T
from tactile_lab.model.transistor import (
    I_S1,
    OF_B,
    OF_Q,
    OF_W,
    OF_X,
    PER_F,
    PER_R,
    R_E,
    T1_BIAS,
    T1_C1,
    T1_C2,
)

MOST = 36
"""Highest degree of a series."""
PER = 1.0 / np.arange(1.0, MOST + 1.0)
ROW = 16
"""Numbers of one coefficient, in fours."""
VOLTAGES, SLOPES, LOGS, FOURS = range(0, ROW, 4)
"""V_C1, V_C2, V_P and exp(-rate t); their slopes by w; those of the logarithms of P, W
or, with "direct", I_F + I_T1s, B exp(-V_C1/V_T) and B; these themselves."""
V_C1, V_C2, FADES = VOLTAGES, VOLTAGES + 1, VOLTAGES + 3
NOTHING = 1e-20
"""A junction's exponential below this is left out: the rest of its series is, too."""


@inner
def expand(
    y: float, v: float, held: bool, V_P: float, p: float, rate: float, L: float,
    turn: float, degree: int, par: FloatArray, f: FloatArray, c: FloatArray,
) -> None:  # fmt: skip
    """Fill the rows of `c` up to `degree` from V_C1 = y, V_C2 = v and V_P, V.

    `flow` is f there, p k_F times the slope of the force, V/s. exp(-rate t) is no part
    of the circuit: how far its series goes is how far the others stay stable.
    """
    v_t, leak, direct = par[V_T], par[I_S1], par[DIRECT] != 0.0
    per_t, per_volt = 1.0 / v_t, par[PER_VOLT]
    P_0, W_0, q_0 = 1.0 + f[OF_X], f[OF_W], 1.0 + f[OF_Q]
    P_0 = P_0 if P_0 > NOTHING else 0.0
    q_0 = q_0 if q_0 > NOTHING else 0.0
    # what each coefficient of the four gives to the slopes of both voltages by t/L
    to_a, to_c2 = L / par[T1_C1], 0.0 if held else L / par[T1_C2]
    per_w = 1.0 if direct else v_t / ((1.0 + par[PER_F]) * par[R_E])
    P_to_y, P_to_v = to_a * leak * par[PER_R], -to_c2 * leak * (1.0 + par[PER_R])
    by_P = side_by_side(P_to_y, P_to_v, 0.0, 0.0)
    by_W = side_by_side(to_a * per_w * par[PER_F], to_c2 * per_w, 0.0, 0.0)
    by_closing = side_by_side(L, 0.0, 0.0, 0.0)
    # what each voltage gives to its own, and what stands still
    held_v = 0.0 if held else -L / par[TAU_L]
    leaks = side_by_side(-L * par[LAMBDA], held_v, -L / par[TAU], -L * rate)
    still_y = L * par[LAMBDA] * par[DIVIDER] - to_a * leak * (par[PER_F] + par[PER_R])
    still_v = to_c2 * (par[T1_BIAS] + leak * par[PER_R])
    still = side_by_side(still_y, still_v, L * p, 0.0)
    # what slopes of voltages, P' and W' give to those of the four logarithms: with R3,
    # z' = to_z P' - V_C1'/V_T
    emitter = 0.0 if direct else 1.0
    to_z, own = emitter * par[R_E] * leak * per_t, 1.0 / (1.0 + emitter * W_0)
    by_P_0 = own * to_z * P_0 * per_t
    from_y = side_by_side(-per_t, -own * per_t - by_P_0, -per_t, 0.0)
    from_v = side_by_side(per_t, by_P_0, 0.0, 0.0)
    from_V_P = side_by_side(0.0, 0.0, per_volt, per_volt)
    from_P = side_by_side(0.0, own * to_z, 0.0, 0.0)
    from_W = side_by_side(0.0, -own * emitter, 0.0, 0.0)
    nothing, two, twice = same(0.0), same(2.0), same(2.0 * turn)
    V_k = side_by_side(y, v, V_P, 1.0 if L * rate > 1.0 else 0.0)
    E_0 = side_by_side(P_0, W_0, f[OF_B] * q_0, f[OF_B])
    of = (still + leaks * V_k) + by_closing * same(f[OF_B] * f[OF_Q])
    of = (of + by_P * spread(E_0, 0)) + by_W * spread(E_0, 1)
    log_0 = from_y * spread(of, 0) + from_v * spread(of, 1) + from_V_P * spread(of, 2)
    store(c, VOLTAGES, V_k)
    store(c, SLOPES, of)
    store(c, LOGS, log_0)
    store(c, FOURS, E_0)
    # the same of the newest coefficients, at once: all else waits for these
    log_by_P = from_y * spread(by_P, 0) + from_v * spread(by_P, 1)
    log_by_P = log_by_P + from_P * spread(log_0, 0)
    log_by_W = from_y * spread(by_W, 0) + from_v * spread(by_W, 1) + from_W * log_0
    log_by_closing = from_y * spread(by_closing, 0)
    # slopes by w from L times those by time: (1 - w^2)^2 of the former are
    # (1 - 2 c w + w^2) of the latter
    V_k, E_k = of, log_0 * E_0
    E_1, E_last, log_1, log_last = E_k, nothing, nothing, nothing
    of_2 = to_2 = to_3 = to_4 = nothing
    to = of
    for k in range(1, degree):
        store(c, ROW * k + VOLTAGES, V_k)
        store(c, ROW * k + FOURS, E_k)
        # two sums, none waits for the other, the newest coefficients at last; in no
        # function of its own, for whose call all registers would be put aside
        known = also = nothing
        j = 2
        while j < k - 2:
            i = k - j
            known = known + load(c, ROW * j + LOGS) * load(c, ROW * i + FOURS)
            also = also + load(c, ROW * j + ROW + LOGS) * load(c, ROW * i - ROW + FOURS)
            j += 2
        if j < k - 1:
            known = known + load(c, ROW * j + LOGS) * load(c, ROW * (k - j) + FOURS)
        known = ((known + also) + log_1 * E_last) + log_last * E_1
        before = of_2 + (two * to_2 - to_4)
        more = before - twice * of
        bare = (before + leaks * V_k) - twice * of
        P, W, closing = spread(E_k, 0), spread(E_k, 1), spread(E_k, 2) - spread(E_k, 3)
        log = from_P * spread(known, 0) + from_W * known + from_V_P * spread(bare, 2)
        log = log + (from_y * spread(bare, 0) + from_v * spread(bare, 1))
        log = log + ((log_by_P * P + log_by_W * W) + log_by_closing * closing)
        to_2, to_3, to_4 = to, to_2, to_3
        to = bare + ((by_P * P + by_W * W) + by_closing * closing)
        of_2, of = of, to - more
        store(c, ROW * k + SLOPES, to)
        store(c, ROW * k + LOGS, log)
        per = same(PER[k])
        if k == 1:
            log_1 = log
        else:
            E_last = E_k
        log_last = log
        V_k, E_k = per * to, per * (known + log_0 * E_k) + log * (per * E_0)
    store(c, ROW * degree + VOLTAGES, V_k)
    store(c, ROW * degree + FOURS, E_k)
    # sums take two terms at a time
    store(c, ROW * degree + SLOPES, nothing)
    for n in range(ROW):
        c[degree + 1, n] = 0.0


@inner
def four_at(c: FloatArray, first: int, degree: int, x: float) -> Lanes:
    """Four series at w = x: even and odd terms apart, none waits for long."""
    top = ROW * (degree - degree % 2) + first
    a, b, square = load(c, top), load(c, top + ROW), same(x * x)
    for n in range(top - 2 * ROW, -1, -2 * ROW):
        a, b = load(c, n) + a * square, load(c, n + ROW) + b * square
    return a + b * same(x)
