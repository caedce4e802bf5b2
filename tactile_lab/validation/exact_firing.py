"""Exact integrate-and-fire on a grid, as simulators with precise spike times do it.

V_C2's equation is linear in V_C2: where its current is linear between two points of the
grid, V_C2 between them is known in closed form (Rotter and Diesmann 1999), and a spike
is the root of that form, not a point of the grid (Morrison et al. 2007). V_C1, which
brings the current, takes one step of the exponential Rosenbrock-Euler method. Like
those simulators it looks for a spike only where V_C2 ends a step above V_fire.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import SolverError
from tactile_lab.model.compiled import entry, inner, source_stamp
from tactile_lab.model.integrator import T_EPS, TAU_L, V_FIRE, V_RESET, Q_at
from tactile_lab.model.node_a import LAMBDA, PER_VOLT, TAU, V_T, B_at, V_P_at, slope_at
from tactile_lab.model.scratch import borrowed
from tactile_lab.model.solver import MOST_SPIKES
from tactile_lab.model.spiking import grown
from tactile_lab.validation.problem import Answer, Problem
from tactile_lab.validation.rivals import (
    FINISHED,
    NO_NUMBER,
    OUT_OF_EVALUATIONS,
    answered,
    check_steps,
)


@inner
def next_V_C1(
    s: float, h: float, y: float, V0: float, p: float, par: FloatArray
) -> float:
    """V_C1 after h s: exact where Eq. (16) is linear in V_C1 and in time."""
    V_P = V_P_at(s, V0, p, par[TAU])
    B = B_at(V_P, par)
    z = -h * (par[LAMBDA] + B * math.exp(-y / par[V_T]) / par[V_T])
    grows = B * par[PER_VOLT] * (p - V_P / par[TAU]) * math.expm1(-y / par[V_T])
    if z < -1e-4:
        one = math.expm1(z) / z
        two = (one - 1.0) / z
    else:
        one, two = 1.0 + 0.5 * z * (1.0 + z / 3.0), 0.5 + z / 6.0
    return float(y + h * one * slope_at(B, y, par) + h * h * two * grows)


@inner
def rise_time(v: float, Q: float, slope: float, d: float, par: FloatArray) -> float:
    """When V_C2 reaches V_fire from v under a current Q + slope t, d s at most."""
    tau = par[TAU_L]
    P = Q - tau * slope
    low, high = 0.0, d
    t = d
    for _ in range(60):
        e = math.expm1(-t / tau)
        gap = (v - par[V_FIRE]) + slope * t + (v - P) * e
        if gap < 0.0:
            low = t
        else:
            high = t
        step = -gap / (slope - (v - P) * (1.0 + e) / tau)
        following = t + step
        if not low <= following <= high:
            following = 0.5 * (low + high)
        if abs(following - t) <= 1e-16 * d:
            break
        t = following
    return t


def _build(stamp: int) -> Callable[..., Any]:
    @entry
    def run(
        segments: FloatArray, y: float, v: float, par: FloatArray, dt: float
    ) -> tuple[int, FloatArray, float, int]:
        _ = stamp
        par = borrowed(par)
        count = evaluations = 0
        spikes = np.empty(64)
        resume = -1.0
        for n in range(segments.shape[0]):
            t0, V0, p = segments[n, 0], segments[n, 2], segments[n, 3]
            T = segments[n, 1] - t0
            steps = math.ceil(T / dt)
            h = T / steps
            Q1 = Q_at(y, par)
            for k in range(steps):
                s = k * h
                y = next_V_C1(s, h, y, V0, p, par)
                Q0, Q1 = Q1, Q_at(y, par)
                evaluations += 1
                slope = (Q1 - Q0) / h
                at = 0.0
                while True:
                    if resume >= 0.0:
                        if resume - (t0 + s) >= h:
                            break
                        at, v = max(resume - (t0 + s), 0.0), par[V_RESET]
                        resume = -1.0
                    Q = Q0 + slope * at
                    e = math.expm1(-(h - at) / par[TAU_L])
                    P = Q - par[TAU_L] * slope
                    end = v + slope * (h - at) + (v - P) * e
                    if not abs(end) < np.inf:
                        return NO_NUMBER, spikes[:count].copy(), y, evaluations
                    if end < par[V_FIRE]:
                        v = end
                        break
                    at += rise_time(v, Q, slope, h - at, par)
                    fires = t0 + (s + at)
                    again = count > 0 and fires == spikes[count - 1]
                    if again or count >= MOST_SPIKES:  # without end
                        return OUT_OF_EVALUATIONS, spikes[:count], y, evaluations
                    spikes = grown(spikes, count)
                    spikes[count] = fires
                    count += 1
                    v = par[V_RESET]
                    if par[T_EPS] > 0.0:
                        resume = fires + par[T_EPS]
        return FINISHED, spikes[:count].copy(), y, evaluations

    return run


run = _build(source_stamp())


def exact_firing(problem: Problem, cap: float, dt: float) -> Answer:
    """Spikes on a grid of about `dt` s that starts anew at each point of the force.

    Raises:
        OutOfTimeError: so many steps need more than `cap` s of CPU time, or it fires
            without end.
        SolverError: V_C2 acts back on its current, or the solution is NaN.
    """
    if problem.circuit.saturation:
        raise SolverError("V_C2 acts back on its current where T1 saturates")
    check_steps(problem.until / dt, cap)
    y, v = problem.first
    return answered(run(problem.table, y, v, problem.par, dt), cap)
