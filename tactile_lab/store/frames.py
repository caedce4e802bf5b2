"""A run as other libraries and notebooks take it."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from tactile_lab import notebook
from tactile_lab.errors import RunFolderError
from tactile_lab.quantity import show
from tactile_lab.signals import SIGNALS
from tactile_lab.store.derived import table
from tactile_lab.store.layout import RECORDS

if TYPE_CHECKING:
    import pandas
    import xarray

    from tactile_lab.store.run import Run


def as_xarray(
    run: Run,
    start: float,
    end: float | None,
    signals: Sequence[str] | None,
    rate: float | None,
) -> xarray.Dataset:
    """See `Run.to_xarray`."""
    made = _optional("xarray").Dataset
    time, columns = table(run, start, end, signals, rate)
    dataset: xarray.Dataset = made(coords={"time": time})
    dataset["time"].attrs["units"] = "s"
    for name, values in columns.items():
        known = SIGNALS[name]
        attrs = {"units": known.unit, "long_name": known.title}
        dataset[name] = ("time", values, attrs)
    dataset.attrs.update(run=run.path.name, simulated=int(run.simulated))
    return dataset


def as_pandas(
    run: Run,
    what: str,
    start: float,
    end: float | None,
    signals: Sequence[str] | None,
    rate: float | None,
) -> pandas.DataFrame:
    """See `Run.to_pandas`."""
    pd = _optional("pandas")
    frame: pandas.DataFrame
    if what == "signals":
        time, columns = table(run, start, end, signals, rate)
        frame = pd.DataFrame(columns, index=pd.Index(time, name="time"))
        return frame
    if what in ("spikes", "rate"):
        rows = getattr(run, what)
    elif what in RECORDS:
        rows = run.records(what)
    else:
        raise RunFolderError(
            f"A run has no table {what!r}; give signals, rate or one of "
            f"{', '.join(RECORDS)}."
        )
    fields = {name: rows[name] for name in rows.dtype.names}
    for name, values in fields.items():
        if values.dtype.kind == "S":
            fields[name] = np.char.decode(values, "utf-8", errors="replace")
    frame = pd.DataFrame(fields)
    return frame


def as_html(run: Run) -> str:
    """What a notebook shows: the run in a few words, and its trials."""
    info = run.info
    rows = [
        ("status", f"{run.status} {info.get('reason') or ''}".strip()),
        ("protocol", info.get("protocol")),
        ("bench", info.get("bench")),
        ("physics", "simulated" if run.simulated else "measured"),
        ("started", info.get("started")),
        ("duration", show(run.duration, "s")),
        ("signals", ", ".join(run.signals)),
        ("spikes", len(run.table("spikes"))),
        ("loss", (info.get("loss") or {}).get("text")),
        ("folder", run.path),
    ]
    trials = [
        (
            row["label"].decode(errors="replace"),
            show(row["start"], "s"),
            show(row["end"], "s"),
            row["spikes"],
        )
        for row in run.trials
    ]
    head = ("trial", "start", "end", "spikes")
    return notebook.facts(run.path.name, rows) + notebook.table(head, trials)


def _optional(name: str) -> Any:
    """A library that is installed only where it is wanted.

    Raises:
        RunFolderError: it is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise RunFolderError(
            f"{name} is not installed; `pip install {name}`, or read arrays with "
            "run.signal()."
        ) from error
