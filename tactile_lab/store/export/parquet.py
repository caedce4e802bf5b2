"""Parquet files: one for the signals, one per table, with units in the schema."""

from __future__ import annotations

import json
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from tactile_lab.store.export import packed
from tactile_lab.store.export.content import (
    TABLES,
    about,
    tables,
    unit,
)
from tactile_lab.store.export.library import library
from tactile_lab.store.progress import Progress, nothing
from tactile_lab.store.run import Run
from tactile_lab.store.selection import Selection
from tactile_lab.whole_file import replacing

TOLD = 6
"""So often a file holds what is told of the run: for each kind of reader, encoded."""


def size(run: Run, selection: Selection) -> int:
    """Bytes the files will take, rather fewer, as stretches of the signals tell."""

    def pack(probe: Selection) -> int:
        memory = BytesIO()
        _signals(memory, run, probe, {}, nothing)
        return memory.tell()

    found = tables(run, selection)
    files = TOLD * packed.told(run, selection) * (1 + len(found))
    return files + packed.signals(run, selection, pack) + packed.listed(run, selection)


def export(
    run: Run,
    folder: Path,
    selection: Selection,
    progress: Progress = nothing,
    room: int | None = None,
) -> list[Path]:
    """Write `signals.parquet`, `spikes.parquet`, `trials.parquet`, ... into `folder`.

    Signals are single precision, times double. Every column names its unit in the
    field's metadata; the schema of each file says what the run is; pandas finds both
    in `attrs`. Files of these
    names that an earlier export left there are replaced or removed.

    `room` bytes must be free for it, as `size` tells unless given.

    Raises:
        RunFolderError: pyarrow is not installed, or a signal, rate or time the run
            does not have.
        RecordingError: there is no room.
        OSError: the folder cannot be written.
    """
    pa = library("pyarrow")
    parquet = library("pyarrow.parquet", "pyarrow")
    selection.check(run)
    told = {key: str(value) for key, value in about(run, selection).items()}
    made = []
    if selection.rows(run):
        made.append(folder / "signals.parquet")
        room = size(run, selection) if room is None else room
        with replacing(made[-1], room) as part:
            _signals(part, run, selection, told, progress)
    for name, table in tables(run, selection).items():
        made.append(folder / f"{name}.parquet")
        arrays = {n: pa.array(values) for n, values in table.columns.items()}
        shape = _schema({n: a.type for n, a in arrays.items()}, table.units, told)
        with replacing(made[-1], 0) as part:
            whole = pa.table(list(arrays.values()), schema=shape)
            parquet.write_table(whole, part)
    for name in {"signals", *TABLES} - {file.stem for file in made}:
        (folder / f"{name}.parquet").unlink(missing_ok=True)
    return made


def _signals(
    to: Path | BytesIO,
    run: Run,
    selection: Selection,
    told: dict[str, str],
    progress: Progress,
) -> None:
    pa = library("pyarrow")
    parquet = library("pyarrow.parquet", "pyarrow")
    rows, names = selection.rows(run), selection.names(run)
    kinds = {"time": pa.float64()} | dict.fromkeys(names, pa.float32())
    units = {"time": "s"} | {name: unit(name) for name in names}
    schema, done = _schema(kinds, units, told), 0
    with parquet.ParquetWriter(to, schema, compression="zstd") as writer:
        for time, values in selection.pieces(run):
            single = [column.astype(np.float32) for column in values]
            writer.write_table(pa.table([time, *single], schema=schema))
            done += time.size
            progress(done / rows)


def _schema(kinds: dict[str, Any], units: dict[str, str], told: dict[str, str]) -> Any:
    pa = library("pyarrow")
    fields = [
        pa.field(n, kind, metadata={"unit": units[n]}) for n, kind in kinds.items()
    ]
    # what pandas reads into `attrs`; it passes over the metadata of fields
    attrs = json.dumps({"units": units, "about": told})
    return pa.schema(fields, metadata=told | {"PANDAS_ATTRS": attrs})
