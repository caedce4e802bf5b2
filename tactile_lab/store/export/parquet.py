"""Parquet files: one for the signals, one per table, with units in the schema."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

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

DOUBLE, SINGLE = 8, 4


def size(run: Run, selection: Selection) -> int:
    """Bytes the file of signals will take, at most: compression makes less of most."""
    return selection.rows(run) * (DOUBLE + SINGLE * len(selection.names(run)))


def export(
    run: Run, folder: Path, selection: Selection, progress: Progress = nothing
) -> list[Path]:
    """Write `signals.parquet`, `spikes.parquet`, `trials.parquet`, ... into `folder`.

    Signals are single precision, times double. Every column names its unit in the
    field's metadata; the schema of each file says what the run is; pandas finds both
    in `attrs`. Files of these
    names that an earlier export left there are replaced or removed.

    Raises:
        RunFolderError: pyarrow is not installed, or a signal, rate or time the run
            does not have.
        RecordingError: there is no room.
        OSError: the folder cannot be written.
    """
    pa = library("pyarrow")
    parquet = library("pyarrow.parquet", "pyarrow")
    selection.check(run)
    rows, names = selection.rows(run), selection.names(run)
    told = {key: str(value) for key, value in about(run, selection).items()}

    def schema(columns: dict[str, Any], units: dict[str, str]) -> Any:
        fields = [
            pa.field(n, kind, metadata={"unit": units[n]})
            for n, kind in columns.items()
        ]
        # what pandas reads into `attrs`; it passes over the metadata of fields
        attrs = json.dumps({"units": units, "about": told})
        return pa.schema(fields, metadata=told | {"PANDAS_ATTRS": attrs})

    made = []
    if rows:
        made.append(folder / "signals.parquet")
        kinds = {"time": pa.float64()} | dict.fromkeys(names, pa.float32())
        shape = schema(kinds, {"time": "s"} | {name: unit(name) for name in names})
        done = 0
        with (
            replacing(made[-1], size(run, selection)) as part,
            parquet.ParquetWriter(part, shape, compression="zstd") as writer,
        ):
            for time, values in selection.pieces(run):
                single = [column.astype(np.float32) for column in values]
                writer.write_table(pa.table([time, *single], schema=shape))
                done += time.size
                progress(done / rows)
    for name, table in tables(run, selection).items():
        made.append(folder / f"{name}.parquet")
        arrays = {n: pa.array(values) for n, values in table.columns.items()}
        shape = schema({n: a.type for n, a in arrays.items()}, table.units)
        with replacing(made[-1], 0) as part:
            whole = pa.table(list(arrays.values()), schema=shape)
            parquet.write_table(whole, part)
    for name in {"signals", *TABLES} - {file.stem for file in made}:
        (folder / f"{name}.parquet").unlink(missing_ok=True)
    return made
