"""The solver's loop: segments of the force, steps of V_C1, pieces of V_C2."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from tactile_lab.model.circuit import FloatArray
from tactile_lab.model.compiled import entry, inner, source_stamp
from tactile_lab.model.integrator import (
    LONG,
    MOST_TERMS,
    SHORT,
    T_EPS,
    TAU_L,
    V_FIRE,
    V_RESET,
    Q_at,
    Q_gain,
    particular,
    series_at,
    to_series,
)
from tactile_lab.model.node_a import (
    DIVIDER,
    LAMBDA,
    TAU,
    V_T,
    B_at,
    V_P_at,
    collocate,
    equilibrium,
    slope_at,
)
from tactile_lab.model.spiking import (
    COUNT,
    RESUME,
    TOO_FAST,
    VOLTAGE,
    run_piece,
)
from tactile_lab.model.tableau import NODES, ORDER
from tactile_lab.model.threshold import above_threshold
from tactile_lab.model.truncation import carried, missing, unseen

SEGMENT_ROW, STEP_ROW, PIECE_ROW = 4, 3 + ORDER + 1, 6 + MOST_TERMS + 1
"""Columns of the dense stores: t T V0 p; t s h series; t s h degree V resume series."""
STEPS, ITERATIONS, REJECTED, SEGMENTS, PIECES, EXPANSIONS = range(6)
ROWS_0, ROWS_1, ROWS_2 = range(6, 9)
DONE, STUCK, FAST, NOT_FINITE = range(4)
SHORTEST_SEGMENT = 1e-290
"""A segment shorter than this is a jump, s."""
Y, Y_ERROR, Y_LARGEST_ERROR, V_P, V_P_HIGHEST = range(5)
NODE, COUNTS = 5, 9
"""Lengths of the node's memory and of the counters."""


@inner
def more_rows(rows: FloatArray, count: int) -> FloatArray:
    """The store, or a copy of twice its length where it is full."""
    if count < rows.shape[0]:
        return rows
    larger = np.empty((2 * rows.shape[0], rows.shape[1]))
    for i in range(count):
        for j in range(rows.shape[1]):
            larger[i, j] = rows[i, j]
    return larger


