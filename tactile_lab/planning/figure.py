"""The preview: planned force and what the model makes of it, one lane per signal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tactile_lab.errors import SceneError
from tactile_lab.model.simulate import Result
from tactile_lab.planning.plan import Plan
from tactile_lab.waveform import Waveform

POINTS = 4000
INK, ASKED, MODEL, SPIKE = "#1f2328", "#8a929b", "#0b62a4", "#b3402a"
_SCALE = {
    "force": (1e3, "Force\nmN"),
    "V_P": (1.0, "V_P\nV"),
    "V_C1": (1.0, "V_C1\nV"),
    "I_DS": (1e9, "I_DS\nnA"),
    "I_C": (1e9, "I_C\nnA"),
    "V_C2": (1.0, "V_C2\nV"),
    "rate": (1.0, "Rate\nHz"),
    "spikes": (1.0, "Spikes"),
}


def draw(plan: Plan, path: Path) -> None:
    """Draw the preview of `plan` into `path` (PNG, SVG or PDF by its ending).

    Raises:
        SceneError: the file cannot be written.
    """
    lanes = ["force"]
    if plan.preview is not None:
        recorded = plan.scene.record.signals
        lanes += [name for name in _SCALE if name in recorded and name != "force"]
    figure = Figure(figsize=(9, 1.2 + 1.25 * len(lanes)), layout="constrained")
    axes = figure.subplots(len(lanes), 1, sharex=True, squeeze=False)[:, 0]
    for axis, name in zip(axes, lanes, strict=True):
        if name == "force":
            _force(axis, plan)
        elif plan.preview is not None:
            _lane(axis, plan.preview, name)
        scale_title = _SCALE[name][1]
        axis.set_ylabel(scale_title, rotation=0, ha="right", va="center", color=INK)
        axis.spines[["top", "right"]].set_visible(False)
        axis.tick_params(colors=INK, labelsize=8)
    axes[-1].set_xlabel("Time, s", color=INK)
    axes[-1].set_xlim(0, plan.timeline.duration)
    figure.align_ylabels(axes)
    kind = "simulated bench" if plan.scene.bench.simulated else plan.scene.bench.name
    axes[0].set_title(
        f"{plan.scene.name}: preview from the model, {kind}",
        loc="left",
        fontsize=10,
        color=INK,
    )
    try:
        figure.savefig(path, dpi=150)
    except OSError as reason:
        raise SceneError(f"--preview {path} cannot be written: {reason}.") from reason


def _force(axis: Axes, plan: Plan) -> None:
    for step in plan.timeline.steps:
        if step.trial.pause:
            axis.axvspan(
                step.start,
                step.start + step.trial.length,
                color=ASKED,
                alpha=0.15,
                lw=0,
            )
    asked = [
        _points(s.trial.force, s.start, s.trial.length) for s in plan.timeline.steps
    ]
    if plan.timeline.warnings:
        line = np.concatenate(asked)
        axis.plot(
            line[:, 0], line[:, 1] * 1e3, "--", lw=0.9, color=ASKED, label="asked"
        )
    force = plan.timeline.force
    axis.plot(force.time, force.value * 1e3, lw=1.2, color=INK, label="planned")
    if plan.timeline.warnings:
        axis.legend(frameon=False, fontsize=8, loc="upper right")


def _points(wave: Waveform, start: float, length: float) -> NDArray[np.float64]:
    inside = (wave.time >= 0) & (wave.time <= length)
    time = np.concatenate([[0.0], wave.time[inside], [length]])
    value = np.concatenate([wave.at([0.0]), wave.value[inside], wave.at([length])])
    return np.column_stack([time + start, value])


def _lane(axis: Axes, result: Result, name: str) -> None:
    if name == "spikes":
        spikes = np.empty(0) if result.spike_times is None else result.spike_times
        axis.eventplot([spikes], lineoffsets=0.5, linelengths=0.8, lw=0.8, colors=SPIKE)
        axis.set_ylim(0, 1)
        axis.set_yticks([])
        return
    times = _times(result)
    scale = _SCALE[name][0]
    style = "steps-post" if name == "rate" else "default"
    axis.plot(
        times, result.sample(name, times) * scale, lw=1.0, color=MODEL, drawstyle=style
    )


def _times(result: Result) -> NDArray[np.float64]:
    """An even grid, and both sides of each reset."""
    times = np.linspace(0.0, result.duration, POINTS)
    if result.spike_times is not None:
        spikes = result.spike_times
        times = np.sort(np.concatenate([times, spikes, np.nextafter(spikes, -np.inf)]))
    return times
