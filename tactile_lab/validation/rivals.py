"""General methods compiled whole, as ours is: no call of Python inside a solution.

Dormand and Prince's 5(4), Rodas5P (a Rosenbrock method for stiff equations), Euler and
RK4. V_P is exact for all of them and every method starts anew at each point of the
force. Spikes are located on the method's own dense output, where it has one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import SolverError
from tactile_lab.model.compiled import entry, inner, source_stamp
from tactile_lab.model.integrator import T_EPS, TAU_L, V_FIRE, V_RESET, Q_at, Q_gain
from tactile_lab.model.node_a import LAMBDA, PER_VOLT, TAU, V_T, B_at, V_P_at, slope_at
from tactile_lab.model.pair import flow
from tactile_lab.model.scratch import borrowed, room_for
from tactile_lab.model.spiking import grown
from tactile_lab.model.transistor import FLOW, SATURATES
from tactile_lab.validation.problem import Answer, OutOfTimeError, Problem, slopes
from tactile_lab.validation.tableaux import (
    DP_A,
    DP_C,
    DP_D,
    DP_E,
    RODAS_A,
    RODAS_C,
    RODAS_COUPLING,
    RODAS_D,
    RODAS_GAMMA,
    RODAS_H,
)

DORMAND_PRINCE, RODAS = range(2)
ON_GRID, INTERPOLATED = range(2)
EULER, RK4 = 1, 4
FINISHED, OUT_OF_EVALUATIONS, NO_NUMBER = range(3)
EVALUATIONS_PER_SECOND = 4e6
"""What compiled code does at least, and `cap` is told by."""
stages_room, dense_room, pair_room = room_for(8, 2), room_for(5, 2), room_for(2)
flow_room, jacobian_room = room_for(FLOW), room_for(FLOW + 1)


@inner
def jacobian(
    s: float, y: float, v: float, V0: float, p: float, held: bool, par: FloatArray,
    J: FloatArray,
) -> None:  # fmt: skip
    """Fill J with both slopes, their four derivatives, 1/s, and d/dt of V_C1's."""
    V_P = V_P_at(s, V0, p, par[TAU])
    B = B_at(V_P, par)
    if par[SATURATES] != 0.0:
        flow(B, y, v, held, par, J)
    else:
        J[0] = slope_at(B, y, par)
        J[2] = -par[LAMBDA] - B * math.exp(-y / par[V_T]) / par[V_T]
        J[1] = J[3] = J[4] = J[5] = 0.0
        if not held:
            Q = Q_at(y, par)
            J[1] = (Q - v) / par[TAU_L]
            J[4] = -Q_gain(Q, par) / par[TAU_L]
            J[5] = -1.0 / par[TAU_L]
    J[FLOW] = B * par[PER_VOLT] * (p - V_P / par[TAU]) * math.expm1(-y / par[V_T])


@inner
def step_explicit(
    s: float, h: float, y: float, v: float, V0: float, p: float, held: bool,
    par: FloatArray, both: FloatArray, k: FloatArray, dense: FloatArray,
    error: FloatArray,
) -> int:  # fmt: skip
    """Dormand and Prince's step; k[0] holds the slopes at its start."""
    z = w = 0.0
    for i in range(1, 7):
        z, w = y, v
        for j in range(i):
            z += h * DP_A[i, j] * k[j, 0]
            w += h * DP_A[i, j] * k[j, 1]
        slopes(s + DP_C[i] * h, z, w, V0, p, held, par, both, k[i])
    start = (y, v)
    end = (z, w)
    for c in range(2):
        e = d = 0.0
        for i in range(7):
            e += DP_E[i] * k[i, c]
            d += DP_D[i] * k[i, c]
        error[c] = h * e
        dense[0, c], dense[1, c] = start[c], end[c] - start[c]
        dense[2, c] = h * k[0, c] - dense[1, c]
        dense[3, c] = dense[1, c] - h * k[6, c] - dense[2, c]
        dense[4, c] = h * d
    return 6


