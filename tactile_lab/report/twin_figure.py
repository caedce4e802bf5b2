"""The model beside the run: residual of V_C1, spike offsets, error of the rate."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tactile_lab.analysis.spike_pairs import Matched
from tactile_lab.analysis.twin import Residual
from tactile_lab.report import palette
from tactile_lab.report.canvas import HEAD_HEIGHT, axes, blank, heading
from tactile_lab.report.figure import FOOT, GAP, LEFT, RIGHT, WIDTH
from tactile_lab.report.findings import Findings, stretches
from tactile_lab.report.splice import Axis

PANEL = 1.2
"""Height of one panel, inches."""
CAPTION = (
    "Measured less model, the model driven by the applied current. (a) V_C1. (b) Times "
    "of matched spikes. (c) Rate 1/ISI. Shaded: the tolerance, what the scope's codes, "
    "the clocks and the stated uncertainty of the force leave open (95 %). Short peaks "
    "at steps of the force are the field's lag behind the current, which the model "
    "does not know."
)


def twin_figure(findings: Findings) -> Figure | None:
    """The figure; None where the run has no twin or nothing to compare."""
    twin = findings.twin
    if twin is None:
        return None
    node_a = twin.residual("V_C1")
    matched = twin.spikes if twin.spikes and twin.spikes.offsets.size else None
    count = (node_a is not None) + 2 * (matched is not None)
    if not count:
        return None
    height = HEAD_HEIGHT + FOOT + count * PANEL + (count - 1) * GAP
    drawn, axis = blank(WIDTH, height), Axis(findings.run)
    panels: list[Axes] = []
    for i in range(count):
        top = height - HEAD_HEIGHT - i * (PANEL + GAP)
        box = (LEFT, top - PANEL, WIDTH - LEFT - RIGHT, PANEL)
        panels.append(axes(drawn, box, share=panels[0] if panels else None))
    left = iter(panels)
    if node_a is not None:
        _voltage(next(left), node_a, axis)
    if matched is not None:
        _offsets(next(left), matched, axis)
        _rates(next(left), matched, axis)
    for panel, letter in zip(panels, "abc", strict=False):
        panel.axhline(0, color=palette.QUIET.light, lw=0.6, zorder=1)
        panel.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
        panel.yaxis.set_label_coords(-0.42 / (WIDTH - LEFT - RIGHT), 0.5)
        panel.annotate(
            letter, (0, 1), (-0.58 * 72, -1), xycoords="axes fraction",
            textcoords="offset points", weight="bold", size=10,
            color=palette.INK.light, va="top",
        )  # fmt: skip
        for cut in axis.cuts:
            panel.axvline(
                cut, color=palette.QUIET.light, lw=0.6, ls=(0, (2, 2)), zorder=1
            )
    for panel in panels[:-1]:
        panel.tick_params(axis="x", labelbottom=False, length=0)
        panel.spines["bottom"].set_visible(False)
    last = panels[-1]
    last.set_xlim(0, float(axis.closed(np.array(findings.run.duration))))
    last.set_xlabel(
        "Time (s), recoveries left out (dotted)" if axis.cuts else "Time (s)"
    )
    run = findings.run
    subtitle = " · ".join(part for part in (run.scene, run.run, run.started) if part)
    title = f"{run.title}: measured less model"
    heading(drawn, title, subtitle, simulated=run.simulated)
    return drawn


def _voltage(panel: Axes, residual: Residual, axis: Axis) -> None:
    keep = axis.shown(residual.time)
    time = axis.closed(residual.time)[keep]
    difference = residual.difference[keep] * 1e3
    tolerance = residual.tolerance[keep] * 1e3
    for piece in stretches(time):
        _band(panel, time[piece], tolerance[piece])
        panel.plot(time[piece], difference[piece], color=palette.V_C1.light, lw=0.7)
    # single bins at an edge of the force would hide everything else
    most = 1.3 * max(
        float(np.nanpercentile(np.abs(difference), 99.5)), float(np.median(tolerance))
    )
    panel.set_ylim(-(most or 1.0), most or 1.0)
    panel.set_ylabel("$V_{C1}$ (mV)")


def _offsets(panel: Axes, matched: Matched, axis: Axis) -> None:
    _points(panel, axis, matched.measured, matched.offsets, matched.tolerance, 1e3)
    panel.set_ylabel("Spikes (ms)")


def _rates(panel: Axes, matched: Matched, axis: Axis) -> None:
    _points(panel, axis, matched.rated, matched.rate_error, matched.rate_tolerance, 100)
    panel.set_ylabel("Rate (%)")


def _points(
    panel: Axes,
    axis: Axis,
    time: np.ndarray,
    value: np.ndarray,
    tolerance: np.ndarray,
    scale: float,
) -> None:
    at = axis.closed(time)
    panel.vlines(
        at, -tolerance * scale, tolerance * scale, color=palette.TWIN.light,
        alpha=0.35, lw=3 if at.size < 60 else 1, zorder=2,
    )  # fmt: skip
    panel.plot(
        at, value * scale, "o", color=palette.RATE.light, ms=2.4, mew=0, zorder=3
    )
    # tolerances grow beyond all bounds where a spike only just comes
    known = tolerance[np.isfinite(tolerance)]
    most = max(float(np.max(np.abs(value), initial=0.0)), _median(known)) * scale * 1.2
    panel.set_ylim(-(most or 1.0), most or 1.0)


def _median(values: np.ndarray) -> float:
    return float(np.median(values)) if values.size else 0.0


def _band(panel: Axes, time: np.ndarray, tolerance: np.ndarray) -> None:
    panel.fill_between(
        time, -tolerance, tolerance, color=palette.TWIN.light, alpha=0.18, lw=0
    )
