"""The solver's loop: segments of the force, steps of V_C1, pieces of V_C2."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model import train
from tactile_lab.model.circuit import LARGEST_VOLTAGE
from tactile_lab.model.compiled import entry, inner, inner_making_arrays, source_stamp
from tactile_lab.model.integrator import (
    MOST_TERMS,
    T_EPS,
    TAU_L,
    V_FIRE,
    V_RESET,
    Q_along,
    Q_gain,
    needed,
    particular,
    series_at,
    to_series,
)
from tactile_lab.model.need import DENSE, DENSE_V_C2, INTEGRATOR, NODE_A, SPIKES
from tactile_lab.model.node_a import (
    DIVIDER,
    LAMBDA,
    OF_B,
    ROWS,
    TAU,
    V_T,
    B_at,
    V_P_at,
    collocate,
    equilibrium,
    slope_at,
)
from tactile_lab.model.scratch import borrowed, room_for
from tactile_lab.model.spiking import (
    COUNT,
    EPS,
    KNOWN,
    LAST,
    PREVIOUS,
    RESUME,
    SHORTEST,
    TOO_FAST,
    VOLTAGE,
    grown,
    most_spikes,
    run_piece,
)
from tactile_lab.model.tableau import NODES, ORDER
from tactile_lab.model.threshold import above_threshold
from tactile_lab.model.truncation import carried, longer, missing, unseen

SEGMENT_ROW, STEP_ROW, PIECE_ROW = 4, 3 + ORDER + 1, 6 + MOST_TERMS + 1
"""Columns of the dense stores: t T V0 p; t s h series; t s h degree V resume series."""
DONE, STUCK, FAST, NOT_FINITE, STRONG = range(5)
SHARE, SHARE_Q = 0.1, 0.5
"""Of the tolerance: what a step's series of V_C1, V, and of Q, V, may be wrong by."""
SWING = 0.02
"""What the error of a series between its nodes comes to when summed up over part of its
step, of what that is estimated at: 0.04 of its true maximum, which is a third of it."""
KNEE = 12.0
"""From so many V_T down exp(-V_C1/V_T) bends V_C1."""
SHORTEST_SEGMENT = 1e-290
"""A segment shorter than this is a jump, s."""
Y, Y_ERROR, Y_LARGEST_ERROR, V_P, V_P_HIGHEST, FORCE, TIME = range(KNOWN, KNOWN + 7)
"""What the memory `S` holds beside the integrator and its spikes: V_C1, V_P, and what
the force, N, and the time, s, are where the slice begins, and then where it ends."""
STEPS, ITERATIONS, REJECTED, SEGMENTS, PIECES, EXPANSIONS = range(TIME + 1, TIME + 7)
ROWS_0, ROWS_1, ROWS_2, ERRORS = range(EXPANSIONS + 1, EXPANSIONS + 5)
"""Counters of work and of rows stored; from `ERRORS` on an `ellipse`, where V_C1 and
V_C2 are solved together."""
FRESH = np.zeros(ERRORS + 3)
"""The memory before the first spike."""
FRESH[RESUME] = -1.0
FRESH[LAST] = FRESH[PREVIOUS] = -np.inf
FRESH[SHORTEST] = np.inf

nodes_room, matrix_room = room_for(ROWS), room_for(ORDER, ORDER)
series_room, points_room = room_for(ORDER + 1), room_for(3 * (ORDER + 1))
q_room, P_room = room_for(ORDER + 2), room_for(2 * MOST_TERMS + 2)
fires_room, lanes_room = room_for(4), room_for(train.ROOM)
wave_room, spikes_room = room_for(2, 32), room_for(256)
segments_room, steps_room = room_for(8, SEGMENT_ROW), room_for(16, STEP_ROW)
pieces_room = room_for(16, PIECE_ROW)


@inner_making_arrays
def more_rows(rows: FloatArray, count: int) -> FloatArray:
    """The store, or a copy of twice its length where it is full."""
    if count < rows.shape[0]:
        return rows
    larger = np.empty((2 * rows.shape[0], rows.shape[1]))
    for i in range(count):
        for j in range(rows.shape[1]):
            larger[i, j] = rows[i, j]
    return larger