@inner
def step_rosenbrock(
    s: float, h: float, y: float, v: float, V0: float, p: float, held: bool,
    par: FloatArray, both: FloatArray, k: FloatArray, dense: FloatArray,
    error: FloatArray, J: FloatArray,
) -> int:  # fmt: skip
    """A step of Rodas5P with the exact Jacobian."""
    jacobian(s, y, v, V0, p, held, par, J)
    diagonal = 1.0 / (RODAS_GAMMA * h)
    a, b, c, d = diagonal - J[2], -J[3], -J[4], diagonal - J[5]
    reciprocal = 1.0 / (a * d - b * c)
    f = error
    z, w = y, v
    for i in range(8):
        z, w = y, v
        one = two = 0.0
        for j in range(i):
            z += RODAS_A[i, j] * k[j, 0]
            w += RODAS_A[i, j] * k[j, 1]
            one += RODAS_COUPLING[i, j] * k[j, 0]
            two += RODAS_COUPLING[i, j] * k[j, 1]
        if i == 0:
            f[0], f[1] = J[0], J[1]
        else:
            slopes(s + RODAS_C[i] * h, z, w, V0, p, held, par, both, f)
        one = f[0] + one / h + h * RODAS_D[i] * J[FLOW]
        two = f[1] + two / h
        k[i, 0] = (d * one - b * two) * reciprocal
        k[i, 1] = (a * two - c * one) * reciprocal
    start = (y, v)
    end = (z + k[7, 0], w + k[7, 1])
    for n in range(2):
        dense[0, n], dense[1, n] = start[n], end[n] - start[n]
        for m in range(3):
            total = 0.0
            for j in range(8):
                total += RODAS_H[m, j] * k[j, n]
            dense[2 + m, n] = total
        error[n] = k[7, n]
    return 8


@inner
def dense_at(method: int, dense: FloatArray, c: int, u: float) -> float:
    """The step's dense output at the fraction u."""
    one = 1.0 - u
    if method == DORMAND_PRINCE:
        inside = dense[3, c] + one * dense[4, c]
        inside = dense[2, c] + u * inside
        return float(dense[0, c] + u * (dense[1, c] + one * inside))
    inside = dense[3, c] + u * dense[4, c]
    inside = dense[2, c] + u * inside
    return float(dense[0, c] + u * (dense[1, c] + one * inside))


@inner
def located(method: int, dense: FloatArray, level: float) -> float:
    """The fraction of the step at which V_C2 passes `level`, by Illinois' rule."""
    low, high = 0.0, 1.0
    f_low = dense_at(method, dense, 1, 0.0) - level
    f_high = dense_at(method, dense, 1, 1.0) - level
    u, last = 1.0, 0.0
    for _ in range(60):
        if high - low <= 1e-15 or f_high == f_low:
            break
        u = low - f_low * (high - low) / (f_high - f_low)
        f = dense_at(method, dense, 1, u) - level
        if abs(f) <= 4e-16 * abs(level):
            break
        # an end that stays twice counts for half of what it is
        half = 0.5 if f * last > 0.0 else 1.0
        last = f
        if f < 0.0:
            low, f_low, f_high = u, f, half * f_high
        else:
            high, f_high, f_low = u, f, half * f_low
    return u


