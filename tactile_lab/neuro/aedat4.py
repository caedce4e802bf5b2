"""Spikes as AEDAT4, the files of event cameras, through dv-processing."""

from __future__ import annotations

from pathlib import Path

from tactile_lab.errors import ParameterError
from tactile_lab.neuro.tonic import pixels, whole_us
from tactile_lab.skin.events import Events
from tactile_lab.store.export.library import library

ENDING = ".aedat4"
PIECE = 1 << 16
"""Spikes in one packet."""


def write(events: Events, file: Path) -> None:
    """A camera's file: a pixel is a taxel, counted from the top left; whole us.

    Raises:
        RunFolderError: dv-processing is not installed.
        ParameterError: more columns or rows than pixels have numbers, or the file has
            another ending.
        OSError: it cannot be written.
    """
    if file.suffix != ENDING:  # else the library ends the whole program
        raise ParameterError(
            f"AEDAT4 goes into a file that ends in {ENDING}; let --out end so."
        )
    file.touch()  # the library's own words are a page of C++
    dv = library("dv_processing", "dv-processing")
    place = pixels(events)
    width, height = (int(most) + 1 for most in place.max(axis=0))
    only = dv.io.MonoCameraWriter.EventOnlyConfig("TACTILE_LAB", (width, height))
    writer = dv.io.MonoCameraWriter(str(file), only)
    for first in range(0, events.time.shape[0], PIECE):
        time = whole_us(events.time[first : first + PIECE]).tolist()
        x, y = place[events.taxel[first : first + PIECE]].T.tolist()
        packet = dv.EventStore()
        for t, column, row in zip(time, x, y, strict=True):
            packet.push_back(t, column, row, True)
        writer.writeEvents(packet)
    del writer  # it ends the file
