"""A transfer curve and its subthreshold line (Fig. 1c)."""

from __future__ import annotations

import numpy as np

from tactile_lab.analysis.transfer import Transfer
from tactile_lab.analysis.transfer_file import Curve
from tactile_lab.plot import Guide, Panel, Plot, Series


def transfer_plot(curve: Curve, fit: Transfer) -> Plot:
    """Measured points, the fitted line, and which of them tell it."""
    seen = curve.I_DS > 0
    end = min(curve.V_GS.max(), fit.range[1] + 0.3)
    volts = np.linspace(curve.V_GS.min(), end, 50)
    fitted = (
        f"I_S = {fit.I_S.shown('A')}",
        f"m = {fit.m.text('')}",
        f"swing = {fit.swing.text('mV/decade', 1e3)}",
    )
    return Plot(
        name="transfer",
        caption="Drain current against V_GS; shaded: the points that tell the line.",
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