def _build_adaptive(stamp: int) -> Callable[..., Any]:
    @entry
    def run(
        method: int, segments: FloatArray, y: float, v: float, par: FloatArray,
        tolerance: float, most: float,
    ) -> tuple[int, FloatArray, float, int]:  # fmt: skip
        _ = stamp
        status, count, evaluations = FINISHED, 0, 0
        spikes = np.empty(64)
        par, k, dense = borrowed(par), stages_room(), dense_room()
        error, both, J = pair_room(), flow_room(), jacobian_room()
        resume = -1.0
        h = 1e-4
        for n in range(segments.shape[0]):
            t0, V0, p = segments[n, 0], segments[n, 2], segments[n, 3]
            T = segments[n, 1] - t0
            s = 0.0
            h = min(h, 1e-3)
            known = False
            while s < T and status == FINISHED:
                held = resume >= 0.0
                end = min(T, resume - t0) if held else T
                last = s + 1.0001 * h >= end
                step = end - s if last else h
                if step > 0.0:
                    if method == DORMAND_PRINCE:
                        if not known:
                            slopes(s, y, v, V0, p, held, par, both, k[0])
                            evaluations += 1
                        known = True
                        evaluations += step_explicit(
                            s, step, y, v, V0, p, held, par, both, k, dense, error
                        )
                    else:
                        evaluations += step_rosenbrock(
                            s, step, y, v, V0, p, held, par, both, k, dense, error, J
                        )
                    y1, v1 = dense_at(method, dense, 0, 1.0), dense[0, 1] + dense[1, 1]
                    scale = tolerance * (0.1 + max(abs(y), abs(y1)))
                    size = abs(error[0]) / scale
                    scale = tolerance * (0.1 + max(abs(v), abs(v1)))
                    size = max(size, abs(error[1]) / scale)
                    if evaluations > most:
                        status = OUT_OF_EVALUATIONS
                        break
                    if not size <= 1.0:
                        if not size < np.inf:
                            h = 0.1 * step
                            if h < 1e-290:
                                status = NO_NUMBER
                        else:
                            h = step * max(0.2, 0.9 * size**-0.2)
                        continue
                    growth = min(5.0, 0.9 * max(size, 1e-10) ** -0.2)
                    h = max(h, step * growth) if last else step * growth
                    if not held and v1 >= par[V_FIRE]:
                        u = located(method, dense, par[V_FIRE])
                        spikes = grown(spikes, count)
                        s += u * step
                        y, v = dense_at(method, dense, 0, u), par[V_RESET]
                        spikes[count] = t0 + s
                        count += 1
                        known = False
                        if par[T_EPS] > 0.0:
                            resume, v = t0 + s + par[T_EPS], par[V_FIRE]
                        continue
                    y, v = y1, v1
                    for c in range(2):
                        k[0, c] = k[6, c]
                s = end if last else s + step
                if held and last and end < T:
                    resume, v, known = -1.0, par[V_RESET], False
            if status != FINISHED:
                break
        return status, spikes[:count].copy(), y, evaluations

    return run


def _build_fixed(stamp: int) -> Callable[..., Any]:
    @entry
    def run(
        order: int, events: int, segments: FloatArray, y: float, v: float,
        par: FloatArray, dt: float,
    ) -> tuple[int, FloatArray, float, int]:  # fmt: skip
        _ = stamp
        count = evaluations = 0
        spikes = np.empty(64)
        par, k, both = borrowed(par), stages_room(), flow_room()
        resume = -1.0
        for n in range(segments.shape[0]):
            t0, V0, p = segments[n, 0], segments[n, 2], segments[n, 3]
            T = segments[n, 1] - t0
            s, grid = 0.0, 0
            while s < T:
                held = resume >= 0.0
                end = min((grid + 1) * dt, T)
                if held:
                    end = min(end, max(resume - t0, s))
                h = end - s
                for i in range(order):
                    c = 0.0 if i == 0 else (1.0 if i == 3 else 0.5)
                    z, w = y, v
                    if i > 0:
                        z += c * h * k[i - 1, 0]
                        w += c * h * k[i - 1, 1]
                    slopes(s + c * h, z, w, V0, p, held, par, both, k[i])
                    evaluations += 1
                if order == RK4:
                    y1 = y + h / 6 * (k[0, 0] + 2 * k[1, 0] + 2 * k[2, 0] + k[3, 0])
                    v1 = v + h / 6 * (k[0, 1] + 2 * k[1, 1] + 2 * k[2, 1] + k[3, 1])
                else:
                    y1, v1 = y + h * k[0, 0], v + h * k[0, 1]
                if not (abs(y1) < np.inf and abs(v1) < np.inf):
                    return NO_NUMBER, spikes[:count], y1, evaluations
                if not held and v1 >= par[V_FIRE]:
                    spikes = grown(spikes, count)
                    u = 1.0
                    if events == INTERPOLATED:
                        u = (par[V_FIRE] - v) / (v1 - v)
                        y_u = y + u * (y1 - y)
                        if order == RK4:
                            slopes(end, y1, v1, V0, p, held, par, both, k[4])
                            evaluations += 1
                            u = hermite_root(v, v1, h * k[0, 1], h * k[4, 1], par)
                            y_u = hermite(y, y1, h * k[0, 0], h * k[4, 0], u)
                        y1 = y_u
                    s = end if u == 1.0 else s + u * h
                    spikes[count] = t0 + s
                    count += 1
                    y, v = y1, par[V_RESET]
                    if par[T_EPS] > 0.0:
                        resume, v = t0 + s + par[T_EPS], par[V_FIRE]
                else:
                    y, v, s = y1, v1, end
                    if held and resume - t0 <= s and s < T:
                        resume, v = -1.0, par[V_RESET]
                if s >= min((grid + 1) * dt, T):
                    grid += 1
        return FINISHED, spikes[:count].copy(), y, evaluations

    return run


