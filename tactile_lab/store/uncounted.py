"""Of which trials not all spikes are counted, and why: no rate is told of them."""

from __future__ import annotations

import numpy as np

from tactile_lab.errors import SceneError
from tactile_lab.measurement import BETWEEN_SAMPLES, CUT_OFF
from tactile_lab.store.overrange import unsearched
from tactile_lab.store.stored_run import StoredRun


def uncounted(run: StoredRun) -> list[str]:
    """Why the spikes of each trial are not all counted; "" where they are."""
    blind = unsearched(run)
    elsewhere = "" if samples_catch_spikes(run) else BETWEEN_SAMPLES
    return [
        CUT_OFF
        if np.any((blind[:, 0] < row["end"]) & (blind[:, 1] > row["start"]))
        else elsewhere
        for row in run.trials
    ]


def samples_catch_spikes(run: StoredRun) -> bool:
    """Whether no spike of the believed circuit fits between two samples of V_K.

    Nothing is said against a run whose scene cannot be read any more.
    """
    detection = run.info.get("detection") or {}
    if detection.get("signal") != "V_K":
        return True
    try:
        circuit = run.scene.circuit
    except SceneError:
        return True
    return circuit.shows_spikes(detection["threshold_V"], run.info["sample_rate_Hz"])
