"""A block of taxels, from load to spikes, without returning to Python in between."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model import coupled, kernel, spiking
from tactile_lab.model.batch import appended, begun, numbers_of, train
from tactile_lab.model.compiled import entry, inner, inner_making_arrays, source_stamp
from tactile_lab.model.integrator import TAU_L, V_FIRE, Y_CRITICAL, Q_at
from tactile_lab.model.need import INTEGRATOR, NODE_A, SPIKES
from tactile_lab.model.node_a import LAMBDA, TAU, B_at, V_P_at, equilibrium
from tactile_lab.model.rest_pair import rest_of_both
from tactile_lab.model.scratch import read_only
from tactile_lab.model.transistor import (
    ALL_PARAMETERS,
    I_S1,
    PER_F,
    PER_R,
    SATURATES,
    T1_C1,
    T1_C2,
)
from tactile_lab.skin.forces import SAMPLED, SOURCES, force_on, thinned

FIRED, SILENT, UNTOUCHED, DEAD, STUCK, REFUSED = range(6)
"""What became of a taxel: it fired; it was solved and did not; it was not solved, for
its force cannot bring it to threshold; it is broken; it fires at its own rate; the
solver refused it."""
NEAR = 1e-6
"""A taxel is solved whose V_C1 may come so near to where it would fire, V."""
CHUNK = 1 << 12
"""Spike times for which there is room at first."""


@inner
def highest_V_P(time: FloatArray, force: FloatArray, k_F: float, tau: float) -> float:
    """The highest V_P under a force from rest, V: it is monotone on every piece."""
    V = highest = 0.0
    for k in range(time.size - 1):
        T = time[k + 1] - time[k]
        V = V_P_at(T, V, k_F * (force[k + 1] - force[k]) / T, tau)
        highest = max(highest, V)
    return highest


@inner
def surely_silent(V: float, par: FloatArray) -> bool:
    """Whether V_C1 cannot come down to where V_C2 would reach V_fire.

    V_C1 starts at its equilibrium, and is never below the lowest equilibrium so far:
    that of V, the highest V_P. A T1 that saturates can pull it down by its leakage
    I_T1s alone, and brings C2 no more than I_T1s (1 + 1/beta_R) beyond Eq. (17).
    """
    lowest = equilibrium(B_at(V, par), par) - NEAR
    if par[SATURATES] == 0.0:
        return bool(lowest > par[Y_CRITICAL])
    lowest -= par[I_S1] * (par[PER_F] + par[PER_R]) / (par[T1_C1] * par[LAMBDA])
    more = par[I_S1] * (1.0 + par[PER_R]) * par[TAU_L] / par[T1_C2]
    return bool(Q_at(lowest, par) + more < par[V_FIRE])


@inner_making_arrays
def train_of_both(
    c: Any,
    k_F: float,
    time: FloatArray,
    force: FloatArray,
    until: float,
    tolerance: float,
    asked: int,
    most: float,
    par: FloatArray,
    S: FloatArray,
) -> Any:
    """As `batch.train` from the equilibrium, where T1 saturates."""
    y, v = rest_of_both(par)
    if v >= c.fire_voltage:
        v = c.reset_voltage
    begun(0.0, y, v, force[0], S)
    return coupled.run(time, force, until, k_F, par, S, tolerance, asked, most)


def _build(stamp: int, saturates: bool) -> Callable[..., Any]:
    @entry
    def run(
        many: Any,
        direct: bool,
        role: Any,
        stuck_rate: float,
        places: FloatArray,
        pressing: Any,
        framed: FloatArray,
        span: FloatArray,
        force_error: float,
        until: float,
        tolerance: float,
        most: float,
    ) -> Any:
        _ = stamp
        n = places.shape[0]
        count, pieces = np.zeros(n, np.int64), np.zeros(n, np.int64)
        largest, error = np.zeros(n), np.zeros(n)
        spikes, size = np.empty(CHUNK), 0
        rest, asked = np.full(3, np.nan), NODE_A | INTEGRATOR | SPIKES
        numbers = np.empty(ALL_PARAMETERS)
        par = read_only(numbers)
        S = np.empty(kernel.FRESH.size)
        for i in range(n):
            if role[i] == DEAD:
                continue
            if role[i] == STUCK:
                count[i] = int(until * stuck_rate)
                train_i = np.arange(1, count[i] + 1) / stuck_rate
                spikes = appended(spikes, size, train_i, count[i])
                size += count[i]
                continue
            k_F = numbers_of(many[i], direct, numbers)
            numbers[SATURATES] = 1.0 if saturates else 0.0
            if surely_silent(abs(k_F) * span[i], par):
                role[i], largest[i] = UNTOUCHED, np.nan
                continue
            t, F = force_on(
                places[i, 0], places[i, 1], pressing, framed[i], SAMPLED * force_error
            )
            largest[i] = F.max()
            pieces[i] = thinned(t, F, (1.0 - SAMPLED) * force_error)
            t, F = read_only(t[: pieces[i]]), read_only(F[: pieces[i]])
            if surely_silent(highest_V_P(t, F, k_F, par[TAU]), par):
                role[i] = UNTOUCHED
                continue
            if saturates:
                status, found = train_of_both(
                    many[i], k_F, t, F, until, tolerance, asked, most, par, S
                )
            else:
                status, found = train(
                    many[i], k_F, rest, t, F, until, tolerance, asked, most, par, S
                )
            if status != kernel.DONE:
                role[i] = REFUSED
                continue
            count[i] = int(S[spiking.COUNT])
            error[i] = S[spiking.LARGEST_ERROR]
            role[i] = FIRED if count[i] else SILENT
            spikes = appended(spikes, size, found, count[i])
            size += count[i]
        return count, pieces, largest, error, spikes[:size].copy()

    return run


_stamp = source_stamp(*SOURCES, Path(__file__))
run, run_saturating = _build(_stamp, False), _build(_stamp, True)
