"""Spikes of an array as NWB: a unit for each taxel, with its place.

Without a spike no units, for programs take empty trains for a damaged file: the taxels
are the table `silence` in the module `misc` then.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import h5py

from tactile_lab.skin.events import Events
from tactile_lab.store.export.hdf5 import writing
from tactile_lab.store.export.library import library
from tactile_lab.store.progress import nothing

COLUMNS = {
    "taxel": "number of the taxel, from 0",
    "x": "place of its centre, m",
    "y": "place of its centre, m",
    "largest_force": "on it, N; if left out, what the force stays below",
}


def write(events: Events, file: Path) -> None:
    """One NWB file; the skin's TOML, as JSON, is its notes.

    Raises:
        RunFolderError: pynwb is not installed.
        OSError: the disk did not take all of it.
    """
    pynwb, about = library("pynwb"), events.about
    session = pynwb.NWBFile(
        session_description=f"{about['title']}: an array of spiking tactile sensors, "
        "simulated",
        identifier=str(about["name"]),
        session_id=str(about["name"]),
        session_start_time=events.made,
        experiment_description="computed from the skin in notes",
        notes=json.dumps(about),
        keywords=["tactile sensor", "array", "spikes", "simulated"],
    )
    session.subject = pynwb.file.Subject(
        subject_id=str(about["name"]),
        description="a simulated array of tactile sensors; no animal was involved",
        sex="O",
        age="P0D",
    )
    if len(events.time):
        session.units = _units(pynwb, events)
    else:
        module = session.create_processing_module("misc", "instead of units")
        module.add(_silence(pynwb, events))
    with (
        writing(file, nothing) as (disk, _),
        h5py.File(disk, "w") as out,
        pynwb.NWBHDF5IO(file=out, mode="w") as writer,
    ):
        writer.write(session)


def _units(pynwb: Any, events: Events) -> Any:
    made = pynwb.misc.Units(
        name="units",
        description="taxels; spike times as computed",
        resolution=float(events.about["error_s"]),
    )
    for column, meaning in COLUMNS.items():
        made.add_column(column, meaning)
    for taxel, times in enumerate(events.trains()):
        made.add_unit(
            spike_times=times,
            obs_intervals=[[0.0, events.duration]],
            **_taxel(events, taxel),
        )
    return made


def _silence(pynwb: Any, events: Events) -> Any:
    made = pynwb.core.DynamicTable(
        name="silence", description="taxels; none of them had a spike"
    )
    for column, meaning in COLUMNS.items():
        made.add_column(column, meaning)
    made.add_column("duration", "how long it was silent, from 0 s on, s")
    for taxel in range(len(events.places)):
        made.add_row(duration=events.duration, **_taxel(events, taxel))
    return made


def _taxel(events: Events, taxel: int) -> dict[str, float]:
    x, y = events.places[taxel].tolist()
    force = float(events.largest_force[taxel])
    return {"taxel": taxel, "x": x, "y": y, "largest_force": force}
