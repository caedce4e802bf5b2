"""All runs under a folder, found again quickly."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any, Self

from tactile_lab.errors import RunFolderError
from tactile_lab.store.facts import Fact, facts, grouped
from tactile_lab.store.folder import (
    UNCOUNTED,
    has_lost_data,
    read_info,
    told_status,
)
from tactile_lab.store.index import Index
from tactile_lab.store.remarks import read_remarks
from tactile_lab.store.summary import RunSummary
from tactile_lab.trust import INFO
from tactile_lab.whole_file import failing_as

KINDS: Mapping[str, type | tuple[type, ...]] = {
    "status": str,
    **dict.fromkeys(("started", "title", "protocol", "scene", "bench"), str),
    **dict.fromkeys(("notes", "parameters", "loss"), dict),
    **dict.fromkeys(("duration_s", "spikes_online"), (int, float)),
    **dict.fromkeys(("simulated", UNCOUNTED), bool),
}
"""What entries of `run.json` are, where they are there."""

SENSOR_KEYS = ("sensor", "sample")
"""Notes that name the sensor measured on."""


class Catalogue:
    """The runs in a folder, and what is known of them; a context manager.

    Args:
        root: holds run folders; looked at once, when the catalogue is made.

    Raises:
        RunFolderError: `root` is no folder.
    """

    def __init__(self, root: Path) -> None:
        def read(name: str) -> tuple[dict[str, Any], list[Fact]]:
            entry = summary(root / name)
            return entry.to_dict(), facts(entry)

        stamps = dict(_folders(root))
        self._root = root
        self._index = Index(root, keep=bool(stamps))
        self._index.update(stamps, read)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._index.close()

    def runs(self, *, words: str = "", where: str = "") -> list[RunSummary]:
        """Runs that match, oldest first.

        Args:
            words: each stands somewhere in its names, notes or parameters.
            where: a condition on keys, see `where`.

        Raises:
            SceneError: `where` cannot be read.
        """
        chosen = [entry for entry in self._fitting(where) if entry.says(words)]
        return sorted(chosen, key=lambda entry: (entry.started, entry.name))

    def keys(self) -> list[str]:
        """Every key that a run of the folder has."""
        return self._index.keys()

    def known(
        self, entries: Sequence[RunSummary], key: str | None = None
    ) -> list[dict[str, list[Fact]]]:
        """What is known of these runs, by key; of a key with a list each item.

        Args:
            entries: which runs.
            key: this alone, which is much faster; None for all.
        """
        found = self._index.facts([entry.name for entry in entries], key)
        return [grouped(found[entry.name]) for entry in entries]

    def _fitting(self, where: str) -> Iterator[RunSummary]:
        for name, told in self._index.entries(where):
            entry = RunSummary(folder=self._root / name, **told)
            yield replace(entry, status=told_status(entry.folder, entry.status))


def _folders(root: Path) -> Iterator[tuple[str, list[int]]]:
    """Run folders and what tells whether what is said of them has changed.

    Every file in a folder but one is replaced, not written into, so that the folder's
    own time changes with them; the one that people might edit is looked at, too.
    """
    advice = "Give the folder that holds the runs."
    with (
        failing_as(f"{root} cannot be listed", advice, RunFolderError),
        os.scandir(root) as found,
    ):
        for item in found:
            if not item.is_dir():
                continue
            try:
                state = os.stat(f"{item.path}{os.sep}{INFO}")
                changed = item.stat().st_mtime_ns
            except OSError:
                continue  # some other folder
            yield item.name, [changed, state.st_mtime_ns, state.st_size]


def summary(path: Path) -> RunSummary:
    """What the run in folder `path` says of itself, or why it cannot be read."""
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
        status="data gone" if has_lost_data(path, info) else str(info["status"]),
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
        uncounted=bool(info.get(UNCOUNTED)),
        loss=str((info.get("loss") or {}).get("text") or ""),
    )


def _check(path: Path, info: Mapping[str, Any]) -> None:
    """Refuse what no run says of itself, lest one such file stops a list of all."""
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
