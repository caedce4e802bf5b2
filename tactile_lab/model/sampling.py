"""Values of a solved slice at any times, from its dense stores."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from tactile_lab.arrays import FloatArray
from tactile_lab.model.compiled import entry, inner, source_stamp
from tactile_lab.model.integrator import T_EPS, TAU_L, V_FIRE, V_RESET, series_at
from tactile_lab.model.node_a import TAU, V_P_at

SAMPLED_V_P, SAMPLED_V_C1, SAMPLED_V_C2 = range(3)


@inner
def last_at(starts: FloatArray, t: float, guess: int) -> int:
    """Index of the last start at or before t; `guess` is one that may be near."""
    n = starts.size
    if 0 <= guess < n and starts[guess] <= t:
        if guess + 1 >= n or t < starts[guess + 1]:
            return guess
        if guess + 2 >= n or t < starts[guess + 2]:
            return guess + 1
    low, high = -1, n
    while high - low > 1:
        middle = (low + high) // 2
        if starts[middle] <= t:
            low = middle
        else:
            high = middle
    return low


def _build(stamp: int) -> Callable[..., Any]:
    @entry
    def sample(
        kind: int,
        times: FloatArray,
        starts: FloatArray,
        rows: FloatArray,
        spikes: FloatArray,
        par: FloatArray,
        out: FloatArray,
    ) -> None:
        _ = stamp
        i, j = 0, -1
        for k in range(times.size):
            t = times[k]
            i = max(last_at(starts, t, i), 0)
            row = rows[i]
            if kind == SAMPLED_V_P:
                s = min(max(t - row[0], 0.0), row[1])
                out[k] = V_P_at(s, row[2], row[3], par[TAU])
                continue
            length = row[2]
            v = min(max((t - row[0]) - row[1], 0.0), length)
            x = 2.0 * v / length - 1.0
            if kind == SAMPLED_V_C1:
                out[k] = row[3] + series_at(row[3:], row.size - 4, x)
                continue
            j = last_at(spikes, t, j)
            ref, V = 0.0, row[4]
            resume = row[5]
            if j >= 0:
                since = (spikes[j] - row[0]) - row[1]
                if since >= 0.0:
                    resume = min(since, length) + par[T_EPS]
            if resume >= 0.0:
                if v < resume:
                    out[k] = par[V_FIRE]
                    continue
                ref, V = resume, par[V_RESET]
            degree = int(row[3])
            P = row[6:]
            P_ref = series_at(P, degree, 2.0 * ref / length - 1.0)
            e = math.expm1(-(v - ref) / par[TAU_L])
            out[k] = V + (V - P[0] - P_ref) * e + series_at(P, degree, x) - P_ref

    return sample


sample = _build(source_stamp())
