"""General solvers called from Python: SciPy's, and CVODE."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import SolverError
from tactile_lab.validation.problem import (
    Answer,
    Deadline,
    OutOfTimeError,
    Problem,
    march,
)

SCIPY = ("RK45", "DOP853", "LSODA", "Radau", "BDF")


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
