"""Identification from a run as it is reported."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tactile_lab.analysis.identify import Identified, identify
from tactile_lab.analysis.twin import Measured
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.measurement import Measurement
from tactile_lab.report.twin import displaced
from tactile_lab.waveform import Waveform

LAG = 0.03
"""Time after a step of the current until the field has followed, s: the coil's L/R and
the core's eddy currents, which the model does not know, last some milliseconds."""


def identify_run(run: Measurement, names: Sequence[str]) -> Identified:
    """Fit the parameters `names` to V_C1 and the spikes of a run.

    Raises:
        NotIdentifiableError: the run has neither, or does not determine a parameter.
        ParameterError: an unknown parameter.
    """
    trace = run.trace("V_C1")
    if run.circuit is None or (trace is None and not run.searched):
        raise NotIdentifiableError(
            "the run has neither V_C1 nor spikes; record V_C1 or V_K"
        )
    spikes = run.spike_times
    seen = None
    if trace is not None:
        inside = (trace.time >= 0) & (trace.time <= run.duration)
        inside &= settled(run.force, trace.time) & trace.within_range
        code = trace.code or 0.0
        seen = Measured("V_C1", trace.time[inside], trace.mean[inside], code)
    return identify(
        run.circuit,
        names,
        run.force,
        run.duration,
        V_C1=seen,
        spike_times=spikes[spikes <= run.duration] if run.searched else None,
        displaced=displaced(run),
    )


def settled(force: Waveform, time: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which bins (middles, s) lie wholly beyond `LAG` of the step before."""
    steps = np.append(-np.inf, force.time[1:][np.diff(force.value) != 0])
    half = float(np.median(np.diff(time))) / 2 if time.size > 1 else 0.0
    last = steps[np.searchsorted(steps, time + half, side="right") - 1]
    beyond: NDArray[np.bool_] = time - half - last > LAG
    return beyond
