"""What every export tells of a run beside its signals: what it is, and its tables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.quantity import show
from tactile_lab.signals import SIGNALS
from tactile_lab.store.applied_trial import holds
from tactile_lab.store.derived import DERIVED, derivable, derivation
from tactile_lab.store.folder import SCENE, ZERO, told_status
from tactile_lab.store.overrange import told as overrange_told
from tactile_lab.store.remarks import read_remarks
from tactile_lab.store.run import Run
from tactile_lab.store.selection import Selection
from tactile_lab.store.stored_run import ended
from tactile_lab.store.warned import told as warned_told

UNITS = {
    "gaps": {"start": "s", "end": "s"},
    "spikes": {"time": "s", "amplitude": "V", "width": "s"},
    "current": {"time": "s", "setpoint": "A", "measured": "A", "heard": "s"},
    "field": {"time": "s", "field": "T"},
    "temperature": {"time": "s", "temperature": "K"},
    "voltages": {
        "time": "s",
        "name": "",
        "setpoint": "V",
        "measured": "V",
        "current": "A",
    },
    "events": {"time": "s", "kind": "", "text": ""},
}
"""Exported columns of each table and their SI units."""

NO_ZERO = "not known: the run is of an older version, which did not keep it"
"""What is told of when a run's time was 0 where that is not known."""

TABLES = (*UNITS, "trials", "remarks")
"""All that `tables` may give."""


@dataclass(frozen=True, eq=False)
class ExportTable:
    """Records in columns.

    Attributes:
        columns: by name, all of one length; texts are arrays of str.
        units: of each column, SI; "" for numbers without one and for texts.
    """

    columns: dict[str, NDArray[Any]]
    units: dict[str, str]

    @property
    def heads(self) -> list[str]:
        """Column names with their units: "time_s"."""
        return [f"{n}_{u}" if u else n for n, u in self.units.items()]

    def __len__(self) -> int:
        return next(iter(self.columns.values())).size


def tables(run: Run, selection: Selection) -> dict[str, ExportTable]:
    """Those of `TABLES` that the part has rows of. Trials are all there.

    Times are s on the run's axis.
    """
    found = {}
    for name, units in UNITS.items():
        table = dated_current(run) if name == "current" else getattr(run, name)
        rows = selection.of(table)
        columns = {column: _plain(rows[column]) for column in units}
        if name == "current" and "force" in derivable(run):
            columns["force"] = derivation(run, "force")(rows["heard"])
            units = units | {"force": "N"}
        found[name] = ExportTable(columns, units)
    found["trials"] = _trials(run)
    found["remarks"] = _remarks(run, selection)
    return {name: table for name, table in found.items() if len(table)}


def changes(run: Run, name: str, selection: Selection) -> FloatArray:
    """When the derived force or rate changes in the part, s, and the part's ends.

    Between two of them it is a line, or what it was at the first; before the first it
    may have been so for long.
    """
    time = run.force.time if name == "force" else run.rate["time"]
    start, end = selection.ends(run)
    found: FloatArray = np.r_[start, time[(time > start) & (time < end)], end]
    return found


def dated_current(run: Run) -> NDArray[Any]:
    """The applied current by when the source acted: `UNITS` has the columns.

    `heard` is when the host knew of it. Both are one where the source was only read
    back, for a point of a list, and in runs of former versions.
    """
    rows = run.current
    names = rows.dtype.names or ()
    found = np.empty(rows.size, [(name, "f8") for name in UNITS["current"]])
    found["setpoint"], found["measured"] = rows["setpoint"], rows["measured"]
    time: FloatArray = rows["time"]
    found["heard"] = found["time"] = time
    if "acted" in names:
        acted: FloatArray = rows["acted"]
        found["time"] = np.fmin(time, acted)
    return found


