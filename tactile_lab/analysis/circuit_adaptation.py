"""The adaptation law of the circuit itself, fitted to the spikes of a hold.

Under a constant force V_P dies away with tau, Eq. (7), and node A follows, so that T1's
current is a known function of V_GS + V_P(t). From one spike to the next C2 charges from
V_reset to V_fire by it, Eq. (18): what it lacks at a measured spike is the residual.
The silence after the last spike says as much: C2 must not reach V_fire before the hold
ends, a censored interval. V_GS, V_P at the hold's start and tau are fitted; all else is
the circuit as it is believed to be.

Eq. (15) with this V_P(t) is the rate that is drawn.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.analysis.charging import REACH, Charging, Drive
from tactile_lab.analysis.estimate import Estimate, correlated
from tactile_lab.analysis.spike_train import within
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.model.circuit import Circuit
from tactile_lab.quantity import count, rounded

FEWEST_INTERVALS = 6
LUCKY = 0.95
"""The scatter is at most so much larger than it seems, with this probability."""
FOLLOWED = 0.03
"""Time after the force is there until the core's field and node A have followed, s; a
force that comes faster than a ramp of 0.25 s takes more, see `followed`."""
BEHIND = 2e-4
"""Part of what V_C1 falls by that node A may still lack then."""
SMALLEST_SCATTER = 1e-5
"""V_fire is told no better than a detector's microsecond lets it, V."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CircuitAdaptation:
    """The circuit's own law, t in s from the hold's start.

    Attributes:
        tau: leakage time constant of the film, s.
        V_GS: V.
        V_P: at the hold's start, V.
        scatter: standard deviation of V_C2 at firing about V_fire, V.
        rms: of 1/ISI about the law, Hz.
        intervals: number used, the silence not counted.
        silent_from: when the law has fired its last spike, s on the axis of the spike
            times; None where it still fires at the hold's end.
        hold: (start, end) used, s.
    """

    tau: Estimate
    V_GS: Estimate
    V_P: Estimate
    scatter: float
    rms: float
    intervals: int
    silent_from: float | None
    hold: tuple[float, float]
    circuit: Circuit

    def rate(self, time: ArrayLike) -> FloatArray:
        """Eq. (15) with V_P(t) at `time`, s on the axis of the spike times, Hz."""
        t = np.asarray(time, dtype=np.float64) - self.hold[0] - self.circuit.tau_A
        decayed = self.V_P.value * np.exp(-t / self.tau.value)
        return Charging(self.circuit).rate(self.V_GS.value + decayed)


def followed(circuit: Circuit, came: float) -> float:
    """Time after the force is there until the core's field and node A have followed, s.

    Args:
        circuit: whose node A it is.
        came: time the force took, s: the less, the further node A is behind.
    """
    part = came / circuit.tau_A
    behind = -math.expm1(-part) / part if part > 0 else 1.0
    return max(FOLLOWED, circuit.tau_A * math.log(behind / BEHIND))


def fit_circuit_adaptation(
    circuit: Circuit,
    spike_times: ArrayLike,
    hold: tuple[float, float],
    displaced: Collection[Circuit] = (),
) -> CircuitAdaptation:
    """Fit tau, V_GS and V_P to the spikes within a hold.

    Args:
        circuit: as it is believed to be; its V_GS and tau are where the fit starts.
        spike_times: s.
        hold: (start, end) of the constant force, s, on the same axis.
        displaced: the circuit with each thing that is not known of it at the end of its
            95 % band.

    Intervals hold the scatter of V_C2 at firing, as far as neighbours err alike too,
    and what is not known of the circuit.

    Raises:
        NotIdentifiableError: fewer than 6 intervals, a rate that does not fall, a T1
            that saturates, or a tau not known to a factor 2, were the scatter as large
            as so few intervals leave open: else a short hold is told where it was
            small by luck, and then mostly wrongly.
    """
    from scipy.special import chdtri

    if circuit.saturation:
        raise NotIdentifiableError("T1 saturates: V_C1 alone does not tell its current")
    held = within(spike_times, hold)
    times = held - hold[0]
    number = times.size - 1
    if number < FEWEST_INTERVALS:
        seen = count(max(number, 0), "interval")
        raise NotIdentifiableError(f"{seen} in the hold, {FEWEST_INTERVALS} are needed")
    length = hold[1] - hold[0]
    law = _Law(circuit)
    theta, residual, jacobian, scatter = law.fit(times, length)
    alike = correlated(residual)
    freedom = max(1, int(number / alike) - theta.size)
    inverse = np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)
    errors = scatter * np.sqrt(alike * np.diag(inverse))
    found = [
        Estimate.of(float(v), float(e), freedom)
        for v, e in zip(theta, errors, strict=True)
    ]
    for other in displaced:
        moved = _Law(other).fit(times, length, theta)[0] - theta
        found = [f.widened(abs(float(m))) for f, m in zip(found, moved, strict=True)]
    V_GS, V_P, log_tau = found
    tau = math.exp(log_tau.value)
    luck = math.sqrt(freedom / float(chdtri(freedom, LUCKY)))
    if not log_tau.half * luck < math.log(2):
        raise NotIdentifiableError(
            f"the hold does not determine tau: about {rounded(tau)} s, no better known "
            "than by a factor 2"
        )
    law_rate = 1 / law.interval(theta, times)
    rms = float(np.sqrt(np.mean((1 / np.diff(times) - law_rate) ** 2)))
    silent = law.silent_from(theta, times[-1], length)
    return CircuitAdaptation(
        tau=Estimate(
            tau, tau * log_tau.error, math.exp(log_tau.low), math.exp(log_tau.high)
        ),
        V_GS=V_GS,
        V_P=V_P,
        scatter=scatter,
        rms=rms,
        intervals=number,
        # a law without another spike gives the measured one, to the last digit
        silent_from=None if silent is None else float(held[-1] + (silent - times[-1])),
        hold=hold,
        circuit=circuit,
    )


