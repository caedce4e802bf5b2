"""What a report says of the current that drove the sensor."""

from __future__ import annotations

from tactile_lab.analysis.shunt_check import shunt_over_source
from tactile_lab.quantity import show
from tactile_lab.store.run import Run


def told(run: Run) -> tuple[str, ...]:
    """Where the coil current came from, and whether shunt and source agree."""
    applied, shunt = run.applied, run.shunt
    steps = len(applied.steps)
    if steps < 2:
        return ()
    said = (
        f"coil current: levels as the source read them back, {applied.edges} of "
        f"{steps - 1} steps timed by the shunt"
    )
    if applied.lead and applied.edges < steps - 1:
        said += f", the others moved alike ({show(applied.lead, 's', 2)} earlier)"
    ratio = None if shunt is None else shunt_over_source(applied, shunt)
    if ratio is not None:
        said += (
            f"; averaged over each level the shunt reads {ratio.value:.4g} "
            f"({ratio.low:.4g} to {ratio.high:.4g}) of the source"
        )
    return (said,)
