"""Spikes as a Neo block: a train for each taxel, in a NIX file."""

from __future__ import annotations

import io
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py

from tactile_lab.skin.events import Events
from tactile_lab.store.export.hdf5 import writing
from tactile_lab.store.export.library import library
from tactile_lab.store.progress import nothing

_OPENING = threading.Lock()


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
        OSError: the disk did not take all of it.
    """
    nix = library("nixio.file", "nixio")
    neo_block = block(events)
    from neo.io import NixIO

    with writing(file, nothing) as (disk, _):
        with _opening_on(disk, nix):
            opened = NixIO(str(file), "ow")
        with opened:
            opened.write_block(neo_block)


@contextmanager
def _opening_on(disk: io.RawIOBase, nix: Any) -> Iterator[None]:
    """A NIX file that is opened within is on `disk`: nixio itself takes paths alone."""

    def access() -> Any:
        made = own()
        made.set_fileobj_driver(h5py.h5fd.fileobj_driver, disk)
        return made

    with _OPENING:
        own, nix.make_fapl = nix.make_fapl, access
        try:
            yield
        finally:
            nix.make_fapl = own
