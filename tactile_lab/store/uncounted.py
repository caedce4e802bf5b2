"""Of which trials the spikes are no count, and why: no rate is told of them."""

from __future__ import annotations

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import SceneError
from tactile_lab.measurement import BETWEEN_SAMPLES, CUT_OFF, TOO_FAST
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.equations import shortest_interval
from tactile_lab.scene.scene import Scene
from tactile_lab.spikes.false import are_false
from tactile_lab.store.overrange import unsearched
from tactile_lab.store.stored_run import StoredRun


def uncounted(run: StoredRun) -> list[str]:
    """Why the spikes of each trial are no count; "" where they are one."""
    blind, spikes, scene = unsearched(run), run.spikes["time"], _scene(run)
    elsewhere = "" if samples_catch_spikes(run) else BETWEEN_SAMPLES
    found = []
    for row in run.trials:
        start, end = row["start"], row["end"]
        seen = spikes[(spikes >= start) & (spikes < end)]
        if np.any((blind[:, 0] < end) & (blind[:, 1] > start)):
            found.append(CUT_OFF)
        elif scene is not None and faster_than(scene.circuit, seen):
            found.append(TOO_FAST)
        else:
            found.append(elsewhere)
    return found


def faster_than(circuit: Circuit, spike_times: FloatArray) -> bool:
    """Whether spikes, s, shape (n,), come faster than `circuit` can fire."""
    short = np.count_nonzero(np.diff(spike_times) < shortest_interval(circuit))
    return are_false(int(short), spike_times.size)


def samples_catch_spikes(run: StoredRun) -> bool:
    """Whether no spike of the believed circuit fits between two samples of V_K.

    Nothing is said against a run whose scene cannot be read any more.
    """
    detection = run.info.get("detection") or {}
    if detection.get("signal") != "V_K":
        return True
    scene = _scene(run)
    return scene is None or scene.shows_spikes(
        detection["threshold_V"], run.info["sample_rate_Hz"]
    )


def _scene(run: StoredRun) -> Scene | None:
    """The run's scene; None where it cannot be read."""
    try:
        return run.scene
    except SceneError:
        return None
