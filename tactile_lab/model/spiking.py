"""Spikes within one piece of the integrator, Eqs. (10) and (11): all of them, no other.

Below V_fire and where Q > V_fire, V_C2' = (Q - V_C2)/tau_L > 0: V_C2 rises strictly, so
each such interval holds exactly one crossing before the next reset if V_C2 at its end
reaches V_fire, and none otherwise. Where Q <= V_fire there can be none.
"""

from __future__ import annotations

import math

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model import train
from tactile_lab.model.compiled import inner, inner_making_arrays
from tactile_lab.model.integrator import (
    T_EPS,
    TAU_L,
    V_FIRE,
    V_RESET,
    Y_SATURATED,
    both_at,
    series_at,
)
from tactile_lab.model.tableau import ORDER
from tactile_lab.model.train import foretell, remember, together

VOLTAGE, REF, REF_LOW, RESUME, ERROR = range(5)
"""Integrator state: V_C2 = VOLTAGE at REF + REF_LOW s after the piece's start, held
until RESUME (negative: not held), with an estimated error."""
COUNT, FIRST, LAST, PREVIOUS, SHORTEST, LONGEST = range(5, 11)
LARGEST_ERROR, DOUBT, SATURATED, TOO_FAST, SEARCHES = range(11, 16)
"""Spike statistics, s; estimated error of spike times, s; flags."""
KNOWN = 16
"""How many numbers that is, at the head of the kernel's memory."""
EPS = 2.3e-16
SHORTEST_INTERVAL = 1e-9
"""Spikes closer than this, s, are refused: no circuit, and no end of them."""


@inner_making_arrays
def grown(spikes: FloatArray, count: int) -> FloatArray:
    """The array if it has a place `count`, or a copy of at least twice its size."""
    if count < spikes.size:
        return spikes
    larger = np.empty(max(2 * spikes.size, count + 1))
    for i in range(spikes.size):
        larger[i] = spikes[i]
    return larger


@inner
def fire(t: float, error: float, S: FloatArray) -> None:
    """Count a spike at absolute time t s."""
    if S[COUNT] == 0.0:
        S[FIRST] = t
    if S[LAST] > -np.inf:
        interval = t - S[LAST]
        S[SHORTEST] = min(S[SHORTEST], interval)
        S[LONGEST] = max(S[LONGEST], interval)
    S[PREVIOUS] = S[LAST]
    S[LAST] = t
    S[COUNT] += 1.0
    S[LARGEST_ERROR] = max(S[LARGEST_ERROR], error + EPS * abs(t))


@inner
def later(
    error: float,
    e: float,
    Q_error: float,
    missed: float,
    swing: float,
    V: float,
    again: bool,
) -> float:
    """What an error of V_C2 = V becomes in a time d with e = expm1(-d/tau_L), V.

    See `run_piece` for what Q is wrong by. What goes to and fro weighs in a spike's
    time by exp(-age/tau_L), a sawtooth over a train. The mean of the sawtooth sums up
    one swing over the whole piece, which its first interval is given; to each interval
    `again`, after a spike of the piece, only the tooth is left: from -1/2 to 1/2 of -e.
    """
    if again:
        swing *= -0.5 * e
    added = min(-missed * e, swing) + EPS * abs(V)
    return float(error * (1.0 + e) - Q_error * e + added)


@inner
def strike(
    t: float,
    s: float,
    d: float,
    e: float,
    Q: float,
    short: float,
    end: float,
    length: float,
    whole: bool,
    Q_error: float,
    missed: float,
    swing: float,
    again: bool,
    y: float,
    par: FloatArray,
    S: FloatArray,
    spikes: FloatArray,
    keep: bool,
    most: float,
) -> None:
    """Let it fire d s after the integrator's reference, where Q is as given.

    It may fire up to `end`; d is wrong by `short`, and expm1(-d/tau_L) is e; C2 was
    charged from V_reset on if `whole`. See `run_piece` for all else.
    """
    V_f, V_r = par[V_FIRE], par[V_RESET]
    per_tau = 1.0 / par[TAU_L]
    # kept as a sum of two numbers
    ref = S[REF]
    rough = ref + d
    low_part = S[REF_LOW] + ((ref - rough) + d)
    v = rough + low_part
    carry = (rough - v) + low_part
    at = t + (s + v)
    error = later(S[ERROR], e, Q_error, missed, swing, V_f, again)
    time_error = error / max((Q - V_f) * per_tau, 1e-300)
    time_error += EPS * d + short
    if end - v < 2.0 * time_error and end < length:
        S[DOUBT] = 1.0
    fire(at, time_error, S)
    if keep:
        spikes[int(S[COUNT]) - 1] = at
    if y < par[Y_SATURATED]:
        S[SATURATED] = 1.0
    S[ERROR] = time_error * (Q - V_r) * per_tau
    S[REF], S[REF_LOW], S[VOLTAGE] = v, carry, V_r
    if par[T_EPS] > 0.0:
        S[RESUME] = v + carry + par[T_EPS]
    closest = max(SHORTEST_INTERVAL, 4.0 * EPS * abs(at))
    if (whole and d + par[T_EPS] < closest) or S[COUNT] >= most:
        S[TOO_FAST] = 1.0