def _trials(run: Run) -> ExportTable:
    rows = run.trials
    held = [hold or (np.nan, np.nan) for hold in holds(run, rows)]
    start: FloatArray = rows["start"]
    stood = start[:, None] + np.array(held, dtype=np.float64).reshape(-1, 2)
    columns = {
        "index": rows["index"],
        "label": _plain(rows["label"]),
        "level": rows["level"],
        "start": start,
        "end": rows["end"],
        "hold_start": stood[:, 0],
        "hold_end": stood[:, 1],
        "spikes": rows["spikes"],
        "pause": rows["pause"],
        "complete": ended(rows).astype(np.uint8),
    }
    units = dict.fromkeys(columns, "")
    units |= {"level": "N", "start": "s", "end": "s", "hold_start": "s"}
    units |= {"hold_end": "s"}
    for name in ("rest_V_C1", "drift_V_C1"):
        if name in (rows.dtype.names or ()):  # older runs lack it
            columns[name], units[name] = rows[name], "V"
    return ExportTable(columns, units)


def _remarks(run: Run, selection: Selection) -> ExportTable:
    """Notes that people made of the run, also afterwards; NaN: of it as a whole."""
    notes = read_remarks(run.path).notes
    time = np.array([np.nan if note.time is None else note.time for note in notes])
    kept = np.isnan(time) | selection.holds(time)
    columns = {
        "time": time[kept],
        "text": np.array([note.text for note in notes], dtype=str)[kept],
        "written": np.array([note.at for note in notes], dtype=str)[kept],
    }
    return ExportTable(columns, {"time": "s", "text": "", "written": ""})


def _plain(values: NDArray[Any]) -> NDArray[Any]:
    if values.dtype.kind == "S":
        return np.char.decode(values, "utf-8", errors="replace")
    return values


def about(run: Run, selection: Selection | None = None) -> dict[str, str | float]:
    """What the run is, by name; of a selection what it is and how it was measured."""
    info = run.info
    names = () if selection is None else selection.names(run)
    told: dict[str, str | float] = {"run": run.name}
    for key in ("title", "protocol", "scene", "bench", "started", "reason"):
        if info.get(key):
            told[key] = str(info[key])
    told[ZERO] = info.get(ZERO) or NO_ZERO
    told |= {
        "status": told_status(run.path, run.status),
        "physics": "simulated" if run.simulated else "measured",
        "duration_s": run.duration,
    }
    if (temperature := (info.get("temperature") or {}).get("K")) is not None:
        told["temperature_K"] = float(temperature)
    for name, found in (info.get("instruments") or {}).items():
        told[name] = str(found.get("identity") or found.get("driver") or "")
    if info.get("seed") is not None:
        told["seed"] = int(info["seed"])
    if software := info.get("environment"):
        told["software"] = ", ".join(f"{name} {it}" for name, it in software.items())
    for note, text in (info.get("notes") or {}).items():
        told[f"note {note}"] = str(text)
    remarks = read_remarks(run.path)
    told |= {"name": remarks.title} if remarks.title else {}
    told |= {"tags": ", ".join(remarks.tags)} if remarks.tags else {}
    for name, value in (info.get("detection") or {}).items():
        told[f"detection {name}"] = value if isinstance(value, float) else str(value)
    if selection is not None:
        told |= selection.told(run)
    for name in names:
        if name in run.signals:
            signal = run.signal(name)
            at = signal.attributes
            told[f"{name} input"] = f"{at['input']}, {at['coupling']}"
            told[f"{name} range"] = " to ".join(
                show(end, signal.unit) for end in signal.span
            )
            told[f"{name} one code {signal.unit}"] = abs(signal.gain)
        else:
            told[f"{name} source"] = f"derived: {DERIVED[name]}"
    if "force" in names and (run.path / SCENE).exists():
        known = run.scene.bench.magnet.force_uncertainty
        told["force uncertainty"] = "not stated" if known is None else known.text
    if loss := (info.get("loss") or {}).get("text"):
        told["loss"] = str(loss).removeprefix("loss: ")
    planned = info.get("warnings") or ()
    warnings = dict.fromkeys((*overrange_told(run), *planned, *warned_told(run)))
    for kind, texts in (("warning", warnings), ("assumption", info.get("assumptions"))):
        told |= {f"{kind} {n}": str(text) for n, text in enumerate(texts or (), 1)}
    if (run.path / SCENE).exists():
        told["scene.toml"] = (run.path / SCENE).read_text(encoding="utf-8")
    return told


def unit(name: str) -> str:
    """SI unit of a signal; V where it is none this program knows."""
    return SIGNALS[name].unit if name in SIGNALS else "V"
