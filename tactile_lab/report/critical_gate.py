"""The V_GS that explains a critical force."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tactile_lab.analysis.operating_point import V_GS_of_onset
from tactile_lab.analysis.rate_force import Onset
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.quantity import show
from tactile_lab.report.conclusion import Conclusion
from tactile_lab.report.run_data import RunData, TrialData
from tactile_lab.report.trial_finding import TrialFinding
from tactile_lab.waveform import Waveform


def critical_gate(
    run: RunData, trials: Sequence[TrialFinding], found: Onset, force_error: float
) -> Conclusion:
    """V_GS from the applied force of the two trials that bracket the onset."""
    if run.circuit is None:
        return Conclusion()
    silent, fires = (
        _applied(run, next(t.trial for t in trials if t.trial.level == level))
        for level in (found.silent, found.fires)
    )
    try:
        low, high = V_GS_of_onset(run.circuit, silent, fires, force_error)
    except NotIdentifiableError as reason:
        return Conclusion((f"No V_GS explains the critical force: {reason}.",))
    said = (
        f"By the model, a V_GS of {show((low + high) / 2, 'V', 5)} "
        f"({show(low, 'V', 5)} to {show(high, 'V', 5)}) explains it; "
        f"{show(run.circuit.V_GS, 'V', 5)} is believed."
    )
    return Conclusion((said,), {"V_GS_low_V": low, "V_GS_high_V": high})


def _applied(run: RunData, trial: TrialData) -> Waveform:
    """The force of one trial as it was applied, N against s from its start."""
    start, end = trial.start, trial.start + trial.duration
    time, value = run.force.time, run.force.value
    inside = (time > start) & (time < end)
    return Waveform(
        np.concatenate([[0.0], time[inside] - start, [trial.duration]]),
        np.concatenate([[run.force.at(start)], value[inside], [run.force.at(end)]]),
    )
