"""The figure of a field calibration: both branches of B2(I)."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from tactile_lab.analysis.field_calibration import fit_field
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.report import palette
from tactile_lab.report.bench_conclusions import field_steps
from tactile_lab.report.canvas import BOX, HEIGHT, WIDTH, axes, blank
from tactile_lab.report.findings import Findings


def field_figure(findings: Findings) -> Figure | None:
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
    return drawn
