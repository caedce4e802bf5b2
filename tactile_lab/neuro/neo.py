"""Spikes as a Neo block: a train for each taxel, in a NIX file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tactile_lab.skin.events import Events
from tactile_lab.store.export.library import library


def block(events: Events) -> Any:
    """A `neo.Block` of one segment: trains, and of a run its force and trials.

    Trains are annotated with `taxel`, `x_m` and `y_m`; silent ones are empty.

    Raises:
        RunFolderError: neo is not installed.
    """
    neo = library("neo")
    about = events.about
    made = neo.Block(name=str(about["name"]), description=str(about["title"]))
    made.annotate(physics=str(about.get("physics", "simulated")))
    segment = neo.Segment(name=made.name, index=0)
    made.segments.append(segment)
    start, stop = about.get("part_s", (0.0, events.duration))
    for taxel, times in enumerate(events.trains()):
        x, y = events.places[taxel].tolist()
        segment.spiketrains.append(
            neo.SpikeTrain(
                times, units="s", t_start=start, t_stop=stop,
                name=f"taxel {taxel}", taxel=taxel, x_m=x, y_m=y,
            )
        )  # fmt: skip
    if "force" in about:
        time, value = about["force"]
        segment.irregularlysampledsignals.append(
            neo.IrregularlySampledSignal(
                time, value, units="N", time_units="s", name="force"
            )
        )
    if about.get("trials"):
        labels, starts, ends = zip(*about["trials"], strict=True)
        durations = [end - start for start, end in zip(starts, ends, strict=True)]
        segment.epochs.append(
            neo.Epoch(starts, durations, labels, units="s", name="trials")
        )
    return made


def write(events: Events, file: Path) -> None:
    """The block as a NIX file, which ``neo.io.NixIO`` reads.

    Raises:
        RunFolderError: neo or nixio is not installed.
    """
    library("nixio")
    neo_block = block(events)
    from neo.io import NixIO

    with NixIO(str(file), "ow") as opened:
        opened.write_block(neo_block)
