"""The exponential decay of the firing rate: alpha exp(beta t) + gamma (Fig. 5c, 5d).

The fit takes the intervals as they are: each one ends when the integral of the rate
law over it reaches 1, up to the train's irregularity (a gamma renewal process under
time rescaling). No interval is treated as if its rate belonged to one instant.

On this circuit the law is a description, not the physics: it is stable only where the
hold is longer than about 2/|beta|, and is refused otherwise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactile_lab.analysis.estimate import Estimate, student_95
from tactile_lab.analysis.spike_train import intervals, within
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.quantity import rounded

FEWEST_INTERVALS = 10
STEEPEST = 300.0
"""Largest |beta| times the hold that the fit tries."""
SMALLEST_FALL = 1e-3
"""Part of the mean rate; a smaller fall is none."""
UNLIKELY = 0.01
"""A misfit with a smaller chance than this is taken to be systematic."""
DRAWN = 200
"""Points with which a law is drawn."""
BEYOND = 3.841458820694124
"""By which twice the logarithm of a likelihood falls at the end of a 95 % interval."""
SHORTEST_HOLD = 2.0
"""The hold must last this many time constants 1/|beta|."""
_GRID = np.geomspace(0.05, 200.0, 60)


@dataclass(frozen=True, kw_only=True)
class Adaptation:
    """A fitted rate law alpha exp(beta t) + gamma, t in s from the hold's start.

    Attributes:
        alpha: Hz.
        beta: 1/s, negative.
        gamma: Hz, at least 0.
        time_constant: 1/|beta|, s.
        irregularity: standard deviation of the rescaled intervals, 0 for a train that
            follows the law exactly.
        chance: with which a train that scatters about the law at random would lie on
            one side of it for as long as this one (runs test), 0 to 1.
        r_squared: part of the variance of 1/ISI that the law explains.
        intervals: number of intervals used.
        hold: (start, end) used, s.
        last: the last spike of the hold, s on the axis of the spike times: the law
            describes no more.
        unseen: spikes that the law expects from there to the hold's end.
    """

    alpha: Estimate
    beta: Estimate
    gamma: Estimate
    time_constant: Estimate
    irregularity: float
    chance: float
    r_squared: float
    intervals: int
    hold: tuple[float, float]
    last: float
    unseen: float

    @property
    def systematic(self) -> bool:
        """Whether the rates leave the law systematically: its intervals are narrow."""
        return self.chance < UNLIKELY

    @property
    def drawn(self) -> tuple[FloatArray, FloatArray]:
        """Times, s, from the hold's start to the last spike, and the law there, Hz."""
        time = np.linspace(self.hold[0], self.last, DRAWN)
        return time, self.rate(time)

    def rate(self, time: ArrayLike) -> FloatArray:
        """The law at `time`, s on the axis of the spike times, Hz."""
        t = np.asarray(time, dtype=np.float64) - self.hold[0]
        values: FloatArray = (
            self.alpha.value * np.exp(self.beta.value * t) + self.gamma.value
        )
        return values


def fit_adaptation(spike_times: ArrayLike, hold: tuple[float, float]) -> Adaptation:
    """Fit the exponential law to the intervals that lie within the hold.

    Args:
        spike_times: s.
        hold: (start, end) of the constant force, s, on the same axis.

    Raises:
        NotIdentifiableError: fewer than 10 intervals, a rate that does not fall, a
            hold shorter than 2/|beta|, a time constant below the shortest interval, or
            no better known than itself.
        ParameterError: times not finite or not increasing.
    """
    times = within(spike_times, hold)
    count = intervals(times).size
    if count < FEWEST_INTERVALS:
        raise NotIdentifiableError(
            f"{count} interval{'' if count == 1 else 's'} in the hold, "
            f"{FEWEST_INTERVALS} are needed"
        )
    starts, ends = times[:-1] - hold[0], times[1:] - hold[0]
    theta, covariance, dispersion = _fit(starts, ends)
    beta, error = float(theta[1]), float(np.sqrt(covariance[1, 1]))
    length = hold[1] - hold[0]
    quantile = student_95(count - 3)
    alpha = _estimate(theta, covariance, 0, quantile)
    fall = -float(theta[0]) * np.expm1(min(beta * length, 0.0))
    if fall <= SMALLEST_FALL * count / length and _ends_as_fast(times):
        raise NotIdentifiableError("the rate does not fall during the hold")
    if beta >= 0 or theta[0] <= 0:
        raise NotIdentifiableError("no bend towards a final rate yet: hold longer")
    if length < SHORTEST_HOLD / -beta:
        raise NotIdentifiableError(
            f"2/|beta|, about {rounded(SHORTEST_HOLD / -beta)} s, exceeds the hold of "
            f"{length:.3g} s"
        )
    if -1 / beta < (shortest := float(np.min(ends - starts))):
        raise NotIdentifiableError(
            f"1/|beta|, about {rounded(-1 / beta)} s, is below the shortest interval, "
            f"{shortest:.2g} s, so that one interval alone would tell it"
        )
    if alpha.low <= 0:
        raise NotIdentifiableError("the fall is within the train's irregularity")
    if quantile * error >= -beta:
        raise NotIdentifiableError(
            f"1/|beta|, about {rounded(-1 / beta)} s, is as uncertain as it is large"
        )
    spread = quantile * error / -beta
    constant = Estimate(
        -1 / beta,
        error / beta**2,
        -1 / (beta * (1 + spread)),
        -1 / (beta * (1 - spread)),
    )
    predicted = _count(theta, starts, ends) / (ends - starts)
    observed = 1 / (ends - starts)
    unexplained = np.sum((observed - predicted) ** 2)
    return Adaptation(
        alpha=alpha,
        beta=_estimate(theta, covariance, 1, quantile),
        gamma=_gamma(theta, covariance, quantile, starts, ends),
        time_constant=constant,
        irregularity=float(np.sqrt(dispersion)),
        chance=_chance(_count(theta, starts, ends) - 1),
        r_squared=float(1 - unexplained / np.sum((observed - observed.mean()) ** 2)),
        intervals=count,
        hold=hold,
        last=float(times[-1]),
        unseen=float(_count(theta, ends[-1:], np.array([length]))[0]),
    )


