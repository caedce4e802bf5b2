"""A MATLAB file: one struct per signal and table."""

from __future__ import annotations

import itertools
import re
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io

from tactile_lab.errors import RunFolderError
from tactile_lab.store.export import packed
from tactile_lab.store.export.content import (
    ExportTable,
    about,
    tables,
    unit,
)
from tactile_lab.store.progress import Progress, nothing
from tactile_lab.store.run import Run
from tactile_lab.store.selection import Selection
from tactile_lab.whole_file import replacing

LARGEST = 2_000_000_000
"""Bytes one variable of a MAT file of version 5 can have."""
LONGEST = 60
"""Characters of a field's name, of 63 that there may be."""
DOUBLE, SINGLE = 8, 4


def size(run: Run, selection: Selection) -> int:
    """Bytes the file will take, at most."""
    signals = selection.rows(run) * (DOUBLE + SINGLE * len(selection.names(run)))
    return signals + packed.listed(run, selection)


def export(
    run: Run,
    file: Path,
    selection: Selection,
    progress: Progress = nothing,
    room: int | None = None,
) -> list[Path]:
    """Write `file`: time (s), and structs of values (single, SI) and unit.

    Tables are structs of their columns, with a struct `units` of the same names.

    Signals are not compressed: that would take a minute.

    `room` bytes must be free for it, as `size` tells unless given.

    Raises:
        RunFolderError: more samples than the format can hold, or a signal, rate or
            time the run does not have.
        RecordingError: there is no room.
        OSError: the file cannot be written.
    """
    selection.check(run)
    room = size(run, selection) if room is None else room
    rows, names = selection.rows(run), selection.names(run)
    if DOUBLE * rows > LARGEST:
        raise RunFolderError(
            f"{rows:.3g} samples per signal are more than a MAT file holds "
            f"({LARGEST // DOUBLE:.3g}). Choose a part with --from and --until, or "
            "--rate."
        )
    with replacing(file, room) as part, part.open("wb") as out:

        def put(name: str, value: Any) -> None:
            # the stubs know no open file
            file: Any = out
            scipy.io.savemat(
                file, {name: value}, oned_as="column", long_field_names=True
            )

        put("info", _fields(about(run, selection)))
        # one signal after another: all of them at once would fill the memory
        for number, name in enumerate(names if rows else ()):
            alone = Selection(
                signals=(name,), start=selection.start, end=selection.end,
                rate=selection.rate,
            )  # fmt: skip
            values = np.empty(rows, np.float32)
            time = np.empty(rows if number == 0 else 0)
            done = 0
            for times, (column,) in alone.pieces(run):
                values[done : done + times.size] = column
                if number == 0:
                    time[done : done + times.size] = times
                done += times.size
                progress((number + done / rows) / len(names))
            if number == 0:
                put("time", time)
                del time
            content = {"values": values, "unit": unit(name)}
            put(name, content)
        for name, table in tables(run, selection).items():
            put(name, _struct(table))
    return [file]


def _fields(told: dict[str, Any]) -> dict[str, Any]:
    """The same by names that MATLAB takes, each once: "a b" and "a_b" would be one."""
    found: dict[str, Any] = {}
    for key, value in told.items():
        name = re.sub(r"\W", "_", key, flags=re.ASCII)[:LONGEST]
        same = (f"{name}_{number}" for number in itertools.count(2))
        found[next(same) if name in found else name] = value
    return found


def _struct(table: ExportTable) -> dict[str, Any]:
    columns: dict[str, Any] = {
        name: values.astype(object) if values.dtype.kind == "U" else values
        for name, values in table.columns.items()
    }
    return columns | {"units": table.units}
