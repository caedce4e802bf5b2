"""Identification: fit chosen sensor parameters to a run, and say what it cannot tell.

What it is fitted to: `tactile_lab.analysis.evidence`. Whatever the bench states a band
for, and one offset of V_C1's channel, is fitted with them and held by its band: the
data say how much of it they need, and an interval holds what they leave of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from tactile_lab.analysis.estimate import Estimate
from tactile_lab.analysis.evidence import (
    SCALES,
    VOLTAGES,
    JointResiduals,
    Moved,
    Residuals,
    scatter,
)
from tactile_lab.analysis.twin import Measured
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import NotIdentifiableError, ParameterError
from tactile_lab.long_waveform import AnyWaveform
from tactile_lab.model.circuit import PARAMETERS, Circuit, units
from tactile_lab.quantity import printed

ALIKE = 0.98
"""Two parameters whose estimates correlate more than this are hardly told apart."""
DEGENERATE = 1e-7
"""Least eigenvalue of the normalised information below which they cannot be."""
LOOSE = 0.5
"""A parameter known worse than this part of itself is not identified."""
LOOSE_VOLTAGE = 0.1
"""The same for voltages, V."""
STEP = 1e-3
"""Of a parameter or a part of a band, for differences."""
CLOSE = 1e-4
"""Of the sum of squares, at which a first fit is near enough."""
ROUNDS = 3
"""So often slopes are taken anew, and with each the scatter."""
NOISY = 1e-3
"""Part of V_fire by which V_C2 has to scatter as it fires for noise to be told."""
LEFT = 1e-3
"""Least part of a bin of V_C1 that a fit is thought to leave."""
ALIKE_SLOPES = 1e-7
"""Slopes that differ by less, as a part of them, are one."""


@dataclass(frozen=True, eq=False)
class Identified:
    """Fitted parameters.

    Attributes:
        circuit: of the first run, with the fitted values.
        estimates: by name, SI.
        correlation: shape (n, n), of the estimates, in the order of `estimates`.
        scatter_V_C1: remaining scatter of V_C1, V; None if not used.
        scatter_V_fire: remaining scatter of V_C2 when it fires, V; None if not used.
        warnings: what the data do not determine.
    """

    circuit: Circuit
    estimates: dict[str, Estimate]
    correlation: FloatArray
    scatter_V_C1: float | None
    scatter_V_fire: float | None
    warnings: tuple[str, ...] = field(default=())

    @property
    def noise(self) -> str:
        """What noise as it fires may do beyond the intervals; "" where it is small.

        Measured of 80 simulated runs with 3 mV of gate noise: V_GS off by a fifth of
        its half-width, 91 % of the intervals held.
        """
        seen = self.scatter_V_fire
        if seen is None or seen < NOISY * self.circuit.fire_voltage:
            return ""
        return (
            f"V_C2 is left with {seen * 1e3:.2g} mV of scatter as it fires. Where that "
            "is noise of the gate, spikes come early rather than late: V_GS may be off "
            "by a fifth of its half-width more, which is in no interval."
        )


@dataclass(frozen=True, eq=False)
class Evidence:
    """What one run says.

    Attributes:
        circuit: the sensor as it is believed to be.
        force: N on the run's time axis, from the measured coil current.
        duration: of the run, s.
        V_C1: measured, decimated; its bins must be independent. Its resolution is taken
            for what the channel's offset is known to.
        spike_times: detected spikes, s.
        causes: what is known of the bench within a band only.
        moved: what a circuit and its force become with each cause moved by a part of
            its 95 % band; None where nothing is open.
    """

    circuit: Circuit
    force: AnyWaveform
    duration: float
    V_C1: Measured | None = None
    spike_times: FloatArray | None = None
    causes: Sequence[str] = ()
    moved: Moved | None = None


def identify(
    circuit: Circuit,
    names: Sequence[str],
    force: AnyWaveform,
    duration: float,
    *,
    V_C1: Measured | None = None,
    spike_times: FloatArray | None = None,
    causes: Sequence[str] = (),
    moved: Moved | None = None,
) -> Identified:
    """Fit the parameters `names` to one run; see `Evidence` and `identify_together`."""
    seen = Evidence(circuit, force, duration, V_C1, spike_times, causes, moved)
    return identify_together([seen], names)


def identify_together(
    runs: Sequence[Evidence], names: Sequence[str], *, force_scales: bool = False
) -> Identified:
    """Fit one set of the parameters `names` to all runs, begun at the first's circuit.

    Other parameters stay as each run's circuit has them. Intervals hold the scatter of
    the data, and what they leave open of the offset of V_C1 and of each cause of
    uncertainty; one of a name is taken to be the same in all runs, as of one bench.

    Args:
        runs: at least one.
        names: parameters of `Circuit` to fit.
        force_scales: also fit a factor of each run's force, "force_1" and so on.

    Raises:
        ParameterError: an unknown parameter, or an option.
        NotIdentifiableError: no data, fewer points than parameters, or a parameter
            that does not act on the data at all.
    """
    for one in runs:
        _check(one.circuit, names)
    unused: tuple[str, ...] = ()
    problems = []
    for one in runs:
        begun: dict[str, Any] = {name: getattr(runs[0].circuit, name) for name in names}
        circuit, spikes = replace(one.circuit, **begun), one.spike_times
        if circuit.saturation and spikes is not None:
            # between spikes I_C is then no function of V_C1 alone
            spikes, unused = None, ("spikes are not used: T1 saturates",)
        told = (circuit, tuple(names), one.force, one.duration, one.V_C1, spikes)
        problems.append(Residuals(*told, one.causes, one.moved))
    problem = JointResiduals(problems, scaled=force_scales)
    if problem.size <= len(problem.names):
        raise NotIdentifiableError(
            f"{problem.size} data points cannot determine {len(problem.names)} "
            "parameters" + "".join(f" ({why})" for why in unused)
        )
    with threadpool_limits(1, "blas"):  # more of them wait longer than they work
        found = _fitted(problem)
    return replace(found, warnings=(*unused, *found.warnings))


def _fitted(problem: JointResiduals) -> Identified:
    x = _nearby(problem)
    for _ in range(ROUNDS):  # the scatter of either kind is itself estimated
        slope, residual = _slope(problem, x), problem.residual(x)
        for _ in range(ROUNDS):
            weights = problem.weights(residual)
            x = x - _fit(slope * weights[:, np.newaxis], residual * weights)
            residual = problem.residual(x)
    return _identified(problem, x, weights)


def _check(circuit: Circuit, names: Sequence[str]) -> None:
    if not names or len(set(names)) != len(names):
        raise ParameterError("Name each parameter to identify once, at least one.")
    for name in names:
        value = getattr(circuit, name, None)
        numeric = isinstance(value, int | float) and not isinstance(value, bool)
        if name not in PARAMETERS or not (numeric or name in ("V_fire", "V_reset")):
            raise ParameterError(
                f"{name!r} is no numeric parameter of the circuit; choose from "
                f"{', '.join(p for p in PARAMETERS if p not in _OPTIONS)}."
            )


_OPTIONS = frozenset({"t1", "firing", "saturation"})


def _identified(
    problem: JointResiduals, x: FloatArray, weights: FloatArray
) -> Identified:
    slope = _slope(problem, x) * weights[:, np.newaxis]
    fitted, open_ = np.split(slope, [len(problem.names)], axis=1)
    reach = np.linalg.norm(fitted, axis=0)
    for name, length in zip(problem.names, reach, strict=True):
        if length < 1e-9 * max(reach.max(), 1e-300):
            raise NotIdentifiableError(f"{name} does not act on the data at all")
    # what no cause can take for its own
    jacobian = fitted - open_ @ np.linalg.lstsq(open_, fitted, rcond=None)[0]
    lengths = np.linalg.norm(jacobian, axis=0)
    freedom = problem.size - len(problem.names)
    unit = jacobian / lengths
    strength, direction = np.linalg.eigh(unit.T @ unit)
    inverse = direction / np.maximum(strength, 1e-14) @ direction.T
    gain = inverse @ unit.T / lengths[:, np.newaxis]
    held = np.sum(np.linalg.qr(slope)[0] ** 2, axis=1)
    covariance = inverse / np.outer(lengths, lengths)
    covariance += _unlike(problem, x, gain, weights, held)
    covariance *= problem.size / freedom
    errors = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(errors, errors)
    values = problem.values(x)
    estimates = {
        name: _estimate(name, values[name], float(error), freedom)
        for name, error in zip(problem.names, errors, strict=True)
    }
    residual = problem.residual(x)[: problem.size]
    traced, fired = residual[problem.traced], residual[~problem.traced]
    return Identified(
        circuit=problem.circuit(x),
        estimates=estimates,
        correlation=correlation,
        scatter_V_C1=scatter(traced) if traced.size else None,
        scatter_V_fire=scatter(fired) if fired.size else None,
        warnings=_warnings(estimates, correlation, float(strength[0])),
    )


def _unlike(
    problem: JointResiduals,
    x: FloatArray,
    gain: FloatArray,
    weights: FloatArray,
    held: FloatArray,
) -> FloatArray:
    """Covariance of what is fitted, less that of independent, like data; shape (n, n).

    Bins of V_C1 scatter more where it moves or a code ends, and tell more there: each
    counts by how far its own square lies from their mean, as by White (1980). What
    neighbours have in common is in the weights. Intervals err alike with their
    neighbours.

    Args:
        problem: of which.
        x: where the fit ended.
        gain: what each weighed residual moves a parameter by, shape (n, all).
        weights: of the residuals, shape (all,).
        held: the part of each that the fit has taken up, shape (all,).
    """
    residual = problem.residual(x)
    traced, paired = np.flatnonzero(problem.traced), np.flatnonzero(~problem.traced)
    bins, alone = gain[:, traced], gain[:, paired]
    changed = -alone @ alone.T
    if traced.size:
        square = residual[traced] ** 2 / np.maximum(1 - held[traced], LEFT)
        moves = bins * weights[traced]
        changed += moves * (square - np.mean(square)) @ moves.T
    intervals = problem.intervals(x, residual, float(np.sum(held[paired])))
    if intervals is not None:
        changed += intervals.covariance(alone * weights[paired])
    return np.asarray(changed, dtype=np.float64)


def _nearby(problem: JointResiduals) -> FloatArray:
    """Where a fit that trusts all data alike ends."""
    weights = problem.first

    def weighed(x: FloatArray) -> FloatArray:
        return problem.residual(x) * weights

    def slope(x: FloatArray) -> FloatArray:
        return _slope(problem, x) * weights[:, np.newaxis]

    x = np.zeros(len(problem.names) + len(problem.causes))
    found = least_squares(weighed, x, slope, x_scale="jac", method="lm", ftol=CLOSE)
    return np.asarray(found.x, dtype=np.float64)


def _slope(problem: JointResiduals, x: FloatArray) -> FloatArray:
    """Change of the residuals with each parameter and part, by differences."""
    here = problem.residual(x)
    steps = STEP * np.eye(x.size)
    return np.column_stack([problem.residual(x + step) - here for step in steps]) / STEP


def _fit(slope: FloatArray, residual: FloatArray) -> FloatArray:
    """The step that the slopes, shape (points, n), make of a residual, shape (n,)."""
    lengths = np.linalg.norm(slope, axis=0)
    lengths[lengths == 0] = 1.0
    found = np.linalg.lstsq(slope / lengths, residual, rcond=ALIKE_SLOPES)[0]
    return np.asarray(found / lengths, dtype=np.float64)


def _estimate(name: str, value: float, error: float, freedom: int) -> Estimate:
    if name in SCALES:
        return Estimate.of(value, error * SCALES[name], freedom)
    logarithm = Estimate.of(float(np.log(value)), error, freedom)
    low, high = np.exp(np.clip((logarithm.low, logarithm.high), -700, 700))
    return Estimate(value, value * logarithm.error, float(low), float(high))


def _warnings(
    estimates: dict[str, Estimate], correlation: FloatArray, weakest: float
) -> tuple[str, ...]:
    names, found = list(estimates), []
    loose = {name for name, each in estimates.items() if _is_loose(name, each)}
    for i, one in enumerate(names):
        for j in range(i + 1, len(names)):
            # errors that go together matter little where both are small
            if abs(correlation[i, j]) > ALIKE and loose & {one, names[j]}:
                hard = "cannot be" if weakest < DEGENERATE else "are hardly"
                found.append(
                    f"{one} and {names[j]} {hard} told apart by these data "
                    f"(correlation {printed(f'{correlation[i, j]:.3f}')}): "
                    "fix one of them"
                )
    for name in loose:
        told = estimates[name].shown(unit_of(name))
        found.append(f"{name} is not identifiable: it is {told}")
    return tuple(found)


def _is_loose(name: str, estimate: Estimate) -> bool:
    limit = LOOSE_VOLTAGE if name in VOLTAGES else LOOSE * abs(estimate.value)
    return estimate.half > limit


def unit_of(name: str) -> str:
    """SI unit of a fitted parameter; "" of one without, such as a factor."""
    return units()[name].symbol if name in units() else ""
