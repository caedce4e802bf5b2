"""The solver's loop where T1 saturates: V_C2 acts back on V_C1, both are one system.

Each step is solved for both voltages at once, as power series in time or, where that is
stiff, by collocation. It ends at a spike at the latest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model.circuit import LARGEST_VOLTAGE
from tactile_lab.model.compiled import entry, inner, source_stamp
from tactile_lab.model.ellipse import E_11, E_22, transform, widen
from tactile_lab.model.integrator import (
    MOST_TERMS,
    T_EPS,
    V_FIRE,
    V_RESET,
    V_S,
    series_at,
)
from tactile_lab.model.kernel import (
    DONE,
    ERRORS,
    EXPANSIONS,
    FAST,
    ITERATIONS,
    NOT_FINITE,
    PIECES,
    REJECTED,
    ROWS_0,
    ROWS_1,
    ROWS_2,
    SEGMENTS,
    SHARE,
    SHORTEST_SEGMENT,
    STEPS,
    STRONG,
    STUCK,
    V_P,
    V_P_HIGHEST,
    Y_ERROR,
    Y_LARGEST_ERROR,
    Y,
    largest_of,
    more_rows,
    pieces_room,
    points_between,
    segments_room,
    spikes_room,
    steps_room,
    stored,
    wave_room,
)
from tactile_lab.model.magnus import rested
from tactile_lab.model.need import DENSE, DENSE_V_C2, SPIKES
from tactile_lab.model.node_a import (
    DIVIDER,
    LAMBDA,
    TAU,
    V_T,
    B_at,
    V_P_at,
    equilibrium,
)
from tactile_lab.model.pair import (
    COLUMNS,
    GROWTH,
    LEFT_1,
    LEFT_2,
    LENGTH,
    MOVED,
    REACH,
    STAYS_1,
    STAYS_2,
    STEP,
    STIFF,
    STRETCH,
    TURN,
    V_END,
    V_P_END,
    Y_END,
    collocated,
    end_inside,
    first_crossing,
    flow,
    series_room,
    shortened,
)
from tactile_lab.model.power_series import MOST, ROW, V_C1, V_C2
from tactile_lab.model.scratch import borrowed, room_for
from tactile_lab.model.spiking import (
    COUNT,
    DOUBT,
    EPS,
    ERROR,
    LAST,
    RESUME,
    SEARCHES,
    SHORTEST_INTERVAL,
    TOO_FAST,
    VOLTAGE,
    fire,
    grown,
)
from tactile_lab.model.stretched_time import pace_at
from tactile_lab.model.tableau import ORDER
from tactile_lab.model.taylor import (
    V_C2_at,
    degree_for,
    end_at,
    expanded,
    fastest,
    highest,
    in_time,
    move,
    rising,
    to_chebyshev,
)
from tactile_lab.model.transistor import (
    A_BY_1,
    C2_BY_2,
    FLOW,
    TO_A,
    TO_C2,
    reach,
)

PATIENCE = 6
"""After so many steps that stability kept short it is stiff."""
FEW_UNITS = 4.0
"""A collocated step shorter than this, in units of the fastest rate, is not stiff."""

nodes_room, flow_room, step_room = room_for(2 * ORDER), room_for(FLOW), room_for(STEP)
matrix_room, right_room = room_for(2 * ORDER, 2 * ORDER), room_for(2 * ORDER, COLUMNS)
taylor_room = room_for(MOST + 2, ROW)


@inner
def restart(E: FloatArray, S: FloatArray, f: FloatArray) -> None:
    """End the reset, after which `flow` is f: an error in its time becomes one of V_C2.

    V_C1 goes on as before.
    """
    transform(E, 1.0, 0.0, 0.0, -f[TO_C2])
    S[RESUME] = -1.0


def _build(stamp: int) -> Callable[..., Any]:
    @entry
    def run(
        wave_time: FloatArray,
        wave: FloatArray,
        until: float,
        k_F: float,
        par: FloatArray,
        S: FloatArray,
        tolerance: float,
        asked: int,
        most: float,
    ) -> Any:
        _ = stamp
        status = DONE
        keep_spikes, keep_1 = asked & SPIKES != 0, asked & DENSE != 0
        keep_2 = asked & DENSE_V_C2 != 0
        par, S = borrowed(par), borrowed(S)
        time, force = points_between(wave_time, wave, until, wave_room(), S)
        E = S[ERRORS:]
        if not abs(k_F) * largest_of(force) <= LARGEST_VOLTAGE:
            status = STRONG
        seg_rows, step_rows, piece_rows = segments_room(), steps_room(), pieces_room()
        spikes = spikes_room()
        W, matrix, right = nodes_room(), matrix_room(), right_room()
        f, g, m = flow_room(), flow_room(), flow_room()
        a, b, part, d = series_room(), series_room(), series_room(), series_room()
        c, step = taylor_room(), step_room()
        full = degree_for(SHARE * tolerance)
        for k in range(time.size - 1 if status == DONE else 0):
            T = time[k + 1] - time[k]
            if T < SHORTEST_SEGMENT:
                S[V_P] += k_F * (force[k + 1] - force[k])
                S[V_P_HIGHEST] = max(S[V_P_HIGHEST], S[V_P])
                continue
            t, V0 = time[k], S[V_P]
            p = k_F * (force[k + 1] - force[k]) / T
            V1 = V_P_at(T, V0, p, par[TAU])
            S[SEGMENTS] += 1.0
            if keep_1:
                n = int(S[ROWS_0])
                seg_rows = more_rows(seg_rows, n)
                seg_rows[n, 0], seg_rows[n, 1] = t, T
                seg_rows[n, 2], seg_rows[n, 3] = V0, p
                S[ROWS_0] += 1.0
            S[V_P] = V1
            S[V_P_HIGHEST] = max(S[V_P_HIGHEST], V1)
            B0 = B_at(V0, par)
            y, v = S[Y], S[VOLTAGE]
            low, above, bounded = min(y, v), 0.0, False
            high = max(y, par[V_S], v, par[V_RESET]) + par[V_T]
            s = carry = 0.0
            V_P_s = V0
            if S[RESUME] == 0.0:
                v = par[V_RESET]
                flow(B0, y, v, False, par, f)
                restart(E, S, f)
            held = S[RESUME] >= 0.0
            if held:
                v = par[V_FIRE]
            flow(B0, y, v, held, par, f)
            moving = abs(f[TO_A]) > -1e-14 * f[A_BY_1] * high
            moving |= abs(f[TO_C2]) > -1e-14 * f[C2_BY_2] * high
            at_rest = V1 == V0 and not (moving or held)
            stiff = V1 == V0 and not moving
            h = T
            known = False
            tries = short = 0
            while s < T:
                held = S[RESUME] >= 0.0
                room = min(T - s, S[RESUME]) if held else T - s
                tries += 1
                if tries > 200000 or h <= 0.0:
                    status = STUCK
                    break
                wanted = max(SHARE * tolerance, 6e-16 * max(abs(y), abs(v)))
                if not known:
                    flow(B_at(V_P_s, par), y, v, held, par, f)
                known = True
                rate = fastest(f)
                degree = 0
                stiff = stiff or short >= PATIENCE
                if not stiff:
                    degree = expanded(
                        room, y, v, held, V_P_s, p, rate, wanted, full, par, f, g, c,
                        step,
                    )  # fmt: skip
                    S[ITERATIONS] += 1.0
                    h = step[LENGTH]
                    short = short + 1 if degree and step[STIFF] != 0.0 else 0
                if at_rest:
                    h = room
                    rested(h, y, v, f, a, b, step)
                elif degree == 0:
                    if not bounded:
                        B1 = B_at(V1, par)
                        low = min(low, equilibrium(B0, par), equilibrium(B1, par))
                        # leakage of T1 alone can pull it down, by less than I_T1s
                        low -= 1e-3 * par[V_T]
                        above = reach(low, max(B0, B1) + par[LAMBDA] * high, par)
                        bounded = True
                    if 1.0001 * h >= room:
                        h = room
                    elif 1.8 * h > room:
                        h = 0.5 * room
                    stiff = True
                    done = collocated(
                        s, h, y, v, held, V0, p, low, high, max(above, v - y), wanted,
                        f, par, W, g, matrix, right, a, b, step,
                    )  # fmt: skip
                    if done < 0:
                        h = step[LENGTH]
                        S[REJECTED] += 1.0
                        continue
                    S[ITERATIONS] += done
                    stiff, short = h * rate > FEW_UNITS, 0
                # B carries the rounding of its exponent: so does V_C1
                depth = abs(par[DIVIDER] - min(y, step[Y_END]))
                floor_1 = 5e-16 * (max(abs(y), abs(step[Y_END])) + 12.0 * depth)
                floor_2 = 1e-15 * (max(abs(v), abs(step[V_END])) + abs(par[V_FIRE]))
                inside = step[LEFT_2] + floor_2 + math.sqrt(E[E_22])
                x, whole, u = step[REACH], h, 2.0
                if not held and (
                    degree == 0
                    or highest(c, degree, x, step[V_END]) > par[V_FIRE] - 2.0 * inside
                ):
                    S[SEARCHES] += 1.0
                    u = 0.0
                    if degree:
                        near = 1e-3 * inside
                        u = rising(c, degree, x, par[V_FIRE], step[V_END], near) / x
                    if u == 0.0:
                        if degree:
                            to_chebyshev(c[:, V_C2], degree, x, part, b)
                        u, doubt = first_crossing(b, par[V_FIRE], inside, part, d)
                        if doubt:
                            S[DOUBT] = 1.0
                if u < 1.0:
                    step[STAYS_1] = max(step[STAYS_1], step[LEFT_1])
                    step[STAYS_2] = max(step[STAYS_2], step[LEFT_2])
                    if degree:
                        end_at(u * x, held, V_P_s, p, degree, par, c, g, step)
                        h = step[LENGTH]
                    else:
                        end_inside(u, y, v, W, right, step)
                        h *= u
                if degree:
                    move(held, degree, par, c, f, m, g, step)
                S[STEPS] += 1.0
                S[EXPANSIONS] += 1.0
                S[Y_LARGEST_ERROR] = max(
                    S[Y_LARGEST_ERROR],
                    math.sqrt(E[E_11]) + step[LEFT_1] + floor_1,
                )
                transform(
                    E, step[MOVED], step[MOVED + 1], step[MOVED + 2], step[MOVED + 3]
                )
                stays_1 = step[STAYS_1] + floor_1
                stays_2 = EPS * h
                if not held:
                    # V_C2 follows what is wrong with V_C1 during the step
                    stays_2 = step[STAYS_2] + floor_2
                    stays_2 += abs(step[MOVED + 2]) * max(0.05 * step[LEFT_1], stays_1)
                widen(E, stays_1, stays_2)
                # a power series reaches farther than one of Chebyshev's: two of these
                S[PIECES] += 1.0
                halves = 2 if degree else 1
                for half in range(halves):
                    begins, length = 0.0, h
                    if keep_1:
                        if degree:
                            begins, length = in_time(
                                c[:, V_C1], degree, half, step, part, d
                            )
                        else:
                            shortened(a, min(u, 1.0), part, d)
                        n = int(S[ROWS_1])
                        step_rows = more_rows(step_rows, n)
                        step_rows[n, 0], step_rows[n, 1] = t, s + begins
                        step_rows[n, 2] = length
                        for i in range(ORDER + 1):
                            step_rows[n, 3 + i] = d[i]
                        S[ROWS_1] += 1.0
                    if keep_2:
                        if degree:
                            begins, length = in_time(
                                c[:, V_C2], degree, half, step, part, d
                            )
                        else:
                            shortened(b, min(u, 1.0), part, d)
                        n = int(S[ROWS_2])
                        piece_rows = more_rows(piece_rows, n)
                        piece_rows[n, 0], piece_rows[n, 1] = t, s + begins
                        piece_rows[n, 2] = length
                        piece_rows[n, 3] = ORDER
                        # the series is all: nothing is left for the exponential
                        piece_rows[n, 4] = d[0] + series_at(d, ORDER, -1.0)
                        piece_rows[n, 5] = 2.0 * h if held else -1.0
                        for i in range(ORDER + 1):
                            piece_rows[n, 6 + i] = d[i]
                        for i in range(ORDER + 1, MOST_TERMS + 1):
                            piece_rows[n, 6 + i] = 0.0
                        S[ROWS_2] += 1.0
                y, v = step[Y_END], step[V_END]
                h_next = h * step[GROWTH]
                if not (abs(y) < np.inf and abs(v) < np.inf):
                    status = NOT_FINITE
                    break
                last = s + h >= T
                following = s + (h + carry)
                carry = (s - following) + (h + carry)
                s = following
                V_P_s = step[V_P_END] if degree else V_P_at(s, V0, p, par[TAU])
                if held:
                    S[RESUME] -= h
                # a series ends where `flow` was asked for, and the next one begins
                known = degree > 0 and u > 1.0
                if known:
                    f, g = g, f
                if u <= 1.0:
                    if degree:
                        f, g = g, f
                    else:
                        flow(B_at(V_P_s, par), y, v, False, par, f)
                    # where it only grazes V_fire, the step is all that is known
                    slope = max(f[TO_C2], inside / h)
                    late = (par[V_FIRE] - v) / slope
                    error = math.sqrt(E[E_22]) / slope + EPS * (t + s)
                    if degree:
                        whole = x * pace_at(u * x, step[STRETCH], step[TURN])
                    # does the series stay above V_fire by more than its error?
                    u += min(max(2.0 * error / whole, 1e-7), 0.02)
                    if degree:
                        beyond = V_C2_at(c, degree, u * x)
                    else:
                        beyond = b[0] + series_at(b, ORDER, 2.0 * u - 1.0)
                    if beyond <= par[V_FIRE]:
                        S[DOUBT] = 1.0
                    at = t + (s + (carry + late))
                    fire_before = S[LAST]
                    fire(at, error, S)
                    if keep_spikes:
                        spikes = grown(spikes, int(S[COUNT]))
                        spikes[int(S[COUNT]) - 1] = at
                    closest = max(SHORTEST_INTERVAL, 4.0 * EPS * abs(at))
                    if at - fire_before < closest or S[COUNT] >= most:
                        S[TOO_FAST] = 1.0
                        status = FAST
                        break
                    # the rest starts there, not where the step ended
                    y += f[TO_A] * late
                    S[Y_LARGEST_ERROR] = max(
                        S[Y_LARGEST_ERROR],
                        math.sqrt(E[E_11]) + abs(f[TO_A] * late),
                    )
                    following = s + (carry + late)
                    carry = (s - following) + (carry + late)
                    s = following
                    V_P_s = V_P_at(s, V0, p, par[TAU])
                    S[RESUME], v, held = par[T_EPS], par[V_RESET], par[T_EPS] > 0.0
                    # node A is told the same of a collector that is kept at V_reset
                    # and of one that goes on from there
                    flow(B_at(V_P_s, par), y, v, held, par, g)
                    transform(E, 1.0, (g[TO_A] - f[TO_A]) / slope, 0.0, -1.0 / slope)
                    f, g, known = g, f, True
                    last, tries, short, stiff = False, 0, 0, False
                    if held:
                        v = par[V_FIRE]
                if last:
                    s = T
                h = h_next
                if S[RESUME] == 0.0:
                    if v != par[V_RESET]:
                        v = par[V_RESET]
                        flow(B_at(V_P_s, par), y, v, False, par, f)
                    restart(E, S, f)
                    known, short, stiff = True, 0, False
            S[Y], S[VOLTAGE] = y, v
            if status != DONE:
                break
        S[Y_ERROR], S[ERROR] = math.sqrt(E[E_11]), math.sqrt(E[E_22])
        count = int(S[COUNT]) if keep_spikes and status == DONE else 0
        return status, stored(spikes, count, seg_rows, step_rows, piece_rows, S)

    return run


run = _build(source_stamp())
