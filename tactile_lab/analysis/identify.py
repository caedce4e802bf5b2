"""Identification: fit chosen sensor parameters to a run, and say what it cannot tell.

What it is fitted to: `tactile_lab.analysis.evidence`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tactile_lab.analysis.belief import PART
from tactile_lab.analysis.estimate import Z95, Estimate
from tactile_lab.analysis.evidence import SCALES, VOLTAGES, Residuals, Together, scatter
from tactile_lab.analysis.twin import Measured
from tactile_lab.deviation import DrivenCircuit
from tactile_lab.errors import NotIdentifiableError, ParameterError
from tactile_lab.model.circuit import PARAMETERS, Circuit
from tactile_lab.waveform import Waveform

FloatArray = NDArray[np.float64]
Displaced = Callable[[Circuit], Iterable[tuple[str, DrivenCircuit]]]

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
        displaced: what a circuit and its force become if either is moved by `PART` of
            its 95 % band, for each independent cause of uncertainty.
    """

    circuit: Circuit
    force: Waveform
    duration: float
    V_C1: Measured | None = None
    spike_times: FloatArray | None = None
    displaced: Displaced = lambda _: ()


def identify(
    circuit: Circuit,
    names: Sequence[str],
    force: Waveform,
    duration: float,
    *,
    V_C1: Measured | None = None,
    spike_times: FloatArray | None = None,
    displaced: Displaced = lambda _: (),
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
    problem = Together(problems, scaled=force_scales)
    if problem.size <= len(problem.names):
        raise NotIdentifiableError(
            f"{problem.size} data points cannot determine {len(problem.names)} "
            "parameters" + "".join(f" ({why})" for why in unused)
        )
    x, weights = np.zeros(len(problem.names)), problem.first_weights()
    for _ in range(3):  # the scatter of the two kinds of evidence is itself estimated
        solved = least_squares(
            problem.weighted, x, x_scale="jac", diff_step=DIFFERENCE, method="lm",
            kwargs={"weights": weights},
        )  # fmt: skip
        x = np.asarray(solved.x, dtype=np.float64)
        weights = problem.weights(problem.residual(x))
        causes = _systematic(problem, x, [one.displaced for one in runs])
        weights = _without_edges(weights, causes)
    found = _identified(problem, x, weights, [moved for _, moved in causes])
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


def _systematic(
    problem: Together, x: FloatArray, displaced: Sequence[Displaced]
) -> list[tuple[str, FloatArray]]:
    """Half of the 95 % band each systematic cause gives all residuals, V, by name.

    The n-th cause of a name is the same one in every run.
    """
    driven, here = problem.driven(x), problem.residual(x)
    found: dict[tuple[str, int], list[DrivenCircuit]] = {}
    scales = problem.scales(x)
    for number, (one, causes_of) in enumerate(zip(driven, displaced, strict=True)):
        met: Counter[str] = Counter()
        for name, moved in causes_of(one.circuit):
            scaled = DrivenCircuit(moved.circuit, moved.force.scaled(scales[number]))
            found.setdefault((name, met[name]), list(driven))[number] = scaled
            met[name] += 1
    causes = [
        (name, (problem.under(moved) - here) / PART)
        for (name, _), moved in found.items()
    ]
    if problem.offsets.any():
        causes.append(("offset", problem.offsets))
    return causes


def _without_edges(
    weights: FloatArray, causes: Sequence[tuple[str, FloatArray]]
) -> FloatArray:
    """Weights that trust little what a small error of a time moves far, as at edges."""
    late = [moved / Z95 for name, moved in causes if name in TIMES]
    return 1 / np.sqrt(1 / weights**2 + sum((moved**2 for moved in late), np.array(0)))


def _identified(
    problem: Together, x: FloatArray, weights: FloatArray, causes: list[FloatArray]
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
    values = problem.values(x)
    # what each cause moves the least-squares estimate by, to first order
    solve = inverse / np.outer(lengths, lengths) @ jacobian.T
    moved = [np.abs(solve @ (cause * weights)) for cause in causes]
    estimates = {
        name: _estimate(
            name, values[name], float(errors[i]), freedom, [m[i] for m in moved]
        )
        for i, name in enumerate(problem.names)
    }
    traced, fired = residual[problem.traced], residual[~problem.traced]
    return Identified(
        circuit=problem.driven(x)[0].circuit,
        estimates=estimates,
        correlation=correlation,
        scatter_V_C1=scatter(traced) if traced.size else None,
        scatter_V_fire=scatter(fired) if fired.size else None,
        warnings=_warnings(estimates, correlation, float(strength[0])),
    )


def _jacobian(problem: Together, x: FloatArray) -> FloatArray:
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
