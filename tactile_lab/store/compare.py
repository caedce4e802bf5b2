"""What differs between two runs: what they ran on, with, and what came out."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tactile_lab.errors import RunFolderError
from tactile_lab.quantity import show
from tactile_lab.store.folder import SCENE, read_info
from tactile_lab.store.run import Run


@dataclass(frozen=True)
class Differences:
    """What differs, one line each; nothing where two runs are alike.

    Attributes:
        environment: versions, computer, bench and how it was simulated.
        calibration: constants stored with the samples, and changed keys of the scene.
        results: trials, spikes and samples.
    """

    environment: tuple[str, ...]
    calibration: tuple[str, ...]
    results: tuple[str, ...]

    def __str__(self) -> str:
        parts = []
        for name in ("environment", "calibration", "results"):
            lines: tuple[str, ...] = getattr(self, name)
            parts += [f"{name}: {line}" for line in lines or ("the same",)]
        return "\n".join(parts)


def differences(old: Path, new: Path) -> Differences:
    """Compare the runs in two folders, their settings also where one has no samples.

    Raises:
        RunFolderError: one of them is no run.
    """
    environment = tuple(_environment(read_info(old), read_info(new)))
    calibration: tuple[str, ...] = ()
    scene = tuple(_scene(old, new))
    try:
        with Run.load(old) as one, Run.load(new) as other:
            calibration = tuple(_values(one.attributes, other.attributes))
            results = tuple(_results(one, other))
    except RunFolderError as reason:
        results = (f"not compared: {reason}",)
    return Differences(environment, (*calibration, *scene), results)


def _environment(old: dict[str, Any], new: dict[str, Any]) -> Iterator[str]:
    keys = ("bench", "simulated", "seed", "notes", "temperature")
    yield from _values({k: old.get(k) for k in keys}, {k: new.get(k) for k in keys})
    yield from _values(old.get("environment") or {}, new.get("environment") or {})
    yield from _values(_instruments(old), _instruments(new))
    yield from _files(old.get("files") or {}, new.get("files") or {})


def _instruments(info: dict[str, Any]) -> dict[str, Any]:
    """Settings read back; the port of a simulated instrument is a serial number."""
    hidden = {"port"} if info.get("simulated") else set()
    return {
        instrument: {key: value for key, value in found.items() if key not in hidden}
        for instrument, found in (info.get("instruments") or {}).items()
    }


def _files(old: dict[str, str], new: dict[str, str]) -> Iterator[str]:
    """Copies of protocol, bench and calibration that differ, by their SHA-256."""
    for name in sorted({*old, *new} - {SCENE}):
        if name not in old or name not in new:
            yield f"{name} is kept with the {'new' if name in new else 'old'} run only"
        elif old[name] != new[name]:
            yield f"{name} is not the same"


def _values(old: dict[str, Any], new: dict[str, Any]) -> Iterator[str]:
    """Entries that differ; entries within entries by themselves.

    What only one of the two has is None in the other, as is what was not known.
    """
    for key in sorted({*old, *new}):
        one, other = old.get(key), new.get(key)
        within = [found for found in (one, other) if found is not None]
        if all(isinstance(found, dict) for found in within):
            yield from (f"{key}.{line}" for line in _values(one or {}, other or {}))
        elif one is None:
            yield f"{key} was not there, is {other}"
        elif other is None:
            yield f"{key} was {one}, is not there any more"
        elif one != other:
            yield f"{key} was {one}, is {other}"


def _scene(old: Path, new: Path) -> Iterator[str]:
    """Keys of the resolved scene that differ, each with its table."""
    yield from (f"scene {line}" for line in _values(_keys(old), _keys(new)))


def _keys(run: Path) -> dict[str, Any]:
    file = run / SCENE
    try:
        return tomllib.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    except ValueError as reason:
        raise RunFolderError(f"{file} cannot be read: {reason}.") from reason


def _results(old: Run, new: Run) -> Iterator[str]:
    if old.status != new.status:
        yield f"status was {old.status}, is {new.status}"
    if old.trials.size != new.trials.size:
        yield f"{old.trials.size} trials were {new.trials.size} now"
    for one, other in zip(old.trials, new.trials, strict=False):
        if one["spikes"] != other["spikes"] or one["label"] != other["label"]:
            yield (
                f"trial {one['index']} ({one['label'].decode()}) had {one['spikes']} "
                f"spikes, {other['label'].decode()} has {other['spikes']}"
            )
    before, after = old.spikes["time"], new.spikes["time"]
    if before.size != after.size:
        yield f"{before.size} spikes in all, {after.size} now"
    elif before.size and not np.array_equal(before, after):
        apart = float(np.max(np.abs(before - after)))
        yield f"spike times differ by up to {show(apart, 's', 3)}"
    for name in old.signals:
        if name not in new.signals:
            yield f"{name} is not stored any more"
        elif not np.array_equal(old.column(name)[1][()], new.column(name)[1][()]):
            yield f"the samples of {name} are not identical"
    for name in new.signals:
        if name not in old.signals:
            yield f"{name} was not stored"
