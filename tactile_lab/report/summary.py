"""A second figure for protocols whose answer is not a trace: rate against something.

`rate_force` and `threshold_search` give rate against force (Fig. 4d), `repeat` gives
rate against presentation (Fig. 5d right). Others have none.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tactile_lab.analysis.adrian import ADRIAN, MARK
from tactile_lab.analysis.field_calibration import fit_field
from tactile_lab.analysis.rate_force import eq15_rate, onset
from tactile_lab.analysis.spike_train import within
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.report import palette
from tactile_lab.report.bench_conclusions import field_steps
from tactile_lab.report.canvas import HEAD_HEIGHT, axes, blank, heading
from tactile_lab.report.findings import Findings
from tactile_lab.report.trial_finding import TrialFinding

WIDTH, HEIGHT = 7.2, 3.7
BOX = (0.72, 0.5, WIDTH - 1.02, HEIGHT - 0.5 - HEAD_HEIGHT)


def summary(findings: Findings) -> Figure | None:
    """The figure, or None where the protocol needs none or gave nothing to draw."""
    run = findings.run
    levelled = [t for t in findings.trials if t.trial.level is not None]
    fitted = [t for t in levelled if t.adaptation is not None]
    few = not fitted if run.protocol == "hold" else len(levelled) < 2
    if run.protocol == "calibrate_field":
        return _field(findings)
    if run.protocol not in CAPTIONS or few:
        return None
    drawn = blank(WIDTH, HEIGHT)
    if run.protocol == "hold":
        _adaptation(drawn, fitted[0])
    else:
        panel = axes(drawn, BOX)
        draw = _repeat if run.protocol == "repeat" else _rate_force
        draw(panel, findings, levelled)
        panel.set_ylim(bottom=0)
        panel.set_ylabel("Highest rate (Hz)")
        panel.yaxis.set_label_coords(-0.42 / BOX[2], 0.5)
    subtitle = " · ".join(part for part in (run.scene, run.run, run.started) if part)
    heading(drawn, run.title, subtitle, simulated=run.simulated)
    return drawn


CAPTIONS = {
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
        loc="upper left", frameon=False, fontsize=7.5, labelcolor=palette.INK.light
    )


def _field(findings: Findings) -> Figure | None:
    """Both branches of B2(I), and what the straight line leaves of them."""
    run = findings.run
    try:
        steps = field_steps(run, [t.trial for t in findings.trials])
        fit = fit_field(steps)
    except NotIdentifiableError:
        return None  # the report's sentence says why
    drawn = blank(WIDTH, HEIGHT + 1.4)
    left, bottom, wide, high = BOX
    upper = axes(drawn, (left, bottom + 1.6, wide, high - 0.2))
    lower = axes(drawn, (left, bottom, wide, 1.35), share=upper)
    for branch, colour, marker in (
        ("rising", palette.V_C1, "^"),
        ("falling", palette.FORCE, "v"),
    ):
        here = [s for s in steps if s.branch == branch]
        current = np.array([s.current for s in here])
        field = np.array([s.field for s in here]) * 1e3
        line = (fit.slope.value * current + fit.offset.value) * 1e3
        look: Any = {"color": colour.light, "ms": 4, "mew": 0, "lw": 0.8}
        upper.plot(current, field, marker=marker, label=branch, **look)
        lower.plot(current, field - line, marker=marker, **look)
    upper.legend(
        loc="upper left", frameon=False, fontsize=7.5, labelcolor=palette.INK.light
    )
    upper.tick_params(axis="x", labelbottom=False)
    upper.set_ylabel("B2 (mT)")
    lower.set_ylabel("Less line (mT)")
    lower.set_xlabel("Coil current (A)")
    for panel in (upper, lower):
        panel.yaxis.set_label_coords(-0.45 / wide, 0.5)
    subtitle = " · ".join(part for part in (run.scene, run.run, run.started) if part)
    heading(drawn, run.title, subtitle, simulated=run.simulated)
    return drawn


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


def _adaptation(drawn: Figure, finding: TrialFinding) -> None:
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
        f"{name} = {value.value:.3g} {unit} ({value.low:.3g} to {value.high:.3g})"
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
