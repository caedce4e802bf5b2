"""The decay of a hold with its fit (Fig. 5c), beside Adrian's curves (Fig. 5d left)."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from tactile_lab.analysis.adrian import ADRIAN, MARK
from tactile_lab.analysis.estimate import Estimate
from tactile_lab.analysis.spike_train import within
from tactile_lab.report import palette
from tactile_lab.report.canvas import BOX, HEIGHT, WIDTH, axes, blank
from tactile_lab.report.findings import Findings


def adaptation_figure(findings: Findings) -> Figure | None:
    """Our hold and its fit; None where nothing could be fitted."""
    fitted = [t for t in findings.trials if t.adaptation is not None]
    if not fitted:
        return None
    finding, drawn = fitted[0], blank(WIDTH, HEIGHT)
    wide = (BOX[2] - 0.75) / 2
    ours = axes(drawn, (BOX[0], BOX[1], wide, BOX[3]))
    theirs = axes(drawn, (BOX[0] + wide + 0.75, BOX[1], wide, BOX[3]))
    fit = finding.adaptation
    assert fit is not None
    start, end = fit.hold
    held = within(finding.trial.spike_times, fit.hold)
    ours.plot(
        held[1:] - start,
        1 / np.diff(held),
        "o",
        color=palette.RATE.light,
        ms=2.6,
        mew=0,
    )
    time = np.linspace(start, end, 300)
    look: Any = {"color": palette.INK.light, "lw": 1.0, "ls": (0, (4, 2))}
    ours.plot(time - start, fit.rate(time), **look)
    lines = [
        f"{name} = {value.value:.3g} {unit} ({_interval(value)})"
        for name, value, unit in (
            ("α", fit.alpha, "Hz"),
            ("β", fit.beta, "1/s"),
            ("γ", fit.gamma, "Hz"),
        )
    ]
    ours.annotate(
        "\n".join(lines).replace("-", "−"),
        (1, 1),
        xycoords="axes fraction",
        ha="right",
        va="top",
        size=7.5,
        color=palette.INK.light,
    )
    time = np.linspace(0, 8, 200)
    for curve, colour in zip(ADRIAN, (palette.V_C1, palette.V_C2), strict=True):
        theirs.plot(time, curve.rate(time), color=colour.light, lw=1.2, ls=(0, (4, 2)))
        theirs.annotate(
            curve.stimulus,
            (8, float(curve.rate(8))),
            (0, 4),
            textcoords="offset points",
            ha="right",
            size=7.5,
            color=colour.light,
        )
    theirs.annotate(
        f"Adrian and Zotterman 1926:\n{MARK}",
        (1, 1),
        xycoords="axes fraction",
        ha="right",
        va="top",
        size=7,
        color=palette.QUIET.light,
    )
    for panel, label in ((ours, "Time of the hold (s)"), (theirs, "Time (s)")):
        panel.set_ylim(bottom=0)
        panel.set_xlim(left=0)
        panel.set_ylabel("Rate (Hz)")
        panel.set_xlabel(label)
    return drawn


def _interval(value: Estimate) -> str:
    if value.low == value.high:
        return "at its bound"
    return f"{value.low:.3g} to {value.high:.3g}"