@inner_making_arrays
def stored(
    spikes: FloatArray,
    count: int,
    segments: FloatArray,
    steps: FloatArray,
    pieces: FloatArray,
    S: FloatArray,
) -> FloatArray:
    """`count` spikes, then the rows that are filled: one array to hand out."""
    size = count + int(S[ROWS_0]) * SEGMENT_ROW
    size += int(S[ROWS_1]) * STEP_ROW + int(S[ROWS_2]) * PIECE_ROW
    whole = np.empty(size)
    for i in range(count):
        whole[i] = spikes[i]
    at = count
    for rows, filled in (
        (segments, S[ROWS_0]), (steps, S[ROWS_1]), (pieces, S[ROWS_2])
    ):  # fmt: skip
        # not by slices, whose message for sizes that differ takes 4 s to compile
        for row in range(int(filled)):
            for column in range(rows.shape[1]):
                whole[at] = rows[row, column]
                at += 1
    return whole


@inner
def after(time: FloatArray, t: float) -> int:
    """Number of points at or before t."""
    low, high = 0, time.size
    while low < high:
        middle = (low + high) // 2
        if time[middle] <= t:
            low = middle + 1
        else:
            high = middle
    return low


@inner
def value_at(time: FloatArray, value: FloatArray, k: int, t: float) -> float:
    """The waveform at t, k points of which are at or before t."""
    if k == 0:
        return float(value[0])
    if k == time.size:
        return float(value[k - 1])
    t0, t1, F0, F1 = time[k - 1], time[k], value[k - 1], value[k]
    return float(F0 + (t - t0) / (t1 - t0) * (F1 - F0))


