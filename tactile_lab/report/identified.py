"""Identification from a run as it is reported."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tactile_lab.analysis.identify import Identified, identify
from tactile_lab.deviation import DrivenCircuit
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.model.circuit import Circuit
from tactile_lab.report.run_data import RunData
from tactile_lab.report.twin import measured
from tactile_lab.waveform import Waveform

LAG = 0.03
"""Time after a step of the current until the field has followed, s, where the bench
file does not say how it lags: L/R and eddy currents last some milliseconds."""


def identify_run(run: RunData, names: Sequence[str]) -> Identified:
    """Fit the parameters `names` to V_C1 and the spikes of a run.

    Raises:
        NotIdentifiableError: the run has neither, or does not determine a parameter.
        ParameterError: an unknown parameter.
    """
    trace = run.trace("V_C1")
    if (
        run.circuit is None
        or run.belief is None
        or (trace is None and not run.searched)
    ):
        raise NotIdentifiableError(
            "the run has neither V_C1 nor spikes; record V_C1 or V_K"
        )
    believed = run.belief
    spikes = run.spike_times
    seen = None
    if trace is not None:
        seen = measured(run, believed, trace)
        if believed.magnet.lag_uncertainty is None:
            inside = settled(run.force, seen.time)
            seen = replace(seen, time=seen.time[inside], value=seen.value[inside])

    def displaced(circuit: Circuit) -> Iterator[tuple[str, DrivenCircuit]]:
        for name, driven in replace(believed, circuit=circuit).displaced():
            if not (name == "follower" and "I_bias" in names):
                yield name, driven

    return identify(
        believed.circuit,
        names,
        believed.force,
        run.duration,
        V_C1=seen,
        spike_times=spikes[spikes <= run.duration] if run.searched else None,
        displaced=displaced,
    )


def settled(force: Waveform, time: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which bins (middles, s) lie wholly beyond `LAG` of the step before."""
    steps = np.append(-np.inf, force.time[1:][np.diff(force.value) != 0])
    half = float(np.median(np.diff(time))) / 2 if time.size > 1 else 0.0
    last = steps[np.searchsorted(steps, time + half, side="right") - 1]
    beyond: NDArray[np.bool_] = time - half - last > LAG
    return beyond
