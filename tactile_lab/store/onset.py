"""When the force of each trial begins to change: what a latency counts from."""

from __future__ import annotations

import numpy as np

from tactile_lab.scene.scene import Scene
from tactile_lab.stimulus.force import ForceProtocol
from tactile_lab.store.stored_run import Records, StoredRun


def stimulus_onset(scene: Scene) -> float:
    """When a presentation of the scene's protocol begins to change the force, s."""
    if not isinstance(scene.protocol, ForceProtocol):
        return 0.0
    force = next(scene.protocol.presentations()).force
    changed = np.flatnonzero(force.value != force.value[0])
    return float(force.time[changed[0] - 1]) if changed.size else 0.0


def onsets(run: StoredRun, trials: Records) -> list[float | None]:
    """Of each trial, s from its start; None where the force applied stands still.

    A coil that is set over a serial line begins later than asked.

    Args:
        run: that they are of.
        trials: rows of its trials.

    Raises:
        SceneError: the run's scene cannot be read any more.
    """
    asked, found = stimulus_onset(run.scene), []
    for row in trials:
        start, end = float(row["start"]), float(row["end"])
        left = run.force.departure(start + asked, end)
        found.append(None if left is None else left - start)
    return found