@inner
def most_spikes(length: float, highest: float, most: float, par: FloatArray) -> int:
    """What number of spikes cannot be exceeded in `length` s where Q <= `highest` V."""
    V_f, V_r = par[V_FIRE], par[V_RESET]
    if not highest > V_f:
        return 2
    least = par[T_EPS] + par[TAU_L] * math.log1p((V_f - V_r) / (highest - V_f))
    return 2 + int(min(1.001 * length / least, most))


@inner
def run_piece(
    t: float,
    s: float,
    length: float,
    q: FloatArray,
    P: FloatArray,
    degree: int,
    fires: FloatArray,
    Q_error: float,
    missed: float,
    swing: float,
    over: float,
    y: float,
    par: FloatArray,
    S: FloatArray,
    spikes: FloatArray,
    keep: bool,
    most: float,
    lanes: FloatArray,
) -> None:
    """Carry V_C2 through a piece that starts s after the segment's start at t.

    `fires` holds pairs (from, to) of the intervals with Q > V_fire, s after the piece's
    start, empty ones with to <= from. Q is wrong by `Q_error` for long, and by `missed`
    to and fro, of which V_C2 sums up no more than `swing`, V, over the whole piece
    `over` times that. `spikes` has room for as many as Q allows, see `most_spikes`.
    """
    tau = par[TAU_L]
    per_tau = 1.0 / tau
    to_x = 2.0 / length
    V_f, V_r = par[V_FIRE], par[V_RESET]
    known = again = False
    Q = P_now = drift = 0.0
    charges = 0  # of the last ones, that are known
    if degree <= ORDER:
        for n in range(degree + 1, ORDER + 1):
            P[n] = 0.0
    for k in range(fires.size // 2):
        a, b = fires[2 * k], fires[2 * k + 1]
        while b > a:
            if S[RESUME] >= 0.0:
                if S[RESUME] >= b:
                    break
                S[REF], S[REF_LOW], S[VOLTAGE] = S[RESUME], 0.0, V_r
                S[RESUME] = -1.0
                known = False
            ref = S[REF]
            left = (b - ref) - S[REF_LOW]
            if left <= 0.0:
                break
            V = S[VOLTAGE]
            if not known:
                Q, P_now = both_at(q, P, degree, ref * to_x - 1.0)
            more = left > 2.0 * lanes[train.BEFORE] and ref >= a
            if charges > 0 and degree <= ORDER and more:
                foretell(lanes)
                lanes[train.FROM_Q], lanes[train.FROM_P] = Q, P_now
                found, rounds = together(
                    ref, to_x, b, S[ERROR], tau * drift, q, P, par, lanes
                )  # fmt: skip
                S[SEARCHES] += rounds
                for i in range(found):
                    if S[RESUME] >= 0.0:
                        S[REF], S[REF_LOW], S[RESUME] = S[RESUME], 0.0, -1.0
                    d = lanes[train.CHARGE + i]
                    shift, bend = lanes[train.SHIFT + 1 + i], lanes[train.BEND + 1 + i]
                    Q = lanes[train.AT_Q + i] + shift * bend
                    strike(
                        t, s, d, lanes[train.DECAY + i], Q, lanes[train.REST + i], b,
                        length, True, Q_error, missed, swing, True, y, par, S, spikes,
                        keep, most,
                    )  # fmt: skip
                    if S[TOO_FAST] != 0.0:
                        return
                    remember(d, charges, lanes)
                    charges += 1
                if found > 0:
                    # the series there, from those evaluated last
                    drift = bend * per_tau
                    P_now = lanes[train.AT_P + found - 1]
                    rises = lanes[train.AT_Q + found - 1] - P_now
                    P_now += shift * (rises + 0.5 * shift * (bend - rises))
                    known = True
                    continue
            Q_ref, P_ref = Q, P_now
            above = V - P_ref
            need = V_f - V
            low, high = 0.0, left
            sure = False
            d, e, short = max(a - ref, 0.0), 0.0, 0.0
            if need > 0.0:
                d = left
                if charges > 2:
                    d = (
                        lanes[train.BEFORE]
                        + lanes[train.BEFORE + 1]
                        + lanes[train.BEFORE + 2]
                    )
                elif -above > need:
                    # as if P went on in a straight line
                    rises = (Q_ref - P_ref) * per_tau
                    d = -tau * math.log1p(need / above)
                    rise = rises - (above + need) * per_tau
                    if rise > 0.0:
                        d -= d * rises / rise
                d = min(d, left) if d > 0.0 else left
                drift_before = drift if charges > 0 else 0.0
                too_low, margin = False, 0.0
                for _ in range(100):
                    S[SEARCHES] += 1.0
                    e = math.expm1(-d / tau)
                    Q, P_now = both_at(q, P, degree, (ref + d) * to_x - 1.0)
                    w = above * e + (P_now - P_ref) - need
                    slope = (Q - V_f - w) * per_tau
                    # V_C2' = (Q - V_C2)/tau_L with Q on a straight line; what bends Q
                    # decides what is left
                    drift = (Q - Q_ref) / d
                    rises = (Q - P_now) * per_tau
                    change = after = np.inf
                    # no digits beyond those that the estimate tells
                    enough = 1e-16 * d
                    if slope > 0.0:
                        per_slope = 1.0 / slope
                        enough = max(enough, 1e-3 * S[ERROR] * per_slope)
                        z = -w * per_slope * per_tau
                        g = drift * per_slope
                        bends = abs(z * (g - rises * per_slope))
                        if abs(z) < 1e-3:
                            c = 0.5 - 0.5 * g
                            change = 1.0 + z * (c + z * c * (2.0 * c - 1 / 3))
                            change *= z * tau
                            bends += abs(drift - drift_before) * per_slope
                            g = 1.0 + abs(g)
                            after = tau * z * z * (bends + z * z * g * g * g)
                        elif z < 1.0:
                            change = -tau * math.log1p(-z)
                            after = tau * z * z * (bends + abs(g))
                    following = d + change
                    settled = after <= enough and 0.0 < following < left
                    if not settled:
                        if w < 0.0:
                            if d >= left:
                                too_low = True
                                margin = -w
                                break
                            low = d
                        else:
                            high = d
                            sure = True
                        if following >= high and not sure:
                            following = left
                        elif not low <= following <= high:
                            following = 0.5 * (low + high)
                        if sure or following < left:
                            settled = abs(following - d) <= 1e-15 * d
                    step = following - d
                    d = following
                    if settled:
                        short = min(after, enough)
                        # the series there, from those just evaluated
                        bends = 0.5 * step * per_tau * (drift - rises)
                        P_now += step * (rises + bends)
                        Q += drift * step
                        break
                if too_low:
                    known = False
                    e = math.expm1(-left / tau)
                    error = later(S[ERROR], e, Q_error, missed, swing, V_f, again)
                    if margin < error:
                        S[DOUBT] = 1.0
                    break
            if need <= 0.0:
                e = math.expm1(-d / tau)
                Q, P_now = both_at(q, P, degree, (ref + d) * to_x - 1.0)
            known = True
            whole = need == V_f - V_r
            strike(
                t, s, d, e, Q, short, b, length, whole, Q_error, missed, swing, again,
                y, par, S, spikes, keep, most,
            )  # fmt: skip
            if S[TOO_FAST] != 0.0:
                return
            if again:
                remember(d, charges, lanes)
                charges += 1
            again = True
    if S[RESUME] >= length:
        S[RESUME] -= length
        return
    if S[RESUME] >= 0.0:
        S[REF], S[REF_LOW], S[VOLTAGE], S[RESUME] = S[RESUME], 0.0, V_r, -1.0
        known = False
    d = (length - S[REF]) - S[REF_LOW]
    if d > 0.0:
        if not known:
            P_now = P[0] + series_at(P, degree, S[REF] * to_x - 1.0)
        e = math.expm1(-d / tau)
        V = S[VOLTAGE]
        P_end = P[0]
        for n in range(1, degree + 1):
            P_end += P[n]
        S[VOLTAGE] = V + (V - P_now) * e + (P_end - P_now)
        if S[REF] == 0.0:
            swing, missed = over * swing, over * missed
        S[ERROR] = later(S[ERROR], e, Q_error, missed, swing, V, again)
    S[REF] = S[REF_LOW] = 0.0
