"""V_C1 at rest before each trial: whether the sensor drifted during the run."""

from __future__ import annotations

import numpy as np

from tactile_lab.measurement import MeasuredTrial, Measurement
from tactile_lab.plot import Guide, Panel, Plot, Series
from tactile_lab.quantity import show


def drift_plot(run: Measurement) -> Plot | None:
    """Rest and drift against the trial; None below two that started from rest."""
    judged = [(i, t, d) for i, t in enumerate(run.results, 1) for d in _drift(t)]
    if len(judged) < 2:
        return None
    number = [i for i, _, _ in judged]
    rest = np.array([t.rest for _, t, _ in judged], dtype=np.float64)
    change, drift = rest - rest[0], np.array([d for _, _, d in judged])
    trace = run.trace("V_C1")
    code = (None if trace is None else trace.code) or 0.0
    # a band around what there is, not a magnified code
    most = 1.3 * max(float(np.max(np.abs(np.append(change, drift)))), 2 * code) or 1e-3
    return Plot(
        name="drift",
        title="drift at rest",
        caption="V_C1 just before each trial less that before the first (open "
        "circles), and the same without what the film still remembers of earlier "
        "forces (dots): the drift. Shaded: one code of the channel either side.",
        x_label="Trial",
        whole=True,
        x_limits=(0.5, len(run.results) + 0.5),
        panels=(
            Panel(
                label="V_C1 at rest",
                unit="V",
                series=(
                    Series(
                        x=number, y=change, name="at rest", mark="open", colour="V_C1"
                    ),
                    Series(
                        x=number, y=drift, name="drift", mark="joined", colour="V_C1"
                    ),
                ),
                guides=(
                    Guide(at=-code, to=code, along="x", colour="band"),
                    Guide(at=0.0, along="x", dashed=False),
                ),
                limits=(-most, most),
                height=1.6,
            ),
        ),
    )


def drift_sentence(run: Measurement) -> str:
    """How far V_C1 rested apart; "" below two trials that started from rest."""
    judged = [(t.rest, d) for t in run.results for d in _drift(t)]
    rest = [r for r, _ in judged if r is not None]
    if len(judged) < 2:
        return ""
    most = max((d for _, d in judged), key=abs)
    low, high = (show(volts, "V") for volts in (min(rest), max(rest)))
    rested = f"at {low}" if low == high else f"between {low} and {high}"
    return (
        f"V_C1 rested {rested}. Less what the film remembers of earlier forces it "
        f"drifted by {show(most, 'V', 2)} at most."
    )


def _drift(trial: MeasuredTrial) -> list[float]:
    """Its drift, V, where it and the rest were judged."""
    return [] if trial.rest is None or trial.drift is None else [trial.drift]
