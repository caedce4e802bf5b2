"""Identification: fit chosen sensor parameters to a run, and say what it cannot tell.

What it is fitted to: `tactile_lab.analysis.evidence`.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from tactile_lab.analysis.belief import PART
from tactile_lab.analysis.estimate import Z95, Estimate
from tactile_lab.analysis.evidence import (
    SCALES,
    VOLTAGES,
    JointResiduals,
    Residuals,
    scatter,
)
from tactile_lab.analysis.twin import Measured
from tactile_lab.arrays import FloatArray
from tactile_lab.deviation import DrivenCircuit
from tactile_lab.errors import NotIdentifiableError, ParameterError
from tactile_lab.model.circuit import PARAMETERS, Circuit, units
from tactile_lab.quantity import printed
from tactile_lab.waveform import Waveform

Displaced = Callable[[Circuit, float], Iterable[tuple[str, DrivenCircuit]]]
Cause = tuple[str, int]
"""Name of a cause of uncertainty, and the how manieth of that name."""

ALIKE = 0.98
"""Two parameters whose estimates correlate more than this are hardly told apart."""
DEGENERATE = 1e-7
"""Least eigenvalue of the normalised information below which they cannot be."""
LOOSE = 0.5
"""A parameter known worse than this part of itself is not identified."""
LOOSE_VOLTAGE = 0.1
"""The same for voltages, V."""
TIMES = ("clocks", "lag")
"""Causes of uncertainty that move V_C1 at the edges of the force, and hardly elsewhere.
"""
DIFFERENCE = np.array(1e-4)
ROUNDS, LONGEST = 4, 3.0
"""Of a fit repeated where a cause is at the end of its band; how far it may go, in the
steps of the parameters."""


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
        displaced: what a circuit and its force become if either is moved by a part of
            its 95 % band, for each independent cause of uncertainty.
    """

    circuit: Circuit
    force: Waveform
    duration: float
    V_C1: Measured | None = None
    spike_times: FloatArray | None = None
    displaced: Displaced = lambda _circuit, _part: ()


@dataclass(frozen=True, eq=False)
class Noise:
    """How residuals err: each by its own scatter, and those of V_C1 by one offset.

    An offset adds to what the model says, so that it can be left open exactly: what the
    shape of V_C1 tells is then not lost with its level.

    Attributes:
        plain: one over the scatter of each, shape (n,), errors of times aside.
        offsets: half of the 95 % band of each one's offset, V, shape (n,).
        edges: variance that errors of times add to each, V^2, shape (n,).
    """

    plain: FloatArray
    offsets: FloatArray
    edges: FloatArray

    def found(self, problem: JointResiduals, residual: FloatArray) -> Noise:
        """The same with the scatter that residuals, shape (n,), show."""
        left = self.freed(residual) * self.weights / self.plain
        return replace(self, plain=problem.weights(left))

    @cached_property
    def weights(self) -> FloatArray:
        """One over the scatter of each, shape (n,)."""
        found: FloatArray = 1 / np.sqrt(1 / self.plain**2 + self.edges)
        return found

    def whitened(self, residual: FloatArray) -> FloatArray:
        """Residuals made independent and of scatter 1, shape (n,) or (n, k)."""
        scaled = (residual.T * self.weights).T
        return scaled - self._along(scaled, 1 - 1 / math.sqrt(1 + self._power))

    def freed(self, residual: FloatArray) -> FloatArray:
        """Residuals, shape (n,), less the offset that its band and they make best."""
        scaled = residual * self.weights
        part = self._power / (1 + self._power)
        return residual - self._along(scaled, part) / self.weights

    @cached_property
    def _offset(self) -> FloatArray:
        """One standard deviation of the offset, in each one's scatter."""
        return self.offsets * self.weights / Z95

    @cached_property
    def _power(self) -> float:
        return float(self._offset @ self._offset)

    def _along(self, scaled: FloatArray, part: float) -> FloatArray:
        along: FloatArray = np.multiply.outer(self._offset, self._offset @ scaled)
        return along * part / (self._power or 1.0)


def identify(
    circuit: Circuit,
    names: Sequence[str],
    force: Waveform,
    duration: float,
    *,
    V_C1: Measured | None = None,
    spike_times: FloatArray | None = None,
    displaced: Displaced = lambda _circuit, _part: (),
) -> Identified:
    """Fit the parameters `names` to one run; see `Evidence` and `identify_together`."""
    seen = Evidence(circuit, force, duration, V_C1, spike_times, displaced)
    return identify_together([seen], names)


