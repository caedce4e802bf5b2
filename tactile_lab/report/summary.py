"""A second figure for protocols whose answer is not a trace.

`rate_force` and `threshold_search` give rate against force (Fig. 4d), `repeat` rate
against presentation (Fig. 5d right), `hold` the fitted decay (Fig. 5c), `sine_sweep`
gain and phase, `calibrate_field` both branches of B2(I). Others have none.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tactile_lab.analysis.rate_force import eq15_rate, onset
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.report import palette
from tactile_lab.report.adaptation_figure import adaptation_figure
from tactile_lab.report.canvas import BOX, HEIGHT, WIDTH, axes, blank, heading
from tactile_lab.report.field_figure import field_figure
from tactile_lab.report.findings import Findings
from tactile_lab.report.sweep_figure import sweep_figure
from tactile_lab.report.trial_finding import TrialFinding


def summary(findings: Findings) -> Figure | None:
    """The figure, or None where the protocol needs none or gave nothing to draw."""
    drawn = _DRAWN.get(findings.run.protocol, _nothing)(findings)
    if drawn is not None:
        run = findings.run
        parts = (run.scene, run.run, run.started)
        subtitle = " · ".join(part for part in parts if part)
        heading(drawn, run.title, subtitle, simulated=run.simulated)
    return drawn


def _nothing(findings: Findings) -> None:
    """Most protocols' answer is their traces."""


def _rates(findings: Findings) -> Figure | None:
    levelled = [t for t in findings.trials if t.trial.level is not None]
    if len(levelled) < 2:
        return None
    drawn = blank(WIDTH, HEIGHT)
    panel = axes(drawn, BOX)
    draw = _repeat if findings.run.protocol == "repeat" else _rate_force
    draw(panel, findings, levelled)
    panel.set_ylim(bottom=0)
    panel.set_ylabel("Highest rate (Hz)")
    panel.yaxis.set_label_coords(-0.42 / BOX[2], 0.5)
    return drawn


CAPTIONS = {
    "sine_sweep": "V_C1 against force at each frequency: gain with its 95 % interval, "
    "and phase. Dashed: the model under the same force.",
    "calibrate_field": "Field of the electromagnet against current. Upper: both "
    "branches. Lower: each branch less the straight line of the mean curve.",
    "hold": "Left: instantaneous rate during the hold and the fit α exp(βt) + γ, as in "
    "Fig. 5c. Right: Adrian and Zotterman's adaptation drawn from the coefficients the "
    "paper prints (Fig. 5d, left); these curves are not data.",
    "rate_force": "Highest rate of each step from rest against its force, as in Fig. "
    "4d. Line: Eq. (15) with the current at the end of the ramp; it knows no "
    "adaptation. Grey band: the critical force lies within.",
    "threshold_search": "Highest rate of each trial against its force; open: silent. "
    "Grey band: the critical force lies within.",
    "repeat": "Highest rate from one presentation of the same force to the next, as in "
    "Fig. 5d (right).",
}


def _rate_force(panel: Axes, findings: Findings, trials: list[TrialFinding]) -> None:
    force = np.array([t.trial.level for t in trials], dtype=np.float64)
    rate = np.array([t.response.peak_rate or 0.0 for t in trials])
    fired = np.array([t.response.spikes > 0 for t in trials])
    try:
        found = onset(force.tolist(), [t.response.spikes for t in trials])
        known = findings.run.uncertain(found.middle) or 0.0
        half = float(np.hypot(found.half_width, known))
        panel.axvspan(
            (found.middle - half) * 1e3,
            (found.middle + half) * 1e3,
            color=palette.RULE.light,
            lw=0,
            zorder=0,
        )
    except NotIdentifiableError:
        pass  # nothing to draw; the report's sentence says why
    circuit, hold = findings.run.circuit, trials[0].trial.hold
    if circuit is not None and hold is not None:
        swept = np.linspace(0.9 * force.min(), 1.03 * force.max(), 400)
        expected = [eq15_rate(circuit, float(f), hold[0]) for f in swept]
        panel.plot(
            swept * 1e3,
            expected,
            color=palette.I_DS.light,
            lw=1.0,
            ls=(0, (4, 2)),
            label="Eq. (15)",
        )
    if findings.run.force_uncertainty is not None:
        panel.errorbar(
            force * 1e3,
            rate,
            xerr=findings.run.force_uncertainty.of(force) * 1e3,
            fmt="none",
            ecolor=palette.QUIET.light,
            elinewidth=0.8,
            capsize=2,
            zorder=3,
        )
    panel.plot(
        force[fired] * 1e3,
        rate[fired],
        "o",
        color=palette.RATE.light,
        ms=5.5,
        mew=0,
        zorder=4,
        label="simulated bench" if findings.run.simulated else "measured",
    )
    panel.plot(
        force[~fired] * 1e3,
        rate[~fired],
        "o",
        mfc=palette.PAPER.light,
        mec=palette.RATE.light,
        ms=5.5,
        mew=1.2,
        zorder=4,
        clip_on=False,
        label="silent",
    )
    panel.set_xlabel("Force (mN)")
    panel.legend(
        loc="lower right",
        bbox_to_anchor=(1, 0.04),
        frameon=False,
        fontsize=7.5,
        labelcolor=palette.INK.light,
    )


def _repeat(panel: Axes, findings: Findings, trials: list[TrialFinding]) -> None:
    number = np.arange(1, len(trials) + 1)
    rate = np.array([t.response.peak_rate or 0.0 for t in trials])
    panel.plot(
        number,
        rate,
        "o-",
        color=palette.RATE.light,
        ms=5.5,
        mew=0,
        lw=0.8,
        clip_on=False,
    )
    for x, y, finding in zip(number, rate, trials, strict=True):
        panel.annotate(
            f"{finding.response.spikes}",
            (x, y),
            (0, 6),
            textcoords="offset points",
            ha="center",
            size=7,
            color=palette.QUIET.light,
        )
    panel.set_ylim(top=max(rate.max() * 1.15, 1.0))
    panel.set_xlabel("Presentation (numbers: spikes)")
    panel.xaxis.set_major_locator(MaxNLocator(integer=True))


_DRAWN: dict[str, Callable[[Findings], Figure | None]] = {
    "calibrate_field": field_figure,
    "hold": adaptation_figure,
    "rate_force": _rates,
    "repeat": _rates,
    "sine_sweep": sweep_figure,
    "threshold_search": _rates,
}
