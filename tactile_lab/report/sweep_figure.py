"""Gain and phase of V_C1 over the force against frequency, and the model's."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from tactile_lab.report import palette
from tactile_lab.report.canvas import BOX, HEIGHT, WIDTH, axes, blank
from tactile_lab.report.findings import Findings
from tactile_lab.report.sweep import degrees, known_gain, responses


def sweep_figure(findings: Findings) -> Figure | None:
    """The figure; None below two frequencies."""
    run = findings.run
    measured, model = run.trace("V_C1"), run.trace("V_C1", model=True)
    if measured is None:
        return None
    found = responses(run, findings.trials, measured)
    if len(found) < 2:
        return None
    expected = [] if model is None else responses(run, findings.trials, model)
    drawn = blank(WIDTH, HEIGHT + 1.0)
    left, bottom, wide, _ = BOX
    upper = axes(drawn, (left, bottom + 1.75, wide, 1.8))
    lower = axes(drawn, (left, bottom, wide, 1.55), share=upper)
    at = np.array([g.frequency for g in found])
    gains = [known_gain(run, g) for g in found]
    look: Any = {"color": palette.V_C1.light, "ms": 5.5, "mew": 0, "zorder": 4}
    upper.errorbar(
        at,
        [g.value for g in gains],
        yerr=[(g.high - g.low) / 2 for g in gains],
        fmt="o",
        elinewidth=0.8,
        capsize=2,
        label="simulated bench" if run.simulated else "measured",
        **look,
    )
    lower.plot(at, [degrees(g.phase) for g in found], "o", **look)
    if expected:
        there = [g.frequency for g in expected]
        look = {"color": palette.TWIN.light, "lw": 1.0, "ls": (0, (4, 2))}
        upper.plot(there, [g.gain for g in expected], label="model", **look)
        lower.plot(there, [degrees(g.phase) for g in expected], **look)
    upper.set_ylim(bottom=0)
    upper.set_ylabel("Gain (V/N)")
    lower.set_ylabel("Phase (°)")
    lower.set_xlabel("Frequency (Hz)")
    upper.set_xscale("log")
    for panel in (upper, lower):
        panel.yaxis.set_label_coords(-0.42 / wide, 0.5)
        panel.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
        panel.xaxis.set_minor_formatter(NullFormatter())
        panel.set_xticks(at, [f"{x:.3g}" for x in at])
        panel.minorticks_off()
    upper.tick_params(axis="x", labelbottom=False)
    upper.legend(
        loc="lower right", frameon=False, fontsize=7.5, labelcolor=palette.INK.light
    )
    return drawn