@inner_making_arrays
def points_between(
    time: FloatArray,
    value: FloatArray,
    until: float,
    points: FloatArray,
    S: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """The force from the state on: its own value, a jump to the waveform's, points.

    They are put into `points`, if it is large enough. `S` then is that of `until`.
    """
    start, force = S[TIME], S[FORCE]
    first, stop = after(time, start), after(time, until)
    ends = stop > first and time[stop - 1] == until
    n = 2 + stop - first + (0 if ends else 1)
    if n > points.shape[1]:
        points = np.empty((2, n))
    t, F = points[0, :n], points[1, :n]
    t[0] = t[1] = start
    F[0], F[1] = force, value_at(time, value, first, start)
    for i in range(first, stop):
        t[2 + i - first], F[2 + i - first] = time[i], value[i]
    if not ends:
        t[n - 1], F[n - 1] = until, value_at(time, value, stop, until)
    S[TIME], S[FORCE] = until, F[n - 1]
    return t, F


@inner
def largest_of(values: FloatArray) -> float:
    """Largest magnitude."""
    found = 0.0
    for x in values:
        found = max(found, abs(x))
    return found


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
        node_a, integrate = asked & NODE_A != 0, asked & INTEGRATOR != 0
        keep_spikes, keep_1 = asked & SPIKES != 0, asked & DENSE != 0
        keep_2 = asked & DENSE_V_C2 != 0
        par, S = borrowed(par), borrowed(S)
        time, force = points_between(wave_time, wave, until, wave_room(), S)
        if not abs(k_F) * largest_of(force) <= LARGEST_VOLTAGE:
            status = STRONG
        seg_rows, step_rows, piece_rows = segments_room(), steps_room(), pieces_room()
        spikes = spikes_room()
        nodes, matrix = nodes_room(), matrix_room()
        values, a, part = series_room(), series_room(), points_room()
        Q = part[ORDER + 1 :]
        q, P = q_room(), P_room()
        q[ORDER + 1] = 0.0
        fires, piece_fires = fires_room(), fires_room()
        lanes = lanes_room()
        B1 = B_at(S[V_P], par)
        y_b = equilibrium(B1, par)
        for k in range(time.size - 1 if status == DONE else 0):
            T = time[k + 1] - time[k]
            if T < SHORTEST_SEGMENT:
                S[V_P] += k_F * (force[k + 1] - force[k])
                S[V_P_HIGHEST] = max(S[V_P_HIGHEST], S[V_P])
                B1 = B_at(S[V_P], par)
                y_b = equilibrium(B1, par)
                continue
            t = time[k]
            V0 = S[V_P]
            p = k_F * (force[k + 1] - force[k]) / T
            V1 = V_P_at(T, V0, p, par[TAU])
            S[SEGMENTS] += 1.0
            n = int(S[ROWS_0])
            seg_rows = more_rows(seg_rows, n)
            seg_rows[n, 0] = t
            seg_rows[n, 1] = T
            seg_rows[n, 2] = V0
            seg_rows[n, 3] = p
            if keep_1:
                S[ROWS_0] += 1.0
            S[V_P] = V1
            S[V_P_HIGHEST] = max(S[V_P_HIGHEST], V1)
            if not node_a:
                continue
            y = S[Y]
            B0, y_a = B1, y_b
            B1 = B_at(V1, par)
            y_b = equilibrium(B1, par)
            low = min(y, y_a, y_b) - 1e-3 * par[V_T]
            high = max(y, y_a, y_b) + 1e-3 * par[V_T]
            s, B_s = 0.0, B0
            rate = par[LAMBDA] + B0 * math.exp(-y / par[V_T]) / par[V_T]
            slope = slope_at(B0, y, par)
            h = T
            if V1 != V0 or abs(slope) > 1e-14 * rate * high:
                first = (SHARE * tolerance / 1e-11) ** (1.0 / (ORDER + 1))
                h = min(h, max(4.0 * first / rate, 1e-280))
            tries = 0
            falls = min(y_a, y_b) < KNEE * par[V_T]
            while s < T:
                if falls:
                    # V_C1 bends where exp(-V_C1/V_T) appears: not beyond it at once
                    slope = slope_at(B_s, y, par)
                    fall = max(0.5 * y, y - KNEE * par[V_T])
                    if y > par[V_T] and slope * h < -fall:
                        h = -fall / slope
                if s + 1.0001 * h >= T:
                    h = T - s
                elif s + 1.8 * h > T:
                    h = 0.5 * (T - s)
                tries += 1
                if tries > 200000 or h <= 0.0:
                    status = STUCK
                    break
                biggest = max(abs(y), abs(high))
                wanted = max(SHARE * tolerance, 6e-16 * biggest)
                done, unsolved = collocate(
                    s, h, y, B_s, V0, p, low, high, wanted, par, nodes, matrix,
                )  # fmt: skip
                if done < 0:
                    h *= 0.2
                    S[REJECTED] += 1.0
                    continue
                S[ITERATIONS] += done
                values[0] = y
                for i in range(ORDER):
                    values[i + 1] = y + nodes[i]
                # the series of the change, for the sake of its last digits
                part[0] = 0.0
                for i in range(ORDER):
                    part[i + 1] = nodes[i]
                to_series(part, a)
                a[0] += y
                biggest = max(abs(y), abs(values[ORDER]))
                left = missing(a, biggest)
                stays = carried(a, left)
                rate = par[LAMBDA] + B_s * math.exp(-y / par[V_T]) / par[V_T]
                rise = slope_at(B_s, y, par)
                layer = unseen(rise, rate, h, left, a)
                # exp(-V_C1/V_T) on the way up, gone before the first nodes; where a
                # force holds V_C1 down, its slope alone is rounding times a huge rate
                if min(nodes[0], NODES[0] * h * rise) > par[V_T] / 3.0:
                    closing = (rate - par[LAMBDA]) * par[V_T]
                    layer = max(layer, closing * par[V_T] / rise)
                if left + layer > 3.0 * wanted:
                    h *= min(max(0.1, longer(a, biggest, wanted, 0.0)), 0.5)
                    S[REJECTED] += 1.0
                    continue
                S[STEPS] += 1.0
                error_in = S[Y_ERROR]
                # B carries the rounding of its exponent: so does V_C1
                depth = abs(par[DIVIDER] - min(y, values[ORDER]))
                floor = EPS * (biggest + 12.0 * depth) + unsolved
                error = error_in + left + layer + floor
                S[Y_LARGEST_ERROR] = max(S[Y_LARGEST_ERROR], error)
                S[Y_ERROR] = (
                    error_in * math.exp(-par[LAMBDA] * h) + stays + layer + floor
                )
                if keep_1:
                    step_rows = more_rows(step_rows, int(S[ROWS_1]))
                    n = int(S[ROWS_1])
                    step_rows[n, 0] = t
                    step_rows[n, 1] = s
                    step_rows[n, 2] = h
                    for i in range(ORDER + 1):
                        step_rows[n, 3 + i] = a[i]
                    S[ROWS_1] += 1.0
                if integrate:
                    asked = False
                    u, width = 0.0, 1.0
                    Q_error_y = error_in + stays + layer + floor
                    while u < 1.0:
                        if width < 1.0:
                            x = 2.0 * u - 1.0
                            part[0] = a[0] + series_at(a, a.size - 1, x)
                            for i in range(ORDER):
                                x = 2.0 * (u + width * NODES[i]) - 1.0
                                part[i + 1] = a[0] + series_at(a, a.size - 1, x)
                        else:
                            for i in range(ORDER + 1):
                                part[i] = values[i]
                        Q_along(part, par)
                        Q_low, Q_high = np.inf, -np.inf
                        for i in range(ORDER + 1):
                            Q_low, Q_high = min(Q_low, Q[i]), max(Q_high, Q[i])
                        to_series(Q, q)
                        S[EXPANSIONS] += 1.0
                        span = par[V_FIRE] - par[V_RESET]
                        largest_Q = max(abs(Q_low), abs(Q_high))
                        gain = Q_gain(Q_high, par)
                        # the last digit of V_C1, which "direct" multiplies
                        rounding = max(largest_Q, 2.0 * biggest * gain)
                        left_q = missing(q, rounding)
                        limit = max(
                            SHARE_Q * tolerance * (1.0 + max(Q_low, 0.0) / span),
                            2e-15 * rounding,
                        )
                        piece = width * h
                        r = piece / par[TAU_L]
                        degree = 0
                        if left_q <= limit:
                            degree = particular(q, r, largest_Q, P)
                        if degree == 0:
                            width *= 0.5
                            if width < 1e-12:
                                status = STUCK
                                break
                            continue
                        degree = needed(q, P, degree, 1e-18 * largest_Q)
                        S[PIECES] += 1.0
                        size = left_q
                        for i in range(1, ORDER + 1):
                            size += abs(q[i])
                        piece_fires[0] = piece_fires[2] = piece_fires[3] = piece
                        piece_fires[1] = piece
                        if q[0] - size > par[V_FIRE]:
                            piece_fires[0] = 0.0
                        elif q[0] + size >= par[V_FIRE]:
                            if not asked:
                                asked = True
                                above_threshold(
                                    a, y, values[ORDER], s, h, V0, p, par, fires
                                )
                            for i in range(4):
                                piece_fires[i] = (
                                    min(max(fires[i] - u, 0.0), width) * h
                                    if fires[i] < u + width
                                    else piece
                                )
                        if Q_low > par[V_FIRE]:
                            # refuse at once what would take for ever to count
                            slowest = par[T_EPS] + par[TAU_L] * math.log1p(
                                span / (Q_low - par[V_FIRE])
                            )
                            if S[COUNT] + piece / slowest > most + 2.0:
                                S[COUNT] = most
                                status = FAST
                                break
                        if keep_2:
                            piece_rows = more_rows(piece_rows, int(S[ROWS_2]))
                            n = int(S[ROWS_2])
                            piece_rows[n, 0] = t
                            piece_rows[n, 1] = s + u * h
                            piece_rows[n, 2] = piece
                            piece_rows[n, 3] = degree
                            piece_rows[n, 4] = S[VOLTAGE]
                            piece_rows[n, 5] = S[RESUME]
                            for i in range(degree + 1):
                                piece_rows[n, 6 + i] = P[i]
                            S[ROWS_2] += 1.0
                        # what a series misses changes its sign at every node of its
                        # own, so C2 sums up no more than SWING of it over a step, and
                        # nothing over a whole one, as Radau's rule integrates twice its
                        # degree
                        missed = gain * left + left_q
                        swing = SWING * (gain * left * h / par[TAU_L] + left_q * r)
                        over = 1.0
                        if width == 1.0:
                            over = min(1.0, 0.02 + (0.1 * r) ** 4)
                        Q_error = gain * Q_error_y + EPS * largest_Q
                        if keep_spikes:
                            more = most_spikes(piece, q[0] + size, most, par)
                            if int(S[COUNT]) + more >= spikes.size:
                                spikes = grown(spikes, int(S[COUNT]) + more)
                        run_piece(
                            t, s + u * h, piece, q, P, degree, piece_fires, Q_error,
                            missed, swing, over, values[ORDER], par, S,
                            borrowed(spikes), keep_spikes, most, lanes,
                        )  # fmt: skip
                        if S[TOO_FAST] != 0.0:
                            status = FAST
                            break
                        u += width
                        width = min(2.0 * width, 1.0 - u)
                    if status != DONE:
                        break
                s += h
                y, B_s = values[ORDER], nodes[OF_B + ORDER - 1]
                if not abs(y) < np.inf or not abs(S[VOLTAGE]) < np.inf:
                    status = NOT_FINITE
                    break
                if s < T:
                    growth = longer(a, biggest, wanted, rate * h)
                    h *= min(max(growth, 0.2), 30.0)
            S[Y] = y
            if status != DONE:
                break
        count = int(S[COUNT]) if keep_spikes and status == DONE else 0
        return status, stored(spikes, count, seg_rows, step_rows, piece_rows, S)

    return run


run = _build(source_stamp())
