"""All runs under a folder, found again quickly; the index may be deleted any time."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from datetime import date, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactile_lab.errors import RecordingError, RunFolderError
from tactile_lab.store.folder import is_live, read_info, write_json
from tactile_lab.store.remarks import REMARKS, read_remarks
from tactile_lab.trust import INFO

if TYPE_CHECKING:
    from tactile_lab.store.run import Run

INDEX = ".index.json"
VERSION = 3
"""Of the index; another one is thrown away and rebuilt."""

KINDS: Mapping[str, type | tuple[type, ...]] = {
    "status": str,
    **dict.fromkeys(("started", "title", "protocol", "scene", "bench"), str),
    **dict.fromkeys(("notes", "parameters", "loss"), dict),
    **dict.fromkeys(("duration_s", "spikes_online"), (int, float)),
    "simulated": bool,
}
"""What entries of `run.json` are, where they are there."""

SENSOR_KEYS = ("sensor", "sample")
"""Notes that name the sensor measured on."""


@dataclass(frozen=True, kw_only=True)
class RunSummary:
    """One run in the catalogue, without its samples.

    Attributes:
        folder: of the run.
        name: of the folder.
        started: ISO time with zone.
        status: as in `run.json`; "cut short" where a running run has no writer.
        title: that somebody gave it, else that of its protocol.
        protocol, scene, sensor, operator, bench: names; empty where not known.
        tags, notes: what people said of it.
        starred: it matters to somebody.
        parameters: of the protocol, as a file holds them; empty for older runs.
        simulated: whether physics was computed.
        duration: of the experiment, s; None if not known.
        spikes: found on line; None if not known.
        loss: the certificate's line; empty if there is none.
        trouble: why the run cannot be read; empty where it can.
    """

    folder: Path
    name: str
    started: str = ""
    status: str = "unreadable"
    title: str = ""
    protocol: str = ""
    scene: str = ""
    sensor: str = ""
    operator: str = ""
    bench: str = ""
    tags: Sequence[str] = ()
    notes: Sequence[str] = ()
    starred: bool = False
    parameters: Mapping[str, Any] = field(default_factory=dict)
    simulated: bool | None = None
    duration: float | None = None
    spikes: int | None = None
    loss: str = ""
    trouble: str = ""

    def load(self) -> Run:
        """The run itself, opened for reading.

        Raises:
            RunFolderError: it cannot be read, or ended before its first sample.
        """
        from tactile_lab.store.run import Run

        return Run.load(self.folder)

    def says(self, words: str) -> bool:
        """Whether each of `words`, in any case, stands in a name, note or parameter."""
        texts = (
            *(self.name, self.status, self.title, self.protocol, self.scene),
            *(self.sensor, self.operator, self.bench, *self.tags, *self.notes),
            *(f"{key}={value}" for key, value in self.parameters.items()),
        )
        text = " ".join(texts).casefold()
        return all(word in text for word in words.casefold().split())

    def to_dict(self) -> dict[str, Any]:
        """All but the folder, for the index and for JSON."""
        names = (field.name for field in fields(self))
        return {name: getattr(self, name) for name in names if name != "folder"}


def catalogue(
    root: Path,
    *,
    protocol: str | None = None,
    sensor: str | None = None,
    since: date | None = None,
    until: date | None = None,
    words: str = "",
) -> list[RunSummary]:
    """Runs in folder `root` that match, oldest first.

    Args:
        root: holds run folders.
        protocol: name of the protocol.
        sensor: part of the noted sensor, any case.
        since: first day on which the run started.
        until: last day.
        words: each stands somewhere in its names, notes or parameters.

    Raises:
        RunFolderError: `root` is no folder.
    """
    chosen = []
    for entry in _all(root):
        day = datetime.fromisoformat(entry.started).date() if entry.started else None
        if protocol is not None and entry.protocol != protocol:
            continue
        if sensor is not None and sensor.casefold() not in entry.sensor.casefold():
            continue
        if since is not None and (day is None or day < since):
            continue
        if until is not None and (day is None or day > until):
            continue
        if not entry.says(words):
            continue
        chosen.append(entry)
    return sorted(chosen, key=lambda entry: (entry.started, entry.name))


def _all(root: Path) -> list[RunSummary]:
    """Every run, from the index where `run.json` has not changed since."""
    known = _read_index(root)
    index: dict[str, Any] = {}
    entries = []
    for path, stamp in _folders(root):
        old = known.get(path.name)
        if old is not None and old["stamp"] == stamp:
            entry = RunSummary(folder=path, **old["entry"])
        else:
            entry = _entry(path)
        index[path.name] = {"stamp": stamp, "entry": entry.to_dict()}
        if entry.status == "running" and not is_live(path):
            entry = replace(entry, status="cut short")
        entries.append(entry)
    if index != known:
        try:
            write_json(root / INDEX, {"version": VERSION, "runs": index})
        except RecordingError:
            # an archive one may only read is listed without an index
            return entries
    return entries


def _folders(root: Path) -> Iterator[tuple[Path, list[int]]]:
    """Run folders and what tells whether what is said of them has changed."""
    try:
        with os.scandir(root) as found:
            names = [item.name for item in found if item.is_dir()]
    except OSError as error:
        raise RunFolderError(
            f"{root} cannot be listed: {error.strerror}. Give the folder that holds "
            "the runs."
        ) from error
    for name in sorted(names):
        try:
            state = (root / name / INFO).stat()
        except OSError:
            continue  # some other folder
        stamp = [state.st_mtime_ns, state.st_size]
        with suppress(OSError):  # few runs have remarks
            state = (root / name / REMARKS).stat()
            stamp += [state.st_mtime_ns, state.st_size]
        yield root / name, stamp


def _read_index(root: Path) -> dict[str, Any]:
    """The index as last written; empty where there is none that can be used."""
    try:
        content = json.loads((root / INDEX).read_text(encoding="utf-8"))
        if content["version"] != VERSION:
            return {}
        for item in content["runs"].values():
            RunSummary(folder=root, **item["entry"])
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}
    runs: dict[str, Any] = content["runs"]
    return runs


def _entry(path: Path) -> RunSummary:
    try:
        info, remarks = read_info(path), read_remarks(path)
        _check(path, info)
    except RunFolderError as error:
        return RunSummary(folder=path, name=path.name, trouble=str(error))
    notes = info.get("notes") or {}
    sensors = [str(notes[key]) for key in SENSOR_KEYS if notes.get(key)]
    return RunSummary(
        folder=path,
        name=path.name,
        started=str(info.get("started") or ""),
        status=str(info["status"]),
        title=remarks.title or str(info.get("title") or info.get("protocol") or ""),
        protocol=str(info.get("protocol") or ""),
        scene=str(info.get("scene") or ""),
        sensor=", ".join(sensors),
        operator=str(notes.get("operator") or ""),
        bench=str(info.get("bench") or ""),
        tags=list(remarks.tags),
        notes=[*_free(notes), *map(str, remarks.notes)],
        starred=remarks.starred,
        parameters=info.get("parameters") or {},
        simulated=info.get("simulated"),
        duration=info.get("duration_s"),
        spikes=info.get("spikes_online"),
        loss=str((info.get("loss") or {}).get("text") or ""),
    )


def _check(path: Path, info: Mapping[str, Any]) -> None:
    """Refuse what no run says of itself, lest one such file stops a list of all.

    Raises:
        RunFolderError: an entry is of another kind.
    """
    for name, kinds in KINDS.items():
        if (found := info.get(name)) is not None and not isinstance(found, kinds):
            raise RunFolderError(
                f"{path / INFO} says {name} = {json.dumps(found)[:40]}, which no run "
                "has: it is damaged. `tactile-lab verify` lists what else is."
            )
    try:
        datetime.fromisoformat(info.get("started") or "2000-01-01")
    except ValueError as error:
        raise RunFolderError(f"{path / INFO} is damaged: {error}.") from error
    if not info.get("status"):
        raise RunFolderError(f"{path / INFO} is damaged: it does not say the status.")


def _free(notes: Mapping[str, Any]) -> list[str]:
    """Notes given with the run that have no place of their own."""
    known = (*SENSOR_KEYS, "operator")
    return [f"{key}: {text}" for key, text in notes.items() if key not in known]
