"""tau_AlScN from the decay of I_DS under a constant force (Fig. 2c).

ln I_DS = ln I_0 + (V_P0/(m V_T)) exp(-t/tau), from Eqs. (7) and (8) with a force that
does not change: I_0 and the amplitude are fitted beside tau.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.analysis.estimate import Estimate, correlated, student_95
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import NotIdentifiableError, ParameterError
from tactile_lab.quantity import rounded

FEWEST = 12
SHORTEST_HOLD = 2.0
"""A hold must last so many tau where the current it decays to is not known."""
SHORTEST_HOLD_WITH_REST = 0.3
"""The same where it is."""
_GRID = np.geomspace(0.05, 20.0, 120)


@dataclass(frozen=True, kw_only=True)
class Decay:
    """Fitted decays that share one time constant.

    Attributes:
        tau: leakage time constant, s; its interval is symmetric on the logarithm.
        amplitudes: of ln I_DS at the start of each hold.
        points: number of points used.
    """

    tau: Estimate
    amplitudes: tuple[Estimate, ...]
    points: int


def fit_decay(
    time: ArrayLike,
    I_DS: ArrayLike,
    holds: Sequence[tuple[float, float]],
    *,
    averaged: float = 0.0,
    settling: float = 0.0,
    rest: float | None = None,
) -> Decay:
    """Fit tau, and an amplitude for each hold, to I_DS within holds.

    Args:
        time: s.
        I_DS: A, above 0.
        holds: (start, end) of each constant force, s; amplitudes are those at its
            start.
        averaged: window over which I_DS was averaged, s: neighbours nearer than that
            are not independent and are thinned out.
        settling: so much after each start is left out, s; what comes after it is
            extrapolated back to the start.
        rest: I_DS at rest, A, if known: the decay's end. It narrows tau much where the
            holds are shorter than tau.

    Intervals hold the scatter of I_DS, as far as neighbouring points err alike too.

    Raises:
        ParameterError: unequal shapes.
        NotIdentifiableError: too few points, a current at or below 0 A, no decay, or a
            tau that the holds do not determine.
    """
    t, current = np.asarray(time, float), np.asarray(I_DS, float)
    if t.shape != current.shape or t.ndim != 1:
        raise ParameterError(
            f"A decay needs as many currents as times; got shapes {t.shape} and "
            f"{current.shape}."
        )
    pieces = [
        _piece(t, current, (start + settling, end), start, averaged)
        for start, end in holds
    ]
    since = np.concatenate([at for at, _ in pieces])
    amperes = np.concatenate([value for _, value in pieces])
    if any(at.size < FEWEST for at, _ in pieces):
        fewest = min(at.size for at, _ in pieces)
        raise NotIdentifiableError(
            f"{fewest} independent points lie in the hold, {FEWEST} are needed"
        )
    if np.any(amperes <= 0):
        raise NotIdentifiableError("I_DS is not above 0 A throughout the hold")
    number = np.repeat(np.arange(len(pieces)), [at.size for at, _ in pieces])
    y = np.log(amperes) - (0.0 if rest is None else np.log(rest))
    points = _Points(
        since, y, np.eye(len(pieces))[number], np.ones_like(y), rest is None
    )
    length = max(end - start for start, end in holds)
    theta = _fit(points, length)
    # the noise is one of currents: on its logarithm a small current is noisier
    expected = np.exp(points.residual(theta) + y)
    points = replace(points, weight=expected / expected.mean())
    theta = _fit(points, length)
    tau = float(np.exp(theta[0]))
    needed = SHORTEST_HOLD if rest is None else SHORTEST_HOLD_WITH_REST
    if length < needed * tau:
        raise NotIdentifiableError(
            f"a hold of {length:.3g} s does not determine tau, about {rounded(tau)} s: "
            f"{needed:g} tau are needed"
        )
    return _decay(theta, points)


def _piece(
    t: FloatArray,
    current: FloatArray,
    hold: tuple[float, float],
    start: float,
    averaged: float,
) -> tuple[FloatArray, FloatArray]:
    """Times since `start` and currents of independent points within a hold."""
    inside = (t >= hold[0] + averaged / 2) & (t <= hold[1] - averaged / 2)
    t, current = t[inside] - start, current[inside]
    every = 1
    if averaged > 0 and t.size > 1:
        every = max(1, round(averaged / np.median(np.diff(t))))
    return t[::every], current[::every]


@dataclass(frozen=True, eq=False)
class _Points:
    """Times since each hold's start, ln I_DS, which hold (n, k), and weights (n,)."""

    t: FloatArray
    y: FloatArray
    hold: FloatArray
    weight: FloatArray
    free: bool

    def design(self, tau: float) -> FloatArray:
        """By each amplitude, and by the offset if it is free, shape (n, k or k + 1)."""
        shape = self.hold * np.exp(-self.t / tau)[:, None]
        return np.column_stack([shape, np.ones_like(self.t)]) if self.free else shape

    def residual(self, theta: FloatArray) -> FloatArray:
        """Weighted fit less data for (ln tau, amplitudes, offset if it is free)."""
        left: FloatArray = self.design(np.exp(theta[0])) @ theta[1:] - self.y
        return left * self.weight

    def slopes(self, theta: FloatArray) -> FloatArray:
        """Of the residual by each of `theta`."""
        design = self.design(np.exp(theta[0]))
        k = self.hold.shape[1]
        by_tau = self.t / np.exp(theta[0]) * (design[:, :k] @ theta[1 : k + 1])
        return np.column_stack([by_tau, design]) * self.weight[:, None]


def _fit(points: _Points, length: float) -> FloatArray:
    """(ln tau, amplitudes, offset if free): the best tau of a grid, then refined."""
    from scipy.optimize import least_squares

    def starting(tau: float) -> FloatArray:
        design = points.design(tau) * points.weight[:, None]
        linear = np.linalg.lstsq(design, points.y * points.weight, rcond=None)[0]
        return np.array([np.log(tau), *linear])

    starts = [starting(tau) for tau in _GRID * length]
    costs = [float(np.sum(points.residual(start) ** 2)) for start in starts]
    solved = least_squares(
        points.residual, starts[int(np.argmin(costs))], points.slopes, method="lm",
        xtol=1e-12, ftol=1e-15, gtol=1e-15,
    )  # fmt: skip
    return np.asarray(solved.x, dtype=np.float64)


def _decay(theta: FloatArray, points: _Points) -> Decay:
    jacobian, residual = points.slopes(theta), points.residual(theta)
    alike = correlated(residual, points.hold)
    # so many points tell something of their own
    freedom = max(1, int(points.t.size / alike) - theta.size)
    scatter = float(np.sqrt(np.sum(residual**2) / (points.t.size - theta.size)))
    inverse = np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)
    errors = scatter * np.sqrt(alike * np.diag(inverse))
    amplitudes = tuple(
        Estimate.of(theta[i], float(errors[i]), freedom)
        for i in range(1, points.hold.shape[1] + 1)
    )
    if all(a.low <= 0 <= a.high for a in amplitudes):
        raise NotIdentifiableError("I_DS does not change during the hold")
    factor = np.exp(student_95(freedom) * errors[0])
    tau = float(np.exp(theta[0]))
    if not np.isfinite(factor) or factor > 2:
        raise NotIdentifiableError(
            f"the hold does not determine tau: about {rounded(tau)} s, no better known "
            "than by a factor 2; hold longer or give the current at rest"
        )
    return Decay(
        tau=Estimate(
            tau, tau * float(errors[0]), tau / float(factor), tau * float(factor)
        ),
        amplitudes=amplitudes,
        points=int(points.t.size),
    )
