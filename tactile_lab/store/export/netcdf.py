"""netCDF-4 by the CF conventions: what `xarray.open_dataset` reads at once."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from tactile_lab.signals import SIGNALS
from tactile_lab.store.export import packed
from tactile_lab.store.export.content import (
    about,
    tables,
    unit,
)
from tactile_lab.store.export.hdf5 import writing
from tactile_lab.store.export.library import library
from tactile_lab.store.progress import Progress, nothing
from tactile_lab.store.run import Run
from tactile_lab.store.selection import Selection
from tactile_lab.whole_file import replacing

PACKED = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
CHUNK = 1 << 18


def size(run: Run, selection: Selection) -> int:
    """Bytes the file will take, rather fewer, as stretches of it tell."""
    h5netcdf = library("h5netcdf")

    def pack(probe: Selection) -> int:
        memory = BytesIO()
        with h5netcdf.File(memory, "w") as out:
            _signals(out, run, probe, nothing)
        return memory.getbuffer().nbytes

    return packed.signals(run, selection, pack) + packed.listed(run, selection)


def export(
    run: Run,
    file: Path,
    selection: Selection,
    progress: Progress = nothing,
    room: int | None = None,
) -> list[Path]:
    """Write `file`: signals against the coordinate time, a group per table.

    Stored signals are codes with `scale_factor` and `add_offset`, unless averaged.

    `room` bytes must be free for it, as `size` tells unless given.

    Raises:
        RunFolderError: h5netcdf is not installed, or a signal, rate or time the run
            does not have.
        RecordingError: there is no room.
        OSError: the file cannot be written.
    """
    h5netcdf = library("h5netcdf")
    selection.check(run)
    room = size(run, selection) if room is None else room
    with (
        replacing(file, room) as part,
        writing(part, progress) as (disk, told),
        h5netcdf.File(disk, "w") as out,
    ):
        out.attrs["Conventions"] = "CF-1.11"
        out.attrs.update(about(run, selection))
        if selection.rows(run):
            _signals(out, run, selection, told)
        for name, table in tables(run, selection).items():
            group = out.create_group(name)
            group.dimensions = {"row": len(table)}
            for column, values in table.columns.items():
                text = values.dtype.kind == "U"
                kind = h5py.string_dtype() if text else values.dtype
                made = group.create_variable(column, ("row",), kind)
                made[:] = values.astype(object) if text else values
                if table.units[column]:
                    made.attrs["units"] = table.units[column]
    return [file]


def _signals(out: Any, run: Run, selection: Selection, progress: Progress) -> None:
    rows, names = selection.rows(run), selection.names(run)
    coded = {n for n in names if n in run.signals and selection.rate is None}
    out.dimensions = {"time": rows}
    chunks = (min(rows, CHUNK),)
    time = out.create_variable("time", ("time",), np.float64, chunks=chunks, **PACKED)
    time.attrs.update(units="s", long_name="time from the first sample of the run")
    columns = {}
    for name in names:
        kind = run.signal(name).codes.dtype if name in coded else np.dtype(np.float32)
        made = out.create_variable(name, ("time",), kind, chunks=chunks, **PACKED)
        title = SIGNALS[name].title if name in SIGNALS else name
        made.attrs.update(units=unit(name), long_name=title)
        if name in coded:
            signal = run.signal(name)
            made.attrs.update(scale_factor=signal.gain, add_offset=signal.offset)
        columns[name] = made
    done = 0
    for times, values in selection.pieces(run):
        here = slice(done, done + times.size)
        time[here] = times
        for name, column in zip(names, values, strict=True):
            if name in coded:
                signal = run.signal(name)
                column = np.rint((column - signal.offset) / signal.gain)
            columns[name][here] = column.astype(columns[name].dtype)
        done += times.size
        progress(done / rows)
