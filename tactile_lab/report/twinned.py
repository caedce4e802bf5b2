"""The twin of a run as its report needs it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tactile_lab.analysis.twin import Measured, Twin, twin
from tactile_lab.report.run_data import RunData, Trace


def with_twin(run: RunData) -> tuple[RunData, Twin | None]:
    """The run with the model's V_C1 among its traces, and the twin behind it.

    The model is driven by the applied current's force. None where the run has no
    circuit, no applied current, or nothing to compare.

    Raises:
        SolverError: the model cannot follow this force.
    """
    voltages = tuple(
        Measured(name, trace.time, trace.mean)
        for name in ("V_C1", "V_C2")
        if (trace := run.trace(name)) and trace.time.size
    )
    if run.circuit is None or run.current is None or not len(run.current):
        return run, None
    if not voltages and not run.searched:
        return run, None
    spikes = np.concatenate(
        [t.spike_times + t.start for t in run.trials if not t.pause] or [np.empty(0)]
    )
    pauses = [(t.start, t.start + t.duration) for t in run.trials if t.pause]
    found = twin(
        run.circuit,
        run.force,
        run.duration,
        voltages=voltages,
        spike_times=spikes if run.searched else None,
        pauses=pauses,
    )
    node_a = found.residual("V_C1")
    if node_a is None:
        return run, found
    model = Trace(
        signal="V_C1", time=node_a.time, mean=node_a.predicted, source="model"
    )
    return replace(run, traces=(*run.traces, model)), found


def sentences(found: Twin) -> tuple[str, ...]:
    """What the twin says, for people."""
    said = []
    for residual in found.residuals:
        shifted = (
            "; while it fires, spikes that come early or late make volts of difference"
            if residual.signal == "V_C2" and found.spikes is not None
            else ""
        )
        offset = f"{residual.offset * 1e3:+.1f}".replace("-", "−")
        said.append(
            f"{residual.signal}: measured less model is {offset} mV on average, "
            f"{residual.rms * 1e3:.1f} mV rms, within {residual.band * 1e3:.1f} mV for "
            f"95 % of the time{shifted}."
        )
    if found.spikes is not None:
        said.append(f"Spikes: {found.spikes.sentence}.")
    return tuple(said)
