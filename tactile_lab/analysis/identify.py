"""Identification: fit chosen sensor parameters to a run, and say what it cannot tell.

Two kinds of evidence are used. V_C1, bin by bin. And each pair of neighbouring spikes:
with V_C2 set to V_reset at the earlier one, the model must reach V_fire at the later
one. The second is smooth in the parameters, unlike a comparison of spike trains, whose
number of spikes jumps.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tactile_lab.analysis.estimate import Estimate
from tactile_lab.analysis.spike_pairs import PART
from tactile_lab.analysis.twin import Measured
from tactile_lab.errors import NotIdentifiableError, ParameterError
from tactile_lab.model.circuit import PARAMETERS, Circuit
from tactile_lab.model.equations import I_C
from tactile_lab.model.simulate import simulate
from tactile_lab.waveform import Waveform

FloatArray = NDArray[np.float64]

VOLTAGES = frozenset({"V_GS", "V_S", "V_th", "V_fire", "V_reset"})
SCALES = {**dict.fromkeys(VOLTAGES, 0.01), "I_bias": 1e-10, "g31": 0.004}
"""Steps of parameters fitted as they are; all others are fitted by their logarithm."""
ALIKE = 0.98
"""Two parameters whose estimates correlate more than this are hardly told apart."""
DEGENERATE = 1e-7
"""Least eigenvalue of the normalised information below which they cannot be."""
LOOSE = 0.5
"""A parameter known worse than this part of itself is not identified."""
LOOSE_VOLTAGE = 0.1
"""The same for voltages, V."""
DIFFERENCE = np.array(1e-4)
STEP = 2e-3
"""Grid on which I_C is integrated between spikes, s."""
LONGEST = 1.0
"""Intervals longer than this tell little about rate and much about drift, s."""


@dataclass(frozen=True, eq=False)
class Identified:
    """Fitted parameters.

    Attributes:
        circuit: with the fitted values.
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


def identify(
    circuit: Circuit,
    names: Sequence[str],
    force: Waveform,
    duration: float,
    *,
    V_C1: Measured | None = None,
    spike_times: FloatArray | None = None,
    displaced: Sequence[Waveform] = (),
) -> Identified:
    """Fit the parameters `names`, starting from those of `circuit`.

    Args:
        circuit: the sensor as it is believed to be.
        names: parameters of `Circuit` to fit.
        force: N on the run's time axis, from the measured coil current.
        duration: of the run, s.
        V_C1: measured, decimated; its bins must be independent. Its resolution is taken
            for what the channel's offset is known to.
        spike_times: detected spikes, s.
        displaced: the force moved by `twin.PART` of its 95 % band, one for each
            independent cause of its uncertainty.

    Intervals hold the scatter of the data, and what the offset of V_C1 and each
    displaced force would move the estimate by.

    Raises:
        ParameterError: an unknown parameter, or an option.
        NotIdentifiableError: no data, fewer points than parameters, or a parameter
            that does not act on the data at all.
    """
    _check(circuit, names)
    problem = _Problem(circuit, tuple(names), force, duration, V_C1, spike_times)
    if problem.size <= len(names):
        raise NotIdentifiableError(
            f"{problem.size} data points cannot determine {len(names)} parameters"
        )
    x, weights = np.zeros(len(names)), problem.first_weights()
    for _ in range(3):  # the scatter of the two kinds of evidence is itself estimated
        solved = least_squares(
            problem.weighted, x, x_scale="jac", diff_step=DIFFERENCE, method="lm",
            kwargs={"weights": weights},
        )  # fmt: skip
        x = np.asarray(solved.x, dtype=np.float64)
        weights = problem.weights(problem.residual(x))
    return _identified(problem, x, weights, _systematic(problem, x, displaced))


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


class _Problem:
    """Residuals of one identification as a function of scaled parameters."""

    def __init__(
        self,
        circuit: Circuit,
        names: tuple[str, ...],
        force: Waveform,
        duration: float,
        V_C1: Measured | None,
        spike_times: FloatArray | None,
    ) -> None:
        self.names = names
        self._circuit, self._force, self._duration = circuit, force, duration
        self._trace = V_C1
        times = np.empty(0) if spike_times is None else np.asarray(spike_times)
        short = np.diff(times) <= LONGEST
        self._earlier, self._later = times[:-1][short], times[1:][short]
        self.bins = 0 if V_C1 is None else int(V_C1.time.size)
        self.offset = 0.0 if V_C1 is None else V_C1.resolution
        self.size = self.bins + self._earlier.size
        self._grids = [
            np.linspace(a, b, max(8, int((b - a) / STEP)) | 1)
            for a, b in zip(self._earlier, self._later, strict=True)
        ]

    def circuit(self, x: FloatArray) -> Circuit:
        """The circuit at scaled parameters `x`, 0 where the start lies."""
        changed: dict[str, Any] = {}
        for name, step in zip(self.names, x, strict=True):
            start = self._start(name)
            if name in SCALES:
                changed[name] = start + SCALES[name] * float(step)
            else:
                changed[name] = start * float(np.exp(np.clip(step, -20, 20)))
        return dataclasses.replace(self._circuit, **changed)

    def _start(self, name: str) -> float:
        if name == "V_fire":
            return self._circuit.fire_voltage
        if name == "V_reset":
            return self._circuit.reset_voltage
        return float(getattr(self._circuit, name))

    def residual(self, x: FloatArray, force: Waveform | None = None) -> FloatArray:
        """All residuals, V, under `force`: those of V_C1, then those at firing."""
        circuit, force = self.circuit(x), force or self._force
        found = simulate(
            circuit, force, keep=("V_C1",), until=self._duration, tolerance=1e-7
        )
        parts = []
        if self._trace is not None:
            parts.append(self._trace.value - found.sample("V_C1", self._trace.time))
        if self._grids:
            everywhere = np.concatenate(self._grids)
            current = I_C(circuit, found.sample("V_C1", everywhere)) + circuit.I_bias
            parts.append(self._at_firing(circuit, current))
        return np.concatenate(parts) if parts else np.empty(0)

    def _at_firing(self, circuit: Circuit, current: FloatArray) -> FloatArray:
        """V_C2 at each later spike, from V_reset at the earlier one, less V_fire."""
        misses, at = np.empty(len(self._grids)), 0
        for i, grid in enumerate(self._grids):
            flowing = current[at : at + grid.size]
            at += grid.size
            left = np.exp((grid - grid[-1]) / circuit.tau_L)
            charge = _simpson(flowing * left, grid) / circuit.C2
            kept = circuit.reset_voltage * left[0]
            misses[i] = charge + kept - circuit.fire_voltage
        return misses

    def weighted(self, x: FloatArray, weights: FloatArray) -> FloatArray:
        """All residuals over their scatter."""
        return self.residual(x) * weights

    def first_weights(self) -> FloatArray:
        """A few millivolts for either kind of evidence, before anything is known."""
        return np.full(self.size, 1 / 5e-3)

    def weights(self, residual: FloatArray) -> FloatArray:
        """One over the scatter of each kind of evidence."""
        weights = np.empty(self.size)
        for part in (slice(0, self.bins), slice(self.bins, self.size)):
            if residual[part].size:
                weights[part] = 1 / max(_scatter(residual[part]), 1e-9)
        return weights


