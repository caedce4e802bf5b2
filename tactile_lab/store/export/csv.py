"""CSV files in SI, units in the header: one for the signals, one per table."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tactile_lab.store.export.selection import Selection
from tactile_lab.store.run import Run


def export(run: Run, folder: Path, selection: Selection) -> list[Path]:
    """Write `signals.csv`, `spikes.csv`, `gaps.csv`, ... into `folder`.

    Raises:
        RunFolderError: a signal or rate the run does not have.
        OSError: the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    names = selection.names(run)
    if names:
        written.append(folder / "signals.csv")
        heads = [f"{name}_{run.signal(name).unit}" for name in names]
        with written[-1].open("w", encoding="utf-8", newline="\n") as file:
            file.write(",".join(["time_s", *heads]) + "\n")
            for times, columns in selection.pieces(run):
                np.savetxt(file, np.column_stack([times, *columns]), "%.12g", ",")
    tables = {
        "gaps": (run.gaps, {"start": "s", "end": "s"}),
        "spikes": (run.spikes, {"time": "s", "amplitude": "V", "width": "s"}),
        "current": (run.current, {"time": "s", "setpoint": "A", "measured": "A"}),
        "field": (run.field, {"time": "s", "field": "T"}),
    }
    for name, (rows, units) in tables.items():
        chosen = selection.rows(rows)
        if chosen.size:
            written.append(folder / f"{name}.csv")
            with written[-1].open("w", encoding="utf-8", newline="\n") as file:
                file.write(",".join(f"{c}_{u}" for c, u in units.items()) + "\n")
                table = np.column_stack([chosen[column] for column in units])
                np.savetxt(file, table, "%.12g", ",")
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
    return written
