"""tau_AlScN from the decay of I_DS under a constant force (Fig. 2c).

ln I_DS = ln I_0 + (V_P0/(m V_T)) exp(-t/tau), from Eqs. (7) and (8) with a force that
does not change: I_0 and the amplitude are fitted beside tau.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactile_lab.analysis.estimate import Estimate, student_95
from tactile_lab.errors import NotIdentifiableError, ParameterError

FloatArray = NDArray[np.float64]

FEWEST = 12
SHORTEST_HOLD = 2.0
"""A hold must last so many tau where the current it decays to is not known."""
SHORTEST_HOLD_WITH_REST = 0.3
"""The same where it is."""
_GRID = np.geomspace(0.05, 20.0, 120)


@dataclass(frozen=True, kw_only=True)
class Decay:
    """A fitted decay.

    Attributes:
        tau: leakage time constant, s; its interval is symmetric on the logarithm.
        amplitude: of ln I_DS at the hold's start.
        scatter: standard deviation of ln I_DS about the fit.
        points: number of independent points used.
    """

    tau: Estimate
    amplitude: Estimate
    scatter: float
    points: int


def fit_decay(
    time: ArrayLike,
    I_DS: ArrayLike,
    hold: tuple[float, float],
    *,
    averaged: float = 0.0,
    rest: float | None = None,
) -> Decay:
    """Fit tau to I_DS within a hold.

    Args:
        time: s.
        I_DS: A, above 0.
        hold: (start, end) of the constant force, s.
        averaged: window over which I_DS was averaged, s: neighbours nearer than that
            are not independent and are thinned out.
        rest: I_DS at rest, A, if known: the decay's end. It narrows tau much where the
            hold is shorter than tau.

    Raises:
        ParameterError: unequal shapes.
        NotIdentifiableError: too few points, a current at or below 0 A, no decay, or a
            tau that the hold does not determine.
    """
    t, current = np.asarray(time, float), np.asarray(I_DS, float)
    if t.shape != current.shape or t.ndim != 1:
        raise ParameterError(
            f"A decay needs as many currents as times; got shapes {t.shape} and "
            f"{current.shape}."
        )
    inside = (t >= hold[0] + averaged / 2) & (t <= hold[1] - averaged / 2)
    t, current = t[inside] - hold[0], current[inside]
    if averaged > 0 and t.size > 1:
        every = max(1, round(averaged / np.median(np.diff(t))))
        t, current = t[::every], current[::every]
    if t.size < FEWEST:
        raise NotIdentifiableError(
            f"{t.size} independent points lie in the hold, {FEWEST} are needed"
        )
    if np.any(current <= 0):
        raise NotIdentifiableError("I_DS is not above 0 A throughout the hold")
    y = np.log(current) - (0.0 if rest is None else np.log(rest))
    theta = _fit(t, y, hold[1] - hold[0], free=rest is None)
    length, tau = hold[1] - hold[0], float(np.exp(theta[0]))
    needed = SHORTEST_HOLD if rest is None else SHORTEST_HOLD_WITH_REST
    if length < needed * tau:
        raise NotIdentifiableError(
            f"a hold of {length:.3g} s does not determine tau, about {tau:.2g} s: "
            f"{needed:g} tau are needed"
        )
    return _decay(theta, t, y)


def _fit(t: FloatArray, y: FloatArray, length: float, *, free: bool) -> FloatArray:
    """(ln tau, amplitude, offset): the best tau of a grid, then least squares.

    Without `free` the offset is 0 and left out.
    """
    from scipy.optimize import least_squares

    grid = _GRID * length
    starts = [_linear(t, y, tau, free=free) for tau in grid]
    costs = [
        float(np.sum(_residual(np.array([np.log(tau), *linear]), t, y) ** 2))
        for tau, linear in zip(grid, starts, strict=True)
    ]
    best = int(np.argmin(costs))
    solved = least_squares(
        _residual, [np.log(grid[best]), *starts[best]], _slopes, method="lm",
        xtol=1e-12, ftol=1e-15, gtol=1e-15, args=(t, y),
    )  # fmt: skip
    return np.asarray(solved.x, dtype=np.float64)


def _linear(t: FloatArray, y: FloatArray, tau: float, *, free: bool) -> FloatArray:
    """Amplitude, and offset if it is free, of the best decay with that tau."""
    shape = np.exp(-t / tau)
    design = np.column_stack([shape, np.ones_like(t)]) if free else shape[:, None]
    solved: FloatArray = np.linalg.lstsq(design, y, rcond=None)[0]
    return solved


def _residual(theta: FloatArray, t: FloatArray, y: FloatArray) -> FloatArray:
    left: FloatArray = theta[1] * np.exp(-t / np.exp(theta[0])) + sum(theta[2:]) - y
    return left


def _slopes(theta: FloatArray, t: FloatArray, y: FloatArray) -> FloatArray:
    """Of the residual by each of `theta`, shape (n, 2 or 3)."""
    scaled = t / np.exp(theta[0])
    shape = np.exp(-scaled)
    columns = [theta[1] * scaled * shape, shape, np.ones_like(t)]
    return np.column_stack(columns[: theta.size])


def _decay(theta: FloatArray, t: FloatArray, y: FloatArray) -> Decay:
    jacobian, residual = _slopes(theta, t, y), _residual(theta, t, y)
    freedom = t.size - theta.size
    scatter = float(np.sqrt(np.sum(residual**2) / freedom))
    covariance = scatter**2 * np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)
    log_error = float(np.sqrt(covariance[0, 0]))
    amplitude = Estimate.of(theta[1], float(np.sqrt(covariance[1, 1])), freedom)
    if amplitude.low <= 0 <= amplitude.high:
        raise NotIdentifiableError("I_DS does not change during the hold")
    factor = np.exp(student_95(freedom) * log_error)
    tau = float(np.exp(theta[0]))
    if not np.isfinite(factor) or factor > 2:
        raise NotIdentifiableError(
            f"the hold does not determine tau: about {tau:.2g} s, no better known than "
            "by a factor 2; hold longer or give the current at rest"
        )
    return Decay(
        tau=Estimate(tau, tau * log_error, tau / float(factor), tau * float(factor)),
        amplitude=amplitude,
        scatter=scatter,
        points=int(t.size),
    )
