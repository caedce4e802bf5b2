"""What a report says of the current that drove the sensor."""

from __future__ import annotations

import numpy as np

from tactile_lab.analysis.estimate import Estimate, Line
from tactile_lab.quantity import show
from tactile_lab.store.applied import BEFORE, ENOUGH, VISIBLE, AppliedCurrent
from tactile_lab.store.run import Run
from tactile_lab.store.shunt import Shunt

LEVEL = 0.2
"""Levels that last so long are averaged over the shunt, s."""
SETTLING = 0.02
"""Beginning of a level that is left out of the average: the coil's lag, s."""


def told(run: Run) -> tuple[str, ...]:
    """Where the coil current came from, and whether shunt and source agree."""
    applied, shunt = run.applied, run.shunt
    steps = len(applied.steps)
    if steps < 2:
        return ()
    if shunt is None and played(run):
        return (
            "coil current: as asked for while a list or the generator played, which "
            "nothing measured: a source that gives another current shows in no number "
            "here but through the sensor. Record coil_current to see it",
        )
    said = (
        f"coil current: levels as the source read them back, {applied.edges} of "
        f"{steps - 1} steps timed by the shunt"
    )
    if applied.lead and applied.edges < steps - 1:
        said += f", the others moved alike ({show(applied.lead, 's', 2)} earlier)"
    ratio = None if shunt is None else shunt_over_source(applied, shunt)
    if ratio is not None:
        said += (
            f"; averaged over each level the shunt reads {ratio.text('', level='')} "
            "of the source"
        )
    return (said,)


def undated(run: Run) -> tuple[str, ...]:
    """That the shunt hides steps it should show; empty where it shows enough."""
    applied, least = run.applied, run.visible_step
    large = int(np.sum(np.abs(np.diff(applied.steps[:, 1])) >= least))
    if run.shunt is None or played(run) or len(run.overrange("coil_current")):
        return ()  # which is told elsewhere
    if large < ENOUGH or applied.edges >= ENOUGH:
        return ()
    return (
        f"The shunt shows {applied.edges} of {large} steps of the coil current that "
        f"are {show(least, 'A')} or more: hum or noise as large hides the others, and "
        "it dates nothing. Latencies, and times beside the model, are known as the "
        "host dates set-points. `tactile-lab run wiring_check` measures hum; shield "
        "or filter the shunt's lead.",
    )


def played(run: Run) -> bool:
    """Whether the current was played as a waveform, not set point by point."""
    rows = run.current  # older runs lack the column
    return "listed" in (rows.dtype.names or ()) and bool(rows["listed"].any())


def shunt_over_source(applied: AppliedCurrent, shunt: Shunt) -> Estimate | None:
    """Slope of the averaged shunt over the read-back; an offset is allowed for.

    None where fewer than 3 levels were held long enough, or all were alike.
    """
    begin, level = applied.steps.T
    seen = []
    for i in np.flatnonzero(applied.ends - begin >= LEVEL):
        _, value = shunt(float(begin[i]) + SETTLING, float(applied.ends[i]) - BEFORE)
        if value.size:
            seen.append((level[i], float(value.mean())))
    if len(seen) < 3:
        return None
    source, mean = np.array(seen).T
    if np.sum((source - source.mean()) ** 2) < VISIBLE**2:
        return None
    return Line.through(source, mean).slope
