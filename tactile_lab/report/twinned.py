"""The twin of a run as its report needs it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tactile_lab.analysis.spike_pairs import PART
from tactile_lab.analysis.twin import Measured, Twin, twin
from tactile_lab.report.run_data import RunData, Trace
from tactile_lab.waveform import Waveform


def with_twin(run: RunData) -> tuple[RunData, Twin | None]:
    """The run with the model's V_C1 among its traces, and the twin behind it.

    The model is driven by the applied current's force. None where the run has no
    circuit, no applied current, or nothing to compare.

    Raises:
        SolverError: the model cannot follow this force.
    """
    voltages = tuple(
        Measured(name, trace.time, trace.mean, trace.code or 0.0)
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
        start=run.start,
        displaced=displaced(run),
        clock=max((t.clock_uncertainty or 0.0 for t in run.trials), default=0.0),
    )
    node_a = found.residual("V_C1")
    if node_a is None:
        return run, found
    model = Trace(
        signal="V_C1", time=node_a.time, mean=node_a.predicted, source="model"
    )
    return replace(run, traces=(*run.traces, model)), found


def displaced(run: RunData) -> list[Waveform]:
    """The force moved a little by each cause of its uncertainty."""
    known, force = run.force_uncertainty, run.force
    if known is None:
        return []
    # at rest there is no force, by definition
    pushed = np.where(force.value == 0, 0.0, PART * known.absolute)
    moved = [
        Waveform(force.time, force.value + pushed),
        force.scaled(1 + PART * known.relative),
    ]
    causes = (known.absolute, known.relative)
    return [w for w, size in zip(moved, causes, strict=True) if size > 0]


def sentences(run: RunData, found: Twin) -> tuple[str, ...]:
    """What the twin says, for people."""
    if run.force_uncertainty is None:
        said = [
            "Tolerance: what the scope's codes and the clocks leave open; no "
            "uncertainty of the force is stated."
        ]
    else:
        said = [
            "Tolerance: what the scope's codes, the clocks and the force's uncertainty "
            "leave open."
        ]
    for residual in found.residuals:
        shifted = (
            "; while it fires, spikes that come early or late make volts of difference"
            if residual.signal == "V_C2" and found.spikes is not None
            else ""
        )
        # adding 0 makes a rounded -0 plain
        offset = f"{round(residual.offset * 1e3, 1) + 0.0:+.1f}".replace("-", "−")
        said.append(
            f"{residual.signal}: measured less model is {offset} mV on average, "
            f"{residual.rms * 1e3:.1f} mV rms, within {residual.band * 1e3:.1f} mV for "
            f"95 % of the time; {100 * residual.within:.0f} % lie within the "
            f"tolerance of {np.median(residual.tolerance) * 1e3:.1f} mV "
            f"(median){shifted}."
        )
    if found.spikes is not None:
        text = f"Spikes: {found.spikes.sentence}"
        if np.isfinite(found.spikes.within):
            open_ = np.nanmedian(found.spikes.tolerance) * 1e3
            text += (
                f"; {100 * found.spikes.within:.0f} % of the offsets lie within the "
                f"tolerance of {open_:.2g} ms (median)"
            )
        said.append(f"{text}.")
    return tuple(said)
