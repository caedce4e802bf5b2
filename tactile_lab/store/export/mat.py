"""A MATLAB file: one struct per signal and table."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy.io

from tactile_lab.errors import RunFolderError
from tactile_lab.store.run import Run
from tactile_lab.store.selection import Selection

LARGEST = 2_000_000_000
"""Bytes one variable of a MAT file of version 5 can have."""


def export(run: Run, file: Path, selection: Selection) -> list[Path]:
    """Write `file`; signals are structs with time (s), values (single, SI) and unit.

    Raises:
        RunFolderError: more samples than the format can hold, or a signal, rate or
            time the run does not have.
        OSError: the file cannot be written.
    """
    selection.check(run)
    names = selection.names(run)
    spans = selection.spans(run)
    interval = run.signal(names[0]).interval if names else 1.0
    count = sum(stop - start for start, stop in spans) / selection.average(interval)
    if 8 * count > LARGEST:
        raise RunFolderError(
            f"{count:.3g} samples per signal are more than a MAT file holds "
            f"({LARGEST // 8:.3g}). Choose a part with --from and --until, or --rate."
        )
    content: dict[str, Any] = {
        "info": {
            "run": run.path.resolve().name,
            "status": run.status,
            "simulated": run.simulated,
        }
    }
    time, read = selection.read(run)
    if time.size:
        content["time"] = time
    for name, values in read.items():
        unit = run.signal(name).unit
        content[name] = {"values": values.astype(np.float32), "unit": unit}
    for name in ("gaps", "spikes", "current", "field"):
        rows = selection.rows(getattr(run, name))
        content[name] = {column: rows[column] for column in rows.dtype.fields or ()}
    trials = run.trials
    content["trials"] = {
        column: trials[column]
        for column in trials.dtype.fields or ()
        if column not in ("label", "hold_start", "hold_end")
    }
    labels = np.array([row.decode() for row in trials["label"]], dtype=object)
    content["trials"]["label"] = labels
    file.parent.mkdir(parents=True, exist_ok=True)
    scipy.io.savemat(file, content, do_compression=True, oned_as="column")
    return [file]