def _scatter(residual: FloatArray) -> float:
    return float(np.sqrt(np.mean(residual**2)))


def _simpson(values: FloatArray, grid: FloatArray) -> float:
    """Integral over an even number of equal steps."""
    step = (grid[-1] - grid[0]) / (grid.size - 1)
    total = values[0] + values[-1] + 4 * values[1:-1:2].sum() + 2 * values[2:-1:2].sum()
    return float(total * step / 3)


def _systematic(
    problem: _Problem, x: FloatArray, displaced: Sequence[Waveform]
) -> list[FloatArray]:
    """Half of the 95 % band each systematic cause gives all residuals, V."""
    here = problem.residual(x)
    causes = [(problem.residual(x, f) - here) / PART for f in displaced]
    if problem.bins and problem.offset:
        shifted = np.zeros(problem.size)
        shifted[: problem.bins] = problem.offset
        causes.append(shifted)
    return causes


def _identified(
    problem: _Problem, x: FloatArray, weights: FloatArray, causes: list[FloatArray]
) -> Identified:
    jacobian = _jacobian(problem, x) * weights[:, None]
    lengths = np.linalg.norm(jacobian, axis=0)
    for name, length in zip(problem.names, lengths, strict=True):
        if length < 1e-9 * max(lengths.max(), 1e-300):
            raise NotIdentifiableError(f"{name} does not act on the data at all")
    freedom = problem.size - len(problem.names)
    residual = problem.residual(x)
    unit = jacobian / lengths
    strength, direction = np.linalg.eigh(unit.T @ unit)
    inverse = direction / np.maximum(strength, 1e-14) @ direction.T
    covariance = inverse / np.outer(lengths, lengths) * problem.size / freedom
    errors = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(errors, errors)
    circuit = problem.circuit(x)
    # what each cause moves the least-squares estimate by, to first order
    solve = inverse / np.outer(lengths, lengths) @ jacobian.T
    moved = [np.abs(solve @ (cause * weights)) for cause in causes]
    estimates = {
        name: _estimate(
            problem, circuit, name, float(errors[i]), freedom, [m[i] for m in moved]
        )
        for i, name in enumerate(problem.names)
    }
    bins = problem.bins
    return Identified(
        circuit=circuit,
        estimates=estimates,
        correlation=correlation,
        scatter_V_C1=_scatter(residual[:bins]) if bins else None,
        scatter_V_fire=_scatter(residual[bins:]) if problem.size > bins else None,
        warnings=_warnings(estimates, correlation, float(strength[0])),
    )


def _jacobian(problem: _Problem, x: FloatArray) -> FloatArray:
    """Central differences in the scaled parameters, shape (points, parameters)."""
    columns = []
    for i in range(x.size):
        step = np.zeros(x.size)
        step[i] = 1e-3
        change = problem.residual(x + step) - problem.residual(x - step)
        columns.append(change / 2e-3)
    return np.column_stack(columns)


def _estimate(
    problem: _Problem,
    circuit: Circuit,
    name: str,
    error: float,
    freedom: int,
    halves: Sequence[float],
) -> Estimate:
    value = getattr(circuit, name)
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
    for i, one in enumerate(names):
        for j in range(i + 1, len(names)):
            if abs(correlation[i, j]) > ALIKE:
                hard = "cannot be" if weakest < DEGENERATE else "are hardly"
                found.append(
                    f"{one} and {names[j]} {hard} told apart by these data "
                    f"(correlation {correlation[i, j]:.3f}): fix one of them"
                )
    for name, estimate in estimates.items():
        limit = LOOSE_VOLTAGE if name in VOLTAGES else LOOSE * abs(estimate.value)
        if (estimate.high - estimate.low) / 2 > limit:
            found.append(
                f"{name} is not identifiable: its 95 % interval is {estimate.low:.3g} "
                f"to {estimate.high:.3g}"
            )
    return tuple(found)
