"""Rate against force: measured points beside Eq. (15), and the force of onset."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np

from tactile_lab.analysis.charging import Charging
from tactile_lab.analysis.estimate import Z95, Estimate, correlated, student_95
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.equations import I_C, rest_V_C1
from tactile_lab.quantity import count, show

STEP = 1e-4
"""Force over which a slope is taken, N."""


@dataclass(frozen=True)
class Bracket:
    """Where firing begins lies between these two: forces, N, or gate voltages, V."""

    silent: float
    fires: float

    @property
    def middle(self) -> float:
        """Middle of the bracket."""
        return (self.silent + self.fires) / 2

    @property
    def half_width(self) -> float:
        """Half the bracket."""
        return abs(self.fires - self.silent) / 2


def eq15_rate(circuit: Circuit, force: float, ramp: float = 0.0) -> float:
    """Rate that a constant current gives, Eq. (15), at the end of a ramp, Hz.

    I_C is taken at the equilibrium of node A for the V_P that a linear ramp of `ramp` s
    to `force` N leaves; Eq. (15) knows no adaptation, so a measured rate lies below.
    0 where the current never charges C2 to the threshold.
    """
    V_P = _after_ramp(circuit, force, ramp)
    current = float(I_C(circuit, rest_V_C1(circuit, V_P))) + circuit.I_bias
    target = circuit.R_L * current
    if target <= circuit.fire_voltage:
        return 0.0
    charge = math.log(
        (target - circuit.reset_voltage) / (target - circuit.fire_voltage)
    )
    return 1.0 / (circuit.reset_time + circuit.tau_L * charge)


def _after_ramp(circuit: Circuit, force: float, ramp: float) -> float:
    """V_P that a linear ramp of `ramp` s to `force` N leaves, V."""
    V_P = circuit.k_F * force
    if ramp > 0:
        V_P *= -math.expm1(-ramp / circuit.tau) * circuit.tau / ramp
    return V_P


def slopes(forces: Sequence[float], rates: Sequence[float]) -> FloatArray:
    """Slopes of rate between neighbouring forces, shape (n - 1,), Hz/N.

    Args:
        forces: N, of trials that have a rate.
        rates: Hz.

    Raises:
        NotIdentifiableError: fewer than 2 different forces.
    """
    force, which = np.unique(np.asarray(forces, float), return_inverse=True)
    if force.size < 2:
        raise NotIdentifiableError(
            f"{force.size or 'no'} force{'s' * (force.size > 1)} gave a rate, 2 are "
            "needed for a slope"
        )
    rate = np.bincount(which, np.asarray(rates, float)) / np.bincount(which)
    steep: FloatArray = np.diff(rate) / np.diff(force)
    return steep


@dataclass(frozen=True, kw_only=True, eq=False)
class RateLaw:
    """Eq. (15) with the V_GS and the force's scale that the intervals of a run ask for.

    Attributes:
        V_GS: V.
        scale: of V_P over what is believed: of the force, of g31.
        intervals: number used.
        correlation: of the estimates of V_GS and scale.
        charging: of the believed circuit.
    """

    V_GS: Estimate
    scale: Estimate
    intervals: int
    correlation: float
    charging: Charging

    def slope(self, force: float, ramp: float) -> Estimate:
        """Of the rate at the end of a linear ramp of `ramp` s to `force` N, Hz/N.

        Per newton of the stated force: what is not known of that is not in it.
        """

        def at(V_GS: float, scale: float) -> float:
            per = scale * _after_ramp(self.charging.circuit, 1.0, ramp)
            drives = V_GS + per * (force + STEP * np.array([-1.0, 1.0]))
            low, high = self.charging.rate(drives)
            return float(high - low) / (2 * STEP)

        V_GS, scale = self.V_GS.value, self.scale.value
        one = (at(V_GS + 1e-4, scale) - at(V_GS - 1e-4, scale)) / 2e-4
        two = (at(V_GS, scale + 1e-3) - at(V_GS, scale - 1e-3)) / 2e-3
        half = math.sqrt(
            (one * self.V_GS.half) ** 2 + (two * self.scale.half) ** 2
            + 2 * self.correlation * one * self.V_GS.half * two * self.scale.half
        )  # fmt: skip
        value = at(V_GS, scale)
        return Estimate(value, half / Z95, value - half, value + half)


def fit_rate_law(
    circuit: Circuit,
    V_P: Callable[[FloatArray], FloatArray],
    trains: Sequence[FloatArray],
    displaced: Collection[Circuit] = (),
) -> RateLaw:
    """Fit V_GS and the scale of V_P to the intervals of several holds.

    Args:
        circuit: as it is believed to be.
        V_P: as it is believed to be at times of any shape, s, V.
        trains: spike times within each hold, s on the same axis.
        displaced: the circuit with each thing that is not known of it at the end of its
            95 % band.

    Raises:
        NotIdentifiableError: a T1 that saturates, fewer than 4 intervals, or fewer than
            2 holds with any.
    """
    from scipy.optimize import least_squares

    if circuit.saturation:
        raise NotIdentifiableError("T1 saturates: V_C1 alone does not tell its current")
    fired = [np.asarray(train) for train in trains if len(train) > 1]
    start = np.concatenate([train[:-1] for train in fired] or [np.empty(0)])
    end = np.concatenate([train[1:] for train in fired] or [np.empty(0)])
    if len(fired) < 2 or start.size < 4:
        raise NotIdentifiableError(
            f"{count(start.size, 'interval')} in {count(len(fired), 'held force')} "
            "once node A had followed, 4 in 2 are needed for a slope"
        )

    def fitted(
        circuit: Circuit,
    ) -> tuple[Charging, FloatArray, FloatArray, FloatArray]:
        charging = Charging(circuit)

        def residual(theta: FloatArray) -> FloatArray:
            reached = charging.charged(
                lambda time: theta[0] + theta[1] * V_P(time), start, end
            )
            return reached - circuit.fire_voltage

        solved = least_squares(
            residual, [circuit.V_GS, 1.0], x_scale=[1e-2, 1e-1], xtol=1e-12, ftol=1e-12
        )
        return (
            charging,
            np.asarray(solved.x),
            np.asarray(solved.fun),
            np.asarray(solved.jac),
        )

    charging, theta, left, jacobian = fitted(circuit)
    alike = correlated(left)
    freedom = max(1, int(left.size / alike) - 2)
    scatter = math.sqrt(float(np.sum(left**2)) / max(left.size - 2, 1))
    covariance = scatter**2 * alike * np.linalg.pinv(jacobian.T @ jacobian)
    half = student_95(freedom) ** 2 * covariance
    for other in displaced:
        moved = fitted(other)[1] - theta
        half += np.outer(moved, moved)  # one cause moves both: it correlates them
    error = np.sqrt(np.diag(half))
    V_GS, scale = (
        Estimate(float(v), float(e) / Z95, float(v - e), float(v + e))
        for v, e in zip(theta, error, strict=True)
    )
    return RateLaw(
        V_GS=V_GS, scale=scale, intervals=int(left.size),
        correlation=float(half[0, 1] / max(error[0] * error[1], 1e-300)),
        charging=charging,
    )  # fmt: skip


def onset(forces: Sequence[float], spikes: Sequence[int]) -> Bracket:
    """Bracket of the critical force from trials that each started from rest.

    Below 0 N it may be one of pulls: the sensor fires under the stronger ones.

    Args:
        forces: N.
        spikes: number of spikes at each force.

    Raises:
        NotIdentifiableError: all fire, none fires, or a stronger force was silent.
    """
    fired = np.array(spikes) > 0
    levels = np.array(forces, dtype=np.float64)
    if not fired.any():
        raise NotIdentifiableError("no spike was detected at any of these forces")
    if fired.all():
        raise NotIdentifiableError("every force made the sensor fire")
    for way in (1, -1) if levels[fired].max() < 0 else (1,):
        silent = way * float((way * levels[~fired]).max())
        fires = way * float((way * levels[fired]).min())
        if way * silent < way * fires:
            return Bracket(silent, fires)
    raise NotIdentifiableError(
        f"{show(silent, 'N', 6)} silent though {show(fires, 'N', 6)} fired: not at "
        "rest, or a drift"
    )
