"""The spikes of one run as those of an array with a single taxel."""

from __future__ import annotations

from typing import Any

import numpy as np

from tactile_lab.errors import RunFolderError
from tactile_lab.skin.events import Events
from tactile_lab.store.derived import derivable
from tactile_lab.store.export.content import about, changes, tables
from tactile_lab.store.run import Run
from tactile_lab.store.selection import Selection


def events_of(run: Run, selection: Selection | None = None) -> Events:
    """Spikes of a measured or simulated run, its force and trials in `about`.

    Args:
        run: its times stay those of the run's axis.
        selection: only the spikes and the force of this part.

    Raises:
        RunFolderError: no spikes were detected in it.
    """
    selection = selection or Selection()
    if run.detection is None:
        raise RunFolderError(
            f'{run.path} has no spikes: none were detected. Add "spikes" to '
            "record.signals, or export its signals, such as with --to csv."
        )
    time = selection.of(run.spikes)["time"].astype(np.float64)
    trials = tables(run, selection).get("trials")
    told: dict[str, Any] = {
        key: value for key, value in about(run).items() if key != "scene.toml"
    }
    told["part_s"] = selection.ends(run)
    told |= {"name": run.name, "signal": run.detection.signal}
    told.setdefault("title", str(told["name"]))
    told["trials"] = []
    if trials is not None:
        columns = (trials.columns[n].tolist() for n in ("label", "start", "end"))
        told["trials"] = list(zip(*columns, strict=True))
    most = np.nan
    if "force" in derivable(run):
        time_of_force = changes(run, "force", selection)
        told["force"] = time_of_force, run.force.at(time_of_force)
        most = float(np.max(told["force"][1]))
    return Events(
        time=time,
        taxel=np.zeros(time.size, np.int32),
        places=np.zeros((1, 2)),
        count=np.array([time.size]),
        role=np.zeros(1, np.uint8),
        largest_force=np.array([most]),
        about=told,
    )
