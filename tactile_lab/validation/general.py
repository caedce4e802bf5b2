"""General solvers: fixed steps as in the paper, SciPy's, and CVODE."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from tactile_lab.errors import SolverError
from tactile_lab.model.circuit import FloatArray
from tactile_lab.model.compiled import entry
from tactile_lab.model.integrator import TAU_L, V_FIRE, V_RESET, Q_at
from tactile_lab.model.node_a import TAU, B_at, V_P_at, slope_at
from tactile_lab.validation.problem import Deadline, OutOfTimeError, Problem, march

SCIPY = ("RK45", "DOP853", "LSODA", "Radau", "BDF")
Answer = tuple[FloatArray, float]


def scipy_solver(problem: Problem, method: str, tolerance: float, cap: float) -> Answer:
    """`scipy.integrate.solve_ivp` with events, compiled right-hand side."""
    fire_voltage = problem.circuit.fire_voltage
    solver: Any = solve_ivp

    def fire(_: float, y: FloatArray) -> float:
        return float(y[1]) - fire_voltage

    fire.terminal, fire.direction = True, 1.0  # type: ignore[attr-defined]

    def piece(
        s: float, end: float, y: FloatArray, armed: bool, rhs: Any
    ) -> tuple[float, FloatArray, bool]:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            got = solver(
                rhs, (s, end), y, method=method, rtol=max(tolerance, 2.3e-14),
                atol=tolerance * 1e-1, events=[fire] if armed else None,
            )  # fmt: skip
        if not got.success:
            raise SolverError(got.message)
        return float(got.t[-1]), got.y[:, -1].copy(), got.status == 1

    return march(problem, piece, cap)


def cvode(problem: Problem, method: str, tolerance: float, cap: float) -> Answer:
    """SUNDIALS CVODE through scikit-sundae, with its own root finding.

    Raises:
        ImportError: scikit-sundae is not installed.
    """
    from sksundae.cvode import CVODE

    fire_voltage = problem.circuit.fire_voltage
    deadline = Deadline(cap)

    def piece(
        s: float, end: float, y: FloatArray, armed: bool, rhs: Any
    ) -> tuple[float, FloatArray, bool]:
        def f(t: float, state: FloatArray, out: FloatArray) -> None:
            # an exception would be lost in the C code: NaN makes it give up
            if deadline.passed():
                out[:] = np.nan
            else:
                out[:] = rhs(t, state)

        def fire(_: float, state: FloatArray, events: FloatArray) -> None:
            events[0] = state[1] - fire_voltage

        fire.terminal, fire.direction = [True], [1]  # type: ignore[attr-defined]
        options = {"eventsfn": fire, "num_events": 1} if armed else {}
        solver = CVODE(
            f, method=method, rtol=tolerance, atol=tolerance * 1e-1,
            max_num_steps=10_000_000, **options,
        )  # fmt: skip
        got = solver.solve(np.array([s, end]), y.copy())
        if deadline.passed():
            raise OutOfTimeError(f"stopped after {cap:g} s")
        if not got.success:
            raise SolverError(str(got.message))
        fired = armed and got.t_events is not None and len(got.t_events) > 0
        return float(got.t[-1]), np.array(got.y[-1]), fired

    return march(problem, piece, cap)


def fixed_step(problem: Problem, order: int, dt: float, cap: float) -> Answer:
    """Explicit Euler (order 1, the paper's forward integration) or RK4, compiled.

    The reset is on the grid, the spike at the end of the step that passes V_fire.
    """
    steps = problem.until / dt
    if steps * 6e-8 * order > cap:
        raise OutOfTimeError(f"would take more than {cap:g} s")
    if problem.circuit.reset_time > 0 or problem.circuit.saturation:
        raise SolverError("resets that take time and saturation have no fixed steps")
    segments = np.array(problem.segments)
    spikes = np.empty(2_000_000)
    y = np.array(problem.first)
    count = _fixed(segments, dt, order, y, problem.par, spikes)
    if not np.all(np.isfinite(y)):
        raise SolverError("the solution is NaN")
    return spikes[:count].copy(), float(y[0])


@entry
def _fixed(
    segments: FloatArray, dt: float, order: int, y: FloatArray, par: FloatArray,
    spikes: FloatArray,
) -> int:  # fmt: skip
    k = 0
    count = 0
    last = segments[segments.shape[0] - 1, 1]
    n = int(np.round(last / dt))
    tau, tau_L = par[TAU], par[TAU_L]
    a = np.empty(4)
    b = np.empty(4)
    for i in range(n):
        t = i * dt
        while k + 1 < segments.shape[0] and t >= segments[k, 1] - 1e-6 * dt:
            k += 1
        s = t - segments[k, 0]
        y1, y2 = y[0], y[1]
        for stage in range(4 if order == 4 else 1):
            c = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
            z1 = y1 + c * dt * a[stage - 1] if stage else y1
            z2 = y2 + c * dt * b[stage - 1] if stage else y2
            V_P = V_P_at(s + c * dt, segments[k, 2], segments[k, 3], tau)
            a[stage] = slope_at(B_at(V_P, par), z1, par)
            b[stage] = (Q_at(z1, par) - z2) / tau_L
        if order == 4:
            y[0] = y1 + dt / 6.0 * (a[0] + 2.0 * a[1] + 2.0 * a[2] + a[3])
            y[1] = y2 + dt / 6.0 * (b[0] + 2.0 * b[1] + 2.0 * b[2] + b[3])
        else:
            y[0] = y1 + dt * a[0]
            y[1] = y2 + dt * b[0]
        if y[1] >= par[V_FIRE] and count < spikes.size:
            spikes[count] = t + dt
            count += 1
            y[1] = par[V_RESET]
    return count
