"""Events: who fired when, written with flat memory and read lazily."""

from __future__ import annotations

import json
import shutil
import tempfile
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import RunFolderError
from tactile_lab.store.folder import lock
from tactile_lab.whole_file import failing_as, replacing

EVENT = np.dtype([("time", np.float64), ("taxel", np.int32)])
"""One event: s, and the number of the taxel."""
BUCKETS = 64
"""Stretches of time, sorted one by one: a 64th of all events is in memory."""
FILE = "events.h5"
WAITING = ".events-"
"""How a folder of trains that wait to be sorted begins."""


class EventWriter:
    """Takes trains in any order of time, and writes one file in order of time.

    Trains wait in files of one stretch of time each; `finish` sorts stretch by stretch.
    Events at the same time are in the order of their taxels.

    Args:
        path: of the file; it comes into being when all is written.
        duration: s.
    """

    def __init__(self, path: Path, duration: float) -> None:
        self._path, self._duration = path, duration
        _remove_left(path.parent)
        with recording():
            folder = tempfile.TemporaryDirectory(dir=path.parent, prefix=WAITING)
            self._folder, self._lock = folder, (Path(folder.name) / "lock").open("w")
        lock(self._lock)
        self._parts = [Path(self._folder.name) / str(k) for k in range(BUCKETS)]
        self._count = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._lock.close()
        self._folder.cleanup()

    def add(self, first: int, count: NDArray[np.int64], times: FloatArray) -> None:
        """The trains of taxels `first` and following.

        Args:
            first: number of the first taxel.
            count: spikes of each.
            times: s, taxel after taxel.

        Raises:
            RecordingError: they cannot be written.
        """
        events = np.empty(times.size, EVENT)
        events["time"] = times
        events["taxel"] = first + np.repeat(np.arange(count.size), count)
        bucket = np.minimum(times / self._duration * BUCKETS, BUCKETS - 1).astype(int)
        order = np.argsort(bucket, kind="stable")
        ends = np.searchsorted(bucket[order], np.arange(BUCKETS), side="right")
        begin = 0
        for path, end in zip(self._parts, ends, strict=True):
            if end > begin:
                with recording(), path.open("ab") as file:
                    file.write(events[order[begin:end]].tobytes())
            begin = end
        self._count += times.size

    def finish(self, columns: dict[str, Any], about: dict[str, Any]) -> None:
        """Write the file.

        Args:
            columns: further arrays, one row for each taxel.
            about: kept as JSON.

        Raises:
            RecordingError: it cannot be written.
        """
        with recording(), replacing(self._path) as part, h5py.File(part, "w") as file:
            stored = {
                name: file.create_dataset(
                    name, (self._count,), EVENT[name], chunks=True, shuffle=True,
                    compression="gzip", compression_opts=1,
                )
                for name in EVENT.names or ()
            }  # fmt: skip
            at = 0
            for path in self._parts:
                if path.exists():
                    events = np.fromfile(path, EVENT)
                    events = events[np.lexsort((events["taxel"], events["time"]))]
                    for name, column in stored.items():
                        column[at : at + events.size] = events[name]
                    at += events.size
            for name, values in columns.items():
                file.create_dataset(f"taxels/{name}", data=values)
            file.attrs["about"] = json.dumps(about)


def _remove_left(folder: Path) -> None:
    """Remove what waited to be sorted when its process was killed."""
    for left in folder.glob(f"{WAITING}*"):
        try:
            with (left / "lock").open("r+") as file:
                abandoned = lock(file)
        except OSError:  # not begun, or just gone
            continue
        if abandoned:
            shutil.rmtree(left, ignore_errors=True)


recording = partial(failing_as, "The events cannot be written")
"""Turns a failing disk into an error of the tree."""


@dataclass(frozen=True, eq=False)
class Events:
    """The spikes of an array.

    Attributes:
        time: s, ascending, shape (n,); read when it is sliced.
        taxel: number of the taxel of each, shape (n,).
        places: of the taxels, m, shape (taxels, 2).
        count: spikes of each taxel, shape (taxels,).
        role: what became of each, as `kernel` numbers it, shape (taxels,).
        largest_force: on each, N, shape (taxels,); of one left out without computing
            its force, what that stays below.
        about: of the file.
    """

    time: Any
    taxel: Any
    places: FloatArray
    count: NDArray[np.int64]
    role: NDArray[np.uint8]
    largest_force: FloatArray
    about: dict[str, Any]

    @property
    def duration(self) -> float:
        """How long it was pressed, s."""
        return float(self.about["duration_s"])

    @classmethod
    def read(cls, path: str | Path) -> Events:
        """The events in a file, or in a folder that holds one.

        Raises:
            RunFolderError: it holds none.
        """
        file = Path(path) / FILE if Path(path).is_dir() else Path(path)
        try:
            opened = h5py.File(file, "r")
            taxels = opened["taxels"]
            return cls(
                time=opened["time"],
                taxel=opened["taxel"],
                places=taxels["places"][:],
                count=taxels["count"][:],
                role=taxels["role"][:],
                largest_force=taxels["largest_force"][:],
                about=json.loads(opened.attrs["about"]),
            )
        except (OSError, KeyError, ValueError) as reason:
            if any(file.parent.glob(f"{WAITING}*")) and not file.exists():
                raise RunFolderError(
                    f"{file.parent} is not finished: it is being computed, or that was "
                    "ended; then compute it again."
                ) from reason
            raise RunFolderError(f"{file} holds no events: {reason}.") from reason

    def train(self, taxel: int) -> FloatArray:
        """Spike times of one taxel, s."""
        found: FloatArray = self.time[:][self.taxel[:] == taxel]
        return found

    def trains(self) -> list[FloatArray]:
        """Spike times of each taxel, s."""
        order = np.argsort(self.taxel[:], kind="stable")
        return np.split(self.time[:][order], np.cumsum(self.count)[:-1])

    @property
    def made(self) -> datetime:
        """When the run began, or the skin's file was written, with its time zone."""
        if started := self.about.get("started"):
            return datetime.fromisoformat(started).astimezone()
        written = Path(self.time.file.filename).stat().st_mtime
        return datetime.fromtimestamp(written).astimezone()
