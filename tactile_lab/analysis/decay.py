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
    return _decay(theta, t, y, free=rest is None)


def _fit(t: FloatArray, y: FloatArray, length: float, *, free: bool) -> FloatArray:
    """(ln tau, amplitude, offset): a grid on tau, then Gauss-Newton."""
    best, least = np.zeros(3), np.inf
    for tau in _GRID * length:
        linear = _linear(t, y, tau, free=free)
        residual = y - linear[0] * np.exp(-t / tau) - linear[1]
        cost = float(np.sum(residual**2))
        if cost < least:
            best, least = np.array([np.log(tau), *linear]), cost
    theta = best
    for _ in range(50):
        jacobian = _jacobian(theta, t, free=free)
        residual = y - theta[1] * np.exp(-t / np.exp(theta[0])) - theta[2]
        step = np.linalg.lstsq(jacobian, residual, rcond=1e-12)[0]
        step = step * min(1.0, 0.5 / max(abs(step[0]), 1e-300))
        theta = theta + (step if free else np.append(step, 0.0))
        if np.max(np.abs(step)) < 1e-12:
            break
    return theta


def _linear(t: FloatArray, y: FloatArray, tau: float, *, free: bool) -> FloatArray:
    shape = np.exp(-t / tau)
    if not free:
        return np.array([np.sum(shape * y) / np.sum(shape**2), 0.0])
    design = np.column_stack([shape, np.ones_like(t)])
    solved: FloatArray = np.linalg.lstsq(design, y, rcond=None)[0]
    return solved


def _jacobian(theta: FloatArray, t: FloatArray, *, free: bool) -> FloatArray:
    scaled = t / np.exp(theta[0])
    shape = np.exp(-scaled)
    columns = [theta[1] * scaled * shape, shape]
    if free:
        columns.append(np.ones_like(t))
    return np.column_stack(columns)


def _decay(theta: FloatArray, t: FloatArray, y: FloatArray, *, free: bool) -> Decay:
    jacobian = _jacobian(theta, t, free=free)
    freedom = t.size - jacobian.shape[1]
    residual = y - theta[1] * np.exp(-t / np.exp(theta[0])) - theta[2]
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