def identify_together(
    runs: Sequence[Evidence], names: Sequence[str], *, force_scales: bool = False
) -> Identified:
    """Fit one set of the parameters `names` to all runs, begun at the first's circuit.

    Other parameters stay as each run's circuit has them. Intervals hold the scatter of
    the data, and what the offset of V_C1 and each cause of uncertainty would move the
    estimate by; a cause is taken to be the same in all runs, as of one bench.

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
        problems.append(Residuals(*told))
    problem = JointResiduals(problems, scaled=force_scales)
    if problem.size <= len(problem.names):
        raise NotIdentifiableError(
            f"{problem.size} data points cannot determine {len(problem.names)} "
            "parameters" + "".join(f" ({why})" for why in unused)
        )
    x, displaced = np.zeros(len(problem.names)), [one.displaced for one in runs]
    noise = Noise(problem.first_weights(), problem.offsets, np.zeros(problem.size))
    for _ in range(3):  # the scatter of the two kinds of evidence is itself estimated

        def whitened(x: FloatArray, noise: Noise = noise) -> FloatArray:
            return noise.whitened(problem.residual(x))

        solved = least_squares(
            whitened, x, x_scale="jac", diff_step=DIFFERENCE, method="lm"
        )
        x = np.asarray(solved.x, dtype=np.float64)
        noise = replace(noise, edges=_edges(problem, x, displaced))
        noise = noise.found(problem, problem.residual(x))
    found = _identified(problem, x, noise, displaced)
    return replace(found, warnings=(*unused, *found.warnings))


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


def _displaced(
    problem: JointResiduals, x: FloatArray, displaced: Sequence[Displaced], part: float
) -> dict[Cause, list[DrivenCircuit]]:
    """Circuit and force of all runs with `part` of the 95 % band of one cause, by it.

    The n-th cause of a name is the same one in every run.
    """
    driven, scales = problem.driven(x), problem.scales(x)
    found: dict[Cause, list[DrivenCircuit]] = {}
    for number, (one, causes_of) in enumerate(zip(driven, displaced, strict=True)):
        met: Counter[str] = Counter()
        for name, moved in causes_of(one.circuit, part):
            scaled = DrivenCircuit(moved.circuit, moved.force.scaled(scales[number]))
            found.setdefault((name, met[name]), list(driven))[number] = scaled
            met[name] += 1
    return found


def _edges(
    problem: JointResiduals, x: FloatArray, displaced: Sequence[Displaced]
) -> FloatArray:
    """Variance by which to trust less what a small error of a time moves far, V^2."""
    here, variance = problem.residual(x), np.zeros(problem.size)
    for (name, _), driven in _displaced(problem, x, displaced, PART).items():
        if name in TIMES:
            variance += ((problem.under(driven) - here) / PART / Z95) ** 2
    return variance


def _moved(
    problem: JointResiduals,
    x: FloatArray,
    displaced: Sequence[Displaced],
    jacobian: FloatArray,
    noise: Noise,
) -> list[FloatArray]:
    """How far each cause, at the end of its band, moves the estimate, shape (n,) each.

    The fit is repeated there, what residuals weigh included.
    """

    def step(residual: FloatArray, noise: Noise) -> FloatArray:
        asked = noise.whitened(jacobian), noise.whitened(residual)
        return np.asarray(np.linalg.lstsq(*asked, rcond=1e-7)[0], dtype=np.float64)

    here, moves = step(problem.residual(x), noise), []
    for cause in _displaced(problem, x, displaced, PART):
        ways = []
        # what is early moves it as what is late does, but may begin before the run
        for end in (1.0,) if cause[0] in TIMES else (-1.0, 1.0):
            there, seen = x, noise
            for _ in range(ROUNDS):
                driven = _displaced(problem, there, displaced, end)[cause]
                residual = problem.under(driven)
                there = there - step(residual, seen) + here
                there = x + np.clip(there - x, -LONGEST, LONGEST)
                seen = seen.found(problem, residual)
            ways.append(np.abs(there - x))
        moves.append(np.max(ways, axis=0))
    return moves


def _identified(
    problem: JointResiduals, x: FloatArray, noise: Noise, displaced: Sequence[Displaced]
) -> Identified:
    plain = _jacobian(problem, x)
    jacobian = noise.whitened(plain)
    lengths = np.linalg.norm(jacobian, axis=0)
    for name, length in zip(problem.names, lengths, strict=True):
        if length < 1e-9 * max(lengths.max(), 1e-300):
            raise NotIdentifiableError(f"{name} does not act on the data at all")
    freedom = problem.size - len(problem.names)
    unit = jacobian / lengths
    strength, direction = np.linalg.eigh(unit.T @ unit)
    inverse = direction / np.maximum(strength, 1e-14) @ direction.T
    covariance = inverse / np.outer(lengths, lengths) * problem.size / freedom
    errors = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(errors, errors)
    moved = _moved(problem, x, displaced, plain, noise)
    values = problem.values(x)
    estimates = {
        name: _estimate(
            name, values[name], float(errors[i]), freedom, [m[i] for m in moved]
        )
        for i, name in enumerate(problem.names)
    }
    residual = noise.freed(problem.residual(x))
    traced, fired = residual[problem.traced], residual[~problem.traced]
    return Identified(
        circuit=problem.driven(x)[0].circuit,
        estimates=estimates,
        correlation=correlation,
        scatter_V_C1=scatter(traced) if traced.size else None,
        scatter_V_fire=scatter(fired) if fired.size else None,
        warnings=_warnings(estimates, correlation, float(strength[0])),
    )


def _jacobian(problem: JointResiduals, x: FloatArray) -> FloatArray:
    """Central differences in the scaled parameters, shape (points, parameters)."""
    columns = []
    for i in range(x.size):
        step = np.zeros(x.size)
        step[i] = 1e-3
        change = problem.residual(x + step) - problem.residual(x - step)
        columns.append(change / 2e-3)
    return np.column_stack(columns)


def _estimate(
    name: str,
    value: float,
    error: float,
    freedom: int,
    halves: Sequence[float],
) -> Estimate:
    if name in SCALES:
        found = Estimate.of(value, error * SCALES[name], freedom)
        return found.widened(*(half * SCALES[name] for half in halves))
    logarithm = Estimate.of(float(np.log(value)), error, freedom).widened(*halves)
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
