"""A transfer curve and its subthreshold line (Fig. 1c)."""

from __future__ import annotations

import numpy as np

from tactile_lab.analysis.transfer import Transfer
from tactile_lab.analysis.transfer_file import Curve
from tactile_lab.plot import Guide, Panel, Plot, Series
from tactile_lab.quantity import show


def transfer_plot(curve: Curve, fit: Transfer) -> Plot:
    """Measured points, the fitted line, and where it was fitted."""
    seen = curve.I_DS > 0
    end = min(curve.V_GS.max(), fit.range[1] + 0.3)
    volts = np.linspace(curve.V_GS.min(), end, 50)
    fitted = (
        f"I_S = {show(fit.I_S.value, 'A', 3)} ({show(fit.I_S.low, 'A', 3)} to "
        f"{show(fit.I_S.high, 'A', 3)})",
        f"m = {fit.m.value:.4g} ({fit.m.low:.4g} to {fit.m.high:.4g})",
        f"swing = {fit.swing.value * 1e3:.1f} mV/decade "
        f"({fit.swing.low * 1e3:.1f} to {fit.swing.high * 1e3:.1f})",
    )
    return Plot(
        name="transfer",
        caption="Drain current against V_GS; shaded: where it was fitted.",
        x_label="V_GS",
        x_unit="V",
        panels=(
            Panel(
                label="I_DS",
                unit="A",
                prefix="",
                log=True,
                series=(
                    Series(
                        x=curve.V_GS[seen], y=curve.I_DS[seen], mark="points",
                        colour="I_DS", name="as read",
                    ),
                    Series(
                        x=volts, y=fit.current(volts), colour="V_C1",
                        name="I_S exp(V_GS / m V_T)",
                    ),
                ),
                guides=(Guide(at=fit.range[0], to=fit.range[1], colour="band"),),
                text="\n".join(fitted),
                corner="lower",
            ),
        ),
    )  # fmt: skip