def _ends_as_fast(times: FloatArray) -> bool:
    """Whether the last third of the intervals is no longer than the first, by 1 %."""
    isi = np.diff(times)
    third = max(1, isi.size // 3)
    return bool(isi[-third:].mean() <= 1.01 * isi[:third].mean())


def _estimate(
    theta: FloatArray, covariance: FloatArray, index: int, quantile: float
) -> Estimate:
    value = float(theta[index])
    error = float(np.sqrt(covariance[index, index]))
    return Estimate(value, error, value - quantile * error, value + quantile * error)


def _gamma(
    theta: FloatArray,
    covariance: FloatArray,
    quantile: float,
    starts: FloatArray,
    ends: FloatArray,
) -> Estimate:
    """Gamma; at its bound 0 with an interval by the profile of the likelihood."""
    value, error = float(theta[2]), float(np.sqrt(covariance[2, 2]))
    if value > 0:
        half = quantile * error
        return Estimate(value, error, max(0.0, value - half), value + half)
    least = _cost(theta, starts, ends)
    surprise = _count(theta, starts, ends) - 1
    shape = starts.size / max(float(np.sum(surprise**2)), 1e-12 * starts.size)

    def beyond(gamma: float) -> bool:
        there = np.array([theta[0], theta[1], gamma])
        moves = np.array([True, True, False])
        cost = _cost(_scored(there, starts, ends, moves), starts, ends)
        return 2 * shape * (cost - least) > BEYOND

    low, high = 0.0, 1e-3 * theta[0]
    while not beyond(high) and high < theta[0]:
        low, high = high, 2 * high
    for _ in range(20):
        middle = (low + high) / 2
        low, high = (low, middle) if beyond(middle) else (middle, high)
    return Estimate(0.0, error, 0.0, high)


def _chance(surprise: FloatArray) -> float:
    """Of so few changes of sign, by Wald and Wolfowitz's runs test, one-sided."""
    above = surprise > 0
    n, m = int(above.sum()), int((~above).sum())
    if n == 0 or m == 0:
        return 0.0 if surprise.size > 10 else 1.0
    runs = 1 + int(np.count_nonzero(above[1:] != above[:-1]))
    mean = 1 + 2 * n * m / (n + m)
    variance = (mean - 1) * (mean - 2) / (n + m - 1)
    z = (runs + 0.5 - mean) / math.sqrt(max(variance, 1e-12))
    return 0.5 * math.erfc(-z / math.sqrt(2))


def _fit(starts: FloatArray, ends: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """(theta, covariance, dispersion)."""
    theta = _scored(_start(starts, ends), starts, ends, np.array([True, True, True]))
    jacobian = _log_jacobian(theta, starts, ends)
    if theta[2] < 0:
        bounded = np.array([True, True, False])
        theta = _scored(np.array([theta[0], theta[1], 0.0]), starts, ends, bounded)
        jacobian = _log_jacobian(theta, starts, ends)
    surprise = _count(theta, starts, ends) - 1
    dispersion = max(float(np.sum(surprise**2) / (starts.size - 3)), 1e-12)
    information = jacobian.T @ jacobian
    inverse = np.linalg.pinv(information, hermitian=True)
    return theta, np.asarray(dispersion * inverse, dtype=np.float64), dispersion


def _scored(
    theta: FloatArray, starts: FloatArray, ends: FloatArray, moves: NDArray[np.bool_]
) -> FloatArray:
    """Fisher scoring on the gamma renewal likelihood, halving steps that fail."""
    cost = _cost(theta, starts, ends)
    for _ in range(100):
        jacobian = _log_jacobian(theta, starts, ends)[:, moves]
        surprise = _count(theta, starts, ends) - 1
        # the end point's own rate enters the likelihood beside the interval's mean
        regular = max(float(np.mean(surprise**2)), 1e-12)
        instant = _log_rate_jacobian(theta, ends)[:, moves]
        score = -jacobian.T @ surprise + regular * np.sum(instant - jacobian, axis=0)
        step = np.linalg.lstsq(jacobian.T @ jacobian, score, rcond=1e-14)[0]
        part = 1.0
        while part > 1e-6:
            tried = theta.copy()
            tried[moves] += part * step
            new = _cost(tried, starts, ends)
            if new < cost:
                break
            part /= 2
        else:
            return theta
        settled = np.max(np.abs(step) / (np.abs(tried[moves]) + 1e-9)) < 1e-10
        theta, cost = tried, new
        if settled and part == 1.0:
            break
    return theta


def _cost(theta: FloatArray, starts: FloatArray, ends: FloatArray) -> float:
    """Gamma renewal deviance at the dispersion of the moment; inf where no rate."""
    if abs(theta[1]) * ends[-1] > STEEPEST:
        return float("inf")
    instant = theta[0] * np.exp(theta[1] * ends) + theta[2]
    count = _count(theta, starts, ends)
    if not np.all(count > 0) or not np.all(instant > 0):
        return float("inf")
    shape = 1 / max(float(np.mean((count - 1) ** 2)), 1e-12)
    mean = count / (ends - starts)
    deviance = np.sum(count - 1 - np.log(count))
    return float(deviance - np.sum(np.log(instant / mean)) / shape)


def _start(starts: FloatArray, ends: FloatArray) -> FloatArray:
    """The best of a grid of betas with alpha and gamma by linear least squares."""
    span = ends[-1]
    rate = 1 / (ends - starts)
    best, best_cost = np.array([rate[0], -1 / span, 0.0]), np.inf
    for scaled in _GRID:
        beta = -scaled / span
        design = np.column_stack([_mean_exp(beta, starts, ends), np.ones(rate.size)])
        weighted = design / rate[:, None]
        linear = np.linalg.lstsq(weighted, np.ones(rate.size), rcond=None)[0]
        if linear[1] < 0:
            linear = np.array([np.sum(weighted[:, 0]) / np.sum(weighted[:, 0] ** 2), 0])
        residual = float(np.sum((weighted @ linear - 1) ** 2))
        theta = np.array([linear[0], beta, linear[1]])
        if residual < best_cost and np.isfinite(_cost(theta, starts, ends)):
            best, best_cost = theta, residual
    return best


def _mean_exp(beta: float, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Mean of exp(beta t) over each interval."""
    width = beta * (ends - starts)
    grown = np.where(np.abs(width) > 1e-12, np.expm1(width) / _safe(width), 1.0)
    mean: FloatArray = np.exp(beta * starts) * grown
    return mean


def _safe(width: FloatArray) -> FloatArray:
    return np.where(width == 0, 1.0, width)


def _count(theta: FloatArray, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Integral of the law over each interval; 1 where it is followed exactly."""
    mean = theta[0] * _mean_exp(theta[1], starts, ends) + theta[2]
    count: FloatArray = mean * (ends - starts)
    return count


def _log_jacobian(
    theta: FloatArray, starts: FloatArray, ends: FloatArray
) -> FloatArray:
    """Gradient of log(count) by (alpha, beta, gamma), shape (intervals, 3)."""
    alpha, beta, _ = theta
    width = ends - starts
    mean = _mean_exp(beta, starts, ends)
    last, first = np.exp(beta * ends), np.exp(beta * starts)
    by_beta = alpha * ((ends * last - starts * first) / width - mean) / beta
    count = _count(theta, starts, ends)
    columns = np.column_stack([mean, by_beta, np.ones_like(mean)])
    jacobian: FloatArray = columns * (width / count)[:, None]
    return jacobian


def _log_rate_jacobian(theta: FloatArray, at: FloatArray) -> FloatArray:
    """Gradient of log(rate) by (alpha, beta, gamma) at the times `at`."""
    decay = np.exp(theta[1] * at)
    rate = theta[0] * decay + theta[2]
    columns = np.column_stack([decay, theta[0] * at * decay, np.ones_like(decay)])
    jacobian: FloatArray = columns / rate[:, None]
    return jacobian