@inner
def hermite(a: float, b: float, da: float, db: float, u: float) -> float:
    """The cubic through a and b with slopes da and db per step, at the fraction u."""
    one = 1.0 - u
    return one * one * ((1.0 + 2.0 * u) * a + u * da) + u * u * (
        (3.0 - 2.0 * u) * b - one * db
    )


@inner
def hermite_root(a: float, b: float, da: float, db: float, par: FloatArray) -> float:
    """Where the cubic passes V_fire, by bisection."""
    low, high = 0.0, 1.0
    for _ in range(52):
        u = 0.5 * (low + high)
        if hermite(a, b, da, db, u) < par[V_FIRE]:
            low = u
        else:
            high = u
    return high


adaptive = _build_adaptive(source_stamp())
fixed = _build_fixed(source_stamp())


def stepped(problem: Problem, cap: float, method: int, tolerance: float) -> Answer:
    """Dormand and Prince or Rodas5P with relative `tolerance` and located events.

    Raises:
        OutOfTimeError: more evaluations than `cap` s of CPU time allow.
        SolverError: the solution is NaN.
    """
    y, v = problem.first
    most = cap * EVALUATIONS_PER_SECOND
    got = adaptive(method, problem.table, y, v, problem.par, tolerance, most)
    return answered(got, cap)


def fixed_step(
    problem: Problem, cap: float, order: int, events: int, dt: float
) -> Answer:
    """Euler (`order` 1, the paper's forward integration) or RK4 (4) in steps of `dt` s.

    Events are on the grid, or interpolated in the step that passes V_fire (linearly
    for Euler, by a cubic for RK4), after which the step is finished from the reset.

    Raises:
        OutOfTimeError: so many steps need more than `cap` s of CPU time.
        SolverError: the solution is NaN.
    """
    check_steps(problem.until / dt * order, cap)
    y, v = problem.first
    return answered(fixed(order, events, problem.table, y, v, problem.par, dt), cap)


def check_steps(evaluations: float, cap: float) -> None:
    """Raise OutOfTimeError where so many need more than `cap` s of CPU time."""
    if evaluations > cap * EVALUATIONS_PER_SECOND:
        raise OutOfTimeError(f"would take more than {cap:g} s")


def answered(got: tuple[int, FloatArray, float, int], cap: float) -> Answer:
    """What a compiled method returned, or why it has no answer."""
    status, spikes, y, evaluations = got
    if status == OUT_OF_EVALUATIONS:
        raise OutOfTimeError(f"stopped after {evaluations} evaluations, {cap:g} s")
    if status == NO_NUMBER or not math.isfinite(y):
        raise SolverError("the solution is NaN")
    return Answer(spikes, y, evaluations)
