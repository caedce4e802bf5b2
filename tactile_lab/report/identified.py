"""Identification from a run as it is reported."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tactile_lab.analysis.evidence import factor_of
from tactile_lab.analysis.identify import Evidence, Identified, identify_together
from tactile_lab.arrays import FloatArray
from tactile_lab.deviation import DrivenCircuit
from tactile_lab.errors import NotIdentifiableError, ParameterError
from tactile_lab.model.circuit import Circuit
from tactile_lab.report.run_data import RunData
from tactile_lab.report.twin import measured
from tactile_lab.scope import CLOCK_ERROR
from tactile_lab.waveform import Waveform

LAG = 0.03
"""Time after a step of the current until the field has followed, s, where the bench
file does not say how it lags: L/R and eddy currents last some milliseconds."""

RATE = "rate"
"""The cause by which the scope's clock is fast or slow."""


def identify_run(run: RunData, names: Sequence[str]) -> Identified:
    """Fit the parameters `names` to one run; see `identify_runs`."""
    return identify_together([_evidence(run, names)], names)


@dataclass(frozen=True, kw_only=True, eq=False)
class FittedRuns:
    """One set of parameters of several runs.

    Attributes:
        together: fitted to all of them.
        alone: fitted to each, by the run's name; None where it alone cannot tell.
    """

    together: Identified
    alone: dict[str, Identified | None]

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the data do not determine, and which runs say something else."""
        found = list(self.together.warnings)
        for name, joint in self.together.estimates.items():
            for run, one in self.alone.items():
                if one is None or name not in one.estimates:
                    continue
                mine = one.estimates[name]
                if mine.high < joint.low or mine.low > joint.high:
                    found.append(
                        f"{run} alone gives {name} from {mine.low:.6g} to "
                        f"{mine.high:.6g}: the runs do not share one value, and their "
                        "common one is none of them"
                    )
        return tuple(found)


def identify_runs(
    runs: Sequence[RunData], names: Sequence[str], *, force_scales: bool = False
) -> FittedRuns:
    """Fit one set of the parameters `names` to several runs, and each by itself.

    Args:
        runs: at least one.
        names: parameters of `Circuit` to fit.
        force_scales: fit a factor of each run's force as well, "force_1" and so on;
            alone too, by the same name.

    Raises:
        NotIdentifiableError: a run has neither V_C1 nor spikes, or they do not
            determine a parameter.
        ParameterError: an unknown parameter, or a run that is named twice.
    """
    told = [run.run for run in runs]
    if twice := [name for name in told if told.count(name) > 1]:
        raise ParameterError(
            f"{twice[0]} is named twice; its evidence would count twice. Name it once."
        )
    seen = [_evidence(run, names) for run in runs]
    if force_scales:
        # a factor that is fitted is not held by what was believed of the force
        seen = [replace(s, causes=[c for c in s.causes if c != "force"]) for s in seen]
    together = identify_together(seen, names, force_scales=force_scales)
    alone: dict[str, Identified | None] = {}
    for i, (run, one) in enumerate(zip(runs, seen, strict=True), start=1):
        try:
            own = identify_together([one], names, force_scales=force_scales)
        except NotIdentifiableError:
            alone[run.run] = None
            continue
        called = {factor_of(1): factor_of(i)}
        estimates = {called.get(n, n): value for n, value in own.estimates.items()}
        alone[run.run] = replace(own, estimates=estimates)
    return FittedRuns(together=together, alone=alone)


def _evidence(run: RunData, names: Sequence[str]) -> Evidence:
    """What a run says of the parameters."""
    trace = run.trace("V_C1")
    if run.circuit is None or run.belief is None:
        raise NotIdentifiableError(
            f"{run.run} ({run.title}) drove no coil: what is fitted is how V_C1 and "
            "the spikes answer a force. Name a run that presses the sensor, such as "
            "of demo"
        )
    if trace is None and run.train is None:
        raise NotIdentifiableError(
            f"{run.run} has neither V_C1 nor all of its spikes; record V_C1, or V_K "
            "at a rate that misses none"
        )
    believed = run.belief
    spikes = run.train
    seen = None
    if trace is not None:
        seen = measured(run, believed, trace)
        lag = LAG if believed.magnet.lag_uncertainty is None else 0.0
        known = believed.clock + float(believed.doubt.max(initial=0.0))
        inside = settled(run.force, seen.time, known, lag)
        seen = replace(seen, time=seen.time[inside], value=seen.value[inside])

    scattered = believed.scattered
    # another run's answers were late at other steps
    ramps = [f"answers of {run.run}, ramp {i}" for i in range(len(scattered))]

    def moved(circuit: Circuit, parts: Mapping[str, float]) -> DrivenCircuit:
        bands = np.array([parts.get(what, 0.0) for _, what, _ in believed.bands])
        late = [parts.get(ramp, 0.0) for ramp in ramps]
        placed = believed.shifted(late @ scattered) if any(late) else believed
        driven = replace(placed, circuit=circuit).moved(bands)
        return _by_scope(
            driven, CLOCK_ERROR * parts[RATE], stretched=not believed.dated
        )

    # what is fitted is not held by what was believed of it
    fitted = {"input_bias"} if "I_bias" in names else set()
    causes = [what for _, what, _ in believed.bands if what not in fitted]
    causes += [RATE, *ramps]
    return Evidence(
        believed.circuit,
        believed.force,
        run.duration,
        V_C1=seen,
        spike_times=None if spikes is None else spikes[spikes <= run.duration],
        causes=causes,
        moved=moved,
    )


def _by_scope(driven: DrivenCircuit, fast: float, *, stretched: bool) -> DrivenCircuit:
    """What a scope sees whose clock is fast by a part of itself: all takes longer."""
    circuit, force = driven
    longer = {name: getattr(circuit, name) * (1 + fast) for name in ("tau", "C1", "C2")}
    if stretched:
        force = force.each(lambda w: Waveform(w.time * (1 + fast), w.value))
    return DrivenCircuit(replace(circuit, **longer), force)


def settled(
    force: Waveform, time: FloatArray, clock: float, lag: float
) -> NDArray[np.bool_]:
    """Which bins lie wholly where the force is known.

    Args:
        force: with the steps of the source.
        time: shape (n,), middles of the bins, s.
        clock: how far a step may lie from where it is believed to be, s.
        lag: how long after a step the force is not known, s.
    """
    steps = np.concatenate(
        [[-np.inf], force.time[1:][np.diff(force.value) != 0], [np.inf]]
    )
    half = float(np.median(np.diff(time))) / 2 if time.size > 1 else 0.0
    after = np.searchsorted(steps, time + half + clock, side="right")
    beyond: NDArray[np.bool_] = time - half - steps[after - 1] > clock + lag
    return beyond
