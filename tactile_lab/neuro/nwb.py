"""Spikes of an array as NWB: a unit for each taxel, with its place."""

from __future__ import annotations

import json
from pathlib import Path

from tactile_lab.skin.events import Events
from tactile_lab.store.export.library import library


def write(events: Events, file: Path) -> None:
    """One NWB file; the skin's TOML, as JSON, is its notes.

    Raises:
        RunFolderError: pynwb is not installed.
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
    session.units = pynwb.misc.Units(
        name="units",
        description="taxels; spike times as computed",
        resolution=float(about["error_s"]),
    )
    session.add_unit_column("taxel", "number of the taxel, from 0")
    session.add_unit_column("x", "place of its centre, m")
    session.add_unit_column("y", "place of its centre, m")
    session.add_unit_column(
        "largest_force", "on it, N; if left out, what the force stays below"
    )
    for taxel, times in enumerate(events.trains()):
        x, y = events.places[taxel].tolist()
        session.add_unit(
            spike_times=times, obs_intervals=[[0.0, events.duration]], taxel=taxel,
            x=x, y=y, largest_force=float(events.largest_force[taxel]),
        )  # fmt: skip
    with pynwb.NWBHDF5IO(str(file), "w") as writer:
        writer.write(session)
