"""A transfer curve and its subthreshold line (Fig. 1c)."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from tactile_lab.analysis.transfer import Transfer
from tactile_lab.analysis.transfer_file import Curve
from tactile_lab.report import palette
from tactile_lab.report.canvas import BOX, HEIGHT, WIDTH, axes, blank, heading


def transfer_figure(curve: Curve, fit: Transfer, name: str) -> Figure:
    """Measured points, the fitted line, and where it was fitted.

    Args:
        curve: as read.
        fit: of it.
        name: what the curve is called, for the second line of the heading.
    """
    drawn = blank(WIDTH, HEIGHT)
    heading(drawn, "Transfer curve", name, simulated=None)
    panel = axes(drawn, BOX)
    panel.set_yscale("log")
    panel.axvspan(*fit.range, color=palette.BAND.light, lw=0, zorder=0)
    seen = curve.I_DS > 0
    panel.plot(
        curve.V_GS[seen], curve.I_DS[seen], "o", color=palette.I_DS.light, ms=3.2,
        mew=0, zorder=3, label="as read",
    )  # fmt: skip
    volts = np.linspace(curve.V_GS.min(), min(curve.V_GS.max(), fit.range[1] + 0.3), 50)
    panel.plot(
        volts, fit.current(volts), color=palette.V_C1.light, lw=1.2, zorder=4,
        label="$I_S$ exp($V_{GS}$/m$V_T$)",
    )  # fmt: skip
    lines = (
        f"$I_S$ = {fit.I_S.value:.3g} A ({fit.I_S.low:.3g} to {fit.I_S.high:.3g})",
        f"m = {fit.m.value:.4g} ({fit.m.low:.4g} to {fit.m.high:.4g})",
        f"swing = {fit.swing.value * 1e3:.1f} mV/decade "
        f"({fit.swing.low * 1e3:.1f} to {fit.swing.high * 1e3:.1f})",
    )
    panel.annotate(
        "\n".join(lines), (0.98, 0.04), xycoords="axes fraction", ha="right",
        va="bottom", size=7.5, color=palette.INK.light,
    )  # fmt: skip
    panel.set_ylabel("$I_{DS}$ (A)")
    panel.set_xlabel("$V_{GS}$ (V); shaded: fitted")
    panel.yaxis.set_label_coords(-0.5 / BOX[2], 0.5)
    panel.legend(
        loc="upper left", frameon=False, fontsize=7.5, labelcolor=palette.INK.light
    )
    return drawn