def _build(stamp: int) -> Callable[..., Any]:
    @entry
    def run(
        time: FloatArray,
        force: FloatArray,
        k_F: float,
        par: FloatArray,
        node: FloatArray,
        S: FloatArray,
        counts: Any,
        tolerance: float,
        node_a: bool,
        integrate: bool,
        keep_spikes: bool,
        keep_1: bool,
        keep_2: bool,
        most: float,
    ) -> Any:
        _ = stamp
        status = 0
        seg_rows = np.empty((8 if node_a else max(time.size, 1), SEGMENT_ROW))
        step_rows = np.empty((16, STEP_ROW))
        piece_rows = np.empty((16, PIECE_ROW))
        spikes = np.empty(64)
        W = np.empty(ORDER)
        B = np.empty(ORDER)
        matrix = np.empty((ORDER, ORDER))
        right = np.empty(ORDER)
        values = np.empty(ORDER + 1)
        part = np.empty(ORDER + 1)
        a = np.empty(ORDER + 1)
        q = np.empty(ORDER + 1)
        P = np.empty(2 * MOST_TERMS + 2)
        fires = np.empty(4)
        piece_fires = np.empty(4)
        for k in range(time.size - 1):
            T = time[k + 1] - time[k]
            if T < SHORTEST_SEGMENT:
                node[V_P] += k_F * (force[k + 1] - force[k])
                node[V_P_HIGHEST] = max(node[V_P_HIGHEST], node[V_P])
                continue
            t = time[k]
            V0 = node[V_P]
            p = k_F * (force[k + 1] - force[k]) / T
            V1 = V_P_at(T, V0, p, par[TAU])
            counts[SEGMENTS] += 1
            n = counts[ROWS_0]
            seg_rows = more_rows(seg_rows, n)
            seg_rows[n, 0] = t
            seg_rows[n, 1] = T
            seg_rows[n, 2] = V0
            seg_rows[n, 3] = p
            if keep_1:
                counts[ROWS_0] += 1
            node[V_P] = V1
            node[V_P_HIGHEST] = max(node[V_P_HIGHEST], V1)
            if not node_a:
                continue
            y = node[Y]
            B0, B1 = B_at(V0, par), B_at(V1, par)
            y_a, y_b = equilibrium(B0, par), equilibrium(B1, par)
            low = min(y, y_a, y_b) - 1e-3 * par[V_T]
            high = max(y, y_a, y_b) + 1e-3 * par[V_T]
            s = 0.0
            rate = par[LAMBDA] + B0 * math.exp(-y / par[V_T]) / par[V_T]
            h = T
            if V1 != V0 or abs(slope_at(B0, y, par)) > 1e-14 * rate * high:
                h = min(h, max(2.0 / rate, 1e-280))
            tries = 0
            while s < T:
                if s + 1.0001 * h >= T:
                    h = T - s
                elif s + 1.8 * h > T:
                    h = 0.5 * (T - s)
                tries += 1
                if tries > 200000 or h <= 0.0:
                    status = STUCK
                    break
                done = collocate(s, h, y, V0, p, low, high, par, W, B, matrix, right)
                if done < 0:
                    h *= 0.2
                    counts[REJECTED] += 1
                    continue
                counts[ITERATIONS] += done
                values[0] = y
                for i in range(ORDER):
                    values[i + 1] = y + W[i]
                # the series of the change, for the sake of its last digits
                part[0] = 0.0
                for i in range(ORDER):
                    part[i + 1] = W[i]
                to_series(part, a)
                left = missing(a)
                stays = carried(a, left)
                B_s = B_at(V_P_at(s, V0, p, par[TAU]), par)
                rate = par[LAMBDA] + B_s * math.exp(-y / par[V_T]) / par[V_T]
                layer = unseen(slope_at(B_s, y, par), rate, h, left, a)
                tail = max(abs(a[ORDER]), 0.1 * abs(a[ORDER - 1]), layer)
                biggest = max(abs(y), abs(values[ORDER]))
                wanted = max(1e-3 * tolerance, 6e-16 * biggest)
                if tail > wanted:
                    h *= max(0.1, 0.85 * (wanted / tail) ** (1.0 / ORDER))
                    counts[REJECTED] += 1
                    continue
                a[0] += y
                counts[STEPS] += 1
                growth = 0.85 * (wanted / max(tail, 1e-40)) ** (1.0 / ORDER)
                error_in = node[Y_ERROR]
                # B carries the rounding of its exponent: so does V_C1
                depth = abs(par[DIVIDER] - min(y, values[ORDER]))
                floor = 2.5e-16 * (biggest + 12.0 * depth)
                error = error_in + left + layer + floor
                node[Y_LARGEST_ERROR] = max(node[Y_LARGEST_ERROR], error)
                node[Y_ERROR] = (
                    error_in * math.exp(-par[LAMBDA] * h) + stays + layer + floor
                )
                if keep_1:
                    step_rows = more_rows(step_rows, counts[ROWS_1])
                    n = counts[ROWS_1]
                    step_rows[n, 0] = t
                    step_rows[n, 1] = s
                    step_rows[n, 2] = h
                    for i in range(ORDER + 1):
                        step_rows[n, 3 + i] = a[i]
                    counts[ROWS_1] += 1
                if integrate:
                    above_threshold(a, s, h, V0, p, par, fires)
                    u, width = 0.0, 1.0
                    Q_error_y = error_in + max(0.05 * left, stays) + layer + floor
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
                        Q_low, Q_high = np.inf, -np.inf
                        for i in range(ORDER + 1):
                            part[i] = Q_at(part[i], par)
                            Q_low, Q_high = min(Q_low, part[i]), max(Q_high, part[i])
                        to_series(part, q)
                        counts[EXPANSIONS] += 1
                        tail_q = max(abs(q[ORDER]), 0.1 * abs(q[ORDER - 1]))
                        span = par[V_FIRE] - par[V_RESET]
                        largest_Q = max(abs(Q_low), abs(Q_high))
                        limit = max(
                            5e-3 * tolerance * (1.0 + max(Q_low, 0.0) / span),
                            2e-15 * largest_Q,
                            # the last digit of V_C1, which "direct" multiplies
                            4e-16 * biggest * Q_gain(Q_high, par),
                        )
                        piece = width * h
                        r = piece / par[TAU_L]
                        if tail_q > limit or SHORT < r < LONG:
                            width *= 0.5
                            if width < 1e-12:
                                status = STUCK
                                break
                            continue
                        degree = particular(q, r, P)
                        counts[PIECES] += 1
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
                            piece_rows = more_rows(piece_rows, counts[ROWS_2])
                            n = counts[ROWS_2]
                            piece_rows[n, 0] = t
                            piece_rows[n, 1] = s + u * h
                            piece_rows[n, 2] = piece
                            piece_rows[n, 3] = degree
                            piece_rows[n, 4] = S[VOLTAGE]
                            piece_rows[n, 5] = S[RESUME]
                            for i in range(degree + 1):
                                piece_rows[n, 6 + i] = P[i]
                            counts[ROWS_2] += 1
                        Q_error = (
                            Q_gain(Q_high, par) * Q_error_y
                            + missing(q)
                            + 2.5e-16 * largest_Q
                        )
                        spikes = run_piece(
                            t, s + u * h, piece, q, P, degree, piece_fires, Q_error,
                            values[ORDER], par, S, spikes, keep_spikes, most,
                        )  # fmt: skip
                        if S[TOO_FAST] != 0.0:
                            status = FAST
                            break
                        u += width
                        width = min(2.0 * width, 1.0 - u)
                    if status != DONE:
                        break
                s += h
                y = values[ORDER]
                if not abs(y) < np.inf or not abs(S[VOLTAGE]) < np.inf:
                    status = NOT_FINITE
                    break
                most_growth = 5.0 if tail > 1e-3 * wanted else 100.0
                h *= min(max(growth, 0.2), most_growth)
            node[Y] = y
            if status != DONE:
                break
        return (
            status,
            seg_rows,
            step_rows,
            piece_rows,
            spikes,
        )

    return run


run = _build(source_stamp())
