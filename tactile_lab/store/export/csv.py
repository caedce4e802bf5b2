"""CSV files in SI, units in the header: one for the signals, one per table."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactile_lab.store.run import Run
from tactile_lab.store.selection import Selection

UNITS = {
    "gaps": {"start": "s", "end": "s"},
    "spikes": {"time": "s", "amplitude": "V", "width": "s"},
    "current": {"time": "s", "setpoint": "A", "measured": "A"},
    "field": {"time": "s", "field": "T"},
}
"""Exported columns of each table."""

Columns = Sequence[NDArray[np.float64]]


def export(run: Run, folder: Path, selection: Selection) -> list[Path]:
    """Write `signals.csv`, `spikes.csv`, `gaps.csv`, ... into `folder`.

    Files of these names that an earlier export left there are replaced or removed.

    Raises:
        RunFolderError: a signal, rate or time the run does not have.
        OSError: the folder cannot be written.
    """
    selection.check(run)
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    names = selection.names(run)
    if names:
        heads = ["time_s", *(f"{name}_{run.signal(name).unit}" for name in names)]
        pieces = ((times, *columns) for times, columns in selection.pieces(run))
        written.append(_write(folder / "signals.csv", heads, pieces))
    for name, units in UNITS.items():
        rows = selection.rows(getattr(run, name))
        if rows.size:
            heads = [f"{column}_{unit}" for column, unit in units.items()]
            columns = [rows[column] for column in units]
            written.append(_write(folder / f"{name}.csv", heads, [columns]))
    trials = run.trials
    if trials.size:
        written.append(folder / "trials.csv")
        with written[-1].open("w", encoding="utf-8", newline="\n") as file:
            file.write("index,label,level_N,start_s,end_s,spikes\n")
            for row in trials:
                label = row["label"].decode().replace('"', '""')
                file.write(
                    f'{row["index"]},"{label}",{row["level"]:.12g},'
                    f"{row['start']:.12g},{row['end']:.12g},{row['spikes']}\n"
                )
    for name in {"signals", *UNITS, "trials"} - {file.stem for file in written}:
        (folder / f"{name}.csv").unlink(missing_ok=True)
    return written


def _write(path: Path, heads: Sequence[str], pieces: Iterable[Columns]) -> Path:
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(",".join(heads) + "\n")
        for columns in pieces:
            np.savetxt(file, np.column_stack(columns), "%.12g", ",")
    return path
