"""V_C1 at rest before each trial: whether the sensor drifted during the run."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tactile_lab.report import palette
from tactile_lab.report.canvas import HEAD_HEIGHT, WIDTH, axes, blank, heading
from tactile_lab.report.findings import Findings

HEIGHT = HEAD_HEIGHT + 2.1
CAPTION = (
    "V_C1 just before each trial less that before the first (open circles), and the "
    "same without what the film still remembers of earlier forces (dots): the drift. "
    "Shaded: one code of the channel either side."
)


def drift_figure(findings: Findings) -> Figure | None:
    """The figure; None below two trials that started from rest."""
    judged = [
        (i, t.trial)
        for i, t in enumerate(findings.trials, start=1)
        if t.trial.rest is not None and t.trial.drift is not None
    ]
    if len(judged) < 2:
        return None
    run = findings.run
    number = np.array([i for i, _ in judged])
    rest = np.array([t.rest for _, t in judged], dtype=np.float64)
    change = (rest - rest[0]) * 1e3
    drift = np.array([t.drift for _, t in judged], dtype=np.float64) * 1e3
    drawn = blank(WIDTH, HEIGHT)
    panel = axes(drawn, (0.72, 0.5, WIDTH - 1.02, HEIGHT - 0.5 - HEAD_HEIGHT))
    trace = run.trace("V_C1")
    code = (None if trace is None else trace.code) or 0.0
    panel.axhspan(-code * 1e3, code * 1e3, color=palette.BAND.light, lw=0, zorder=0)
    panel.axhline(0, color=palette.QUIET.light, lw=0.6, zorder=1)
    panel.plot(
        number, change, "o", mfc=palette.PAPER.light, mec=palette.V_C1.light, ms=5.5,
        mew=1.2, zorder=3, label="at rest", clip_on=False,
    )  # fmt: skip
    panel.plot(
        number, drift, "o-", color=palette.V_C1.light, ms=3.5, lw=0.8, mew=0, zorder=4,
        label="drift",
    )  # fmt: skip
    # a band around what there is, not a magnified code
    most = 1.3 * max(float(np.max(np.abs(np.append(change, drift)))), 2e3 * code)
    panel.set_ylim(-(most or 1.0), most or 1.0)
    panel.set_xlim(0.5, len(findings.trials) + 0.5)
    panel.set_ylabel("$V_{C1}$ at rest (mV)")
    panel.set_xlabel("Trial")
    panel.xaxis.set_major_locator(MaxNLocator(integer=True))
    panel.yaxis.set_label_coords(-0.42 / (WIDTH - 1.02), 0.5)
    panel.legend(
        loc="upper left", ncol=2, frameon=False, fontsize=7.5,
        labelcolor=palette.INK.light,
    )  # fmt: skip
    parts = (run.scene, run.run, run.started)
    heading(
        drawn, f"{run.title}: drift at rest", " · ".join(p for p in parts if p),
        simulated=run.simulated,
    )  # fmt: skip
    return drawn