def _drive(theta: FloatArray) -> Drive:
    """V_GS + V_P(t) for (V_GS, V_P at the hold's start, ln tau)."""
    return lambda time: theta[0] + theta[1] * np.exp(-time / math.exp(theta[2]))


class _Law:
    """The law of one circuit for (V_GS, V_P at the hold's start, ln tau)."""

    def __init__(self, circuit: Circuit) -> None:
        self._circuit = circuit
        self._charging = Charging(circuit)

    def charged(
        self, theta: FloatArray, start: FloatArray, end: FloatArray
    ) -> FloatArray:
        """V_C2 at `end` after a spike at `start`, V; without firing meanwhile."""
        return self._charging.charged(_drive(theta), start, end)

    def residual(
        self, theta: FloatArray, times: FloatArray, length: float, scatter: float
    ) -> FloatArray:
        """What V_C2 exceeds V_fire by at each spike, and the silence's surprise, V."""
        fire = self._circuit.fire_voltage
        at_spikes = self.charged(theta, times[:-1], times[1:]) - fire
        # from 1 ms after the spike on, as the reset may last
        silence = np.linspace(times[-1] + 1e-3 + self._circuit.reset_time, length, 60)
        silence = silence[silence > times[-1]]
        most = (
            float(
                np.max(self.charged(theta, np.full(silence.size, times[-1]), silence))
            )
            if length > silence[0]
            else -math.inf
        )
        return np.append(at_spikes, scatter * _surprise((fire - most) / scatter))

    def fit(
        self, times: FloatArray, length: float, start: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray, FloatArray, float]:
        """(theta, residuals at the spikes, V, their slopes by theta, scatter, V)."""
        from scipy.optimize import least_squares

        first = self._start(times) if start is None else start
        scatter = 0.05
        for _ in range(4):  # the scatter is itself estimated; it weighs the silence
            solved = least_squares(
                self.residual, first, x_scale=[1e-2, 1e-1, 1e-1], method="trf",
                xtol=1e-12, ftol=1e-12, gtol=1e-12, args=(times, length, scatter),
            )  # fmt: skip
            first = np.asarray(solved.x, dtype=np.float64)
            left = solved.fun[:-1]
            freedom = max(left.size - 3, 1)
            scatter = max(math.sqrt(float(np.sum(left**2)) / freedom), SMALLEST_SCATTER)
        if first[1] <= 0:
            raise NotIdentifiableError("the rate does not fall during the hold")
        if first[1] >= REACH:
            raise NotIdentifiableError("no V_P explains both spikes and silence")
        return first, np.asarray(left), np.asarray(solved.jac), scatter

    def _start(self, times: FloatArray) -> FloatArray:
        """The best of a grid of tau, V_GS and V_P by what each drive should be."""
        c = self._circuit
        isi = np.diff(times) - c.reset_time
        left = np.exp(-isi / c.tau_L)
        # the constant current that charges C2 in each interval, and its drive
        needed = (c.fire_voltage - c.reset_voltage * left) / (c.R_L * (1 - left))
        drive = self._charging.drive(needed)
        middle = (times[1:] + times[:-1]) / 2
        best, least = np.array([c.V_GS, 0.1, math.log(c.tau)]), math.inf
        for tau in c.tau * np.geomspace(0.05, 20, 40):
            shape = np.column_stack([np.ones_like(middle), np.exp(-middle / tau)])
            linear = np.linalg.lstsq(shape, drive, rcond=None)[0]
            cost = float(np.sum((shape @ linear - drive) ** 2))
            if cost < least and linear[1] > 0:
                best, least = np.array([*linear, math.log(tau)]), cost
        return best

    def interval(self, theta: FloatArray, times: FloatArray) -> FloatArray:
        """The law's own intervals, by its slope at each measured spike, s."""
        start, end = times[:-1], times[1:]
        voltage = self.charged(theta, start, end)
        step = 1e-4 * (end - start)
        slope = (self.charged(theta, start, end + step) - voltage) / step
        early: FloatArray = (voltage - self._circuit.fire_voltage) / slope
        return end - start - early

    def silent_from(
        self, theta: FloatArray, last: float, length: float
    ) -> float | None:
        """The law's last spike, s, going on from a measured one; None: it fires on."""
        if self._charging.rate(_drive(theta)(np.array(length))) > 0:
            return None
        spike = last
        while True:
            at = np.linspace(spike, length, 400)[1:]
            reached = self.charged(theta, np.full(at.size, spike), at)
            over = np.flatnonzero(reached >= self._circuit.fire_voltage)
            if not over.size:
                return spike
            spike = float(at[over[0]])


def _surprise(z: float) -> float:
    """Residual of a standard normal that was only seen to lie below `z`."""
    from scipy.special import log_ndtr

    return math.sqrt(-2 * float(log_ndtr(z)))
