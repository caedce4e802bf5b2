"""Finished points on disk: what is computed once is never computed again.

Each batch is one file, written whole or not at all; a point is found by its address
(see `Addresses`), whichever study asked for it.
"""

from __future__ import annotations

import hashlib
import os
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_lab.studies.addresses import ADDRESS, NAME
from tactile_lab.studies.column import Column, Rows, placed
from tactile_lab.whole_file import failing_as

DAMAGED = (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile)
"""What reading a file raises that is not whole."""


class Places(NamedTuple):
    """Where points are kept: number of the file, -1 for none, and row in it."""

    file: NDArray[np.int32]
    row: NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Batch:
    """What is kept of some points.

    Attributes:
        addresses: of each, of dtype `NAME`.
        columns: by name, a value for each point.
        reasons: why, for each that failed, by its place among the points.
    """

    addresses: NDArray[np.void]
    columns: Mapping[str, Column]
    reasons: Mapping[int, str]


class Shelf:
    """A folder of finished batches.

    Args:
        folder: made when the first batch is put into it.

    Attributes:
        folder: the same.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._files: list[Path] = []
        self._addresses: list[NDArray[np.void]] = []
        for path in sorted(folder.glob("*.npz")):
            self._take(path)

    def find(self, addresses: NDArray[np.void]) -> Places:
        """Where each of these points is kept.

        Args:
            addresses: shape (n,), of dtype `NAME`.
        """
        places = Places(
            np.full(addresses.size, -1, np.int32), np.zeros(addresses.size, np.int32)
        )
        if not self._addresses:
            return places
        whole = np.concatenate(self._addresses)
        order = np.argsort(whole, kind="stable")
        whole = whole[order]
        asked = np.argsort(addresses, kind="stable")  # in order, they are found fast
        sought = addresses[asked]
        at = np.minimum(np.searchsorted(whole, sought), whole.size - 1)
        there = whole[at] == sought
        begins = np.cumsum([0, *(part.size for part in self._addresses)])
        place = order[at[there]]
        number = np.searchsorted(begins, place, side="right") - 1
        places.file[asked[there]] = number
        places.row[asked[there]] = place - begins[number]
        return places

    def add(self, batch: Path, addresses: NDArray[np.void]) -> None:
        """Find these points in a batch that `put` wrote, in this process or another."""
        self._files.append(batch)
        self._addresses.append(addresses)

    def gather(
        self, places: Places, names: Sequence[str]
    ) -> tuple[dict[str, Column], NDArray[np.object_]]:
        """What is kept by name, and why for each point that failed ("" for others).

        Args:
            places: as `find` gave them; what is not known yet is NaN, or a row of none.
            names: what is wanted.
        """
        size = places.file.size
        reasons = np.full(size, "", dtype=object)
        parts: dict[str, list[tuple[NDArray[np.intp], Column]]] = {n: [] for n in names}
        order = np.argsort(places.file, kind="stable")
        numbers, begins = np.unique(places.file[order], return_index=True)
        for number, mine in zip(numbers, np.split(order, begins[1:]), strict=True):
            if number < 0:
                continue
            rows = places.row[mine].astype(np.intp)
            with np.load(self._files[number]) as arrays:
                why = dict(
                    zip(arrays["failed"].tolist(), arrays["reason"], strict=True)
                )
                for at in np.flatnonzero(np.isin(rows, arrays["failed"])):
                    reasons[mine[at]] = str(why[int(rows[at])])
                for name in names:
                    parts[name].append((mine, _column(arrays, name, rows)))
        return {name: placed(found, size) for name, found in parts.items()}, reasons

    def _take(self, path: Path) -> None:
        try:
            with path.open("rb") as file, np.load(file) as arrays:
                addresses = arrays["address"]
        except DAMAGED:
            return  # its points are computed again, into the same file
        if addresses.dtype == NAME:  # of an earlier version of this program
            self.add(path, addresses)


def put(batch: Batch, folder: Path) -> Path:
    """Write a batch into a shelf's folder; it is on disk when this returns.

    Raises:
        RecordingError: the folder cannot be written.
    """
    name = hashlib.blake2b(batch.addresses.tobytes(), digest_size=ADDRESS)
    path = folder / f"{name.hexdigest()}.npz"
    # another study on this shelf may write the same batch
    part = path.with_suffix(f".{os.getpid()}.part")
    advice = "What was finished before is kept; make room and start the study again."
    with failing_as(f"{path} cannot be written", advice):
        folder.mkdir(parents=True, exist_ok=True)
        with part.open("wb") as file:
            np.savez(file, **_arrays(batch))  # type: ignore[arg-type] # names ours
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
    return path


def _arrays(batch: Batch) -> dict[str, NDArray[Any]]:
    """A batch as the arrays of its file."""
    whole: dict[str, NDArray[Any]] = {
        "address": batch.addresses,
        "failed": np.array(list(batch.reasons), dtype=np.int64),
        "reason": np.array(list(batch.reasons.values()), dtype=np.str_),
    }
    for name, column in batch.columns.items():
        if isinstance(column, Rows):
            whole[f"rows {name}"], whole[f"sizes {name}"] = column.values, column.sizes
        else:
            whole[f"number {name}"] = column
    return whole


def _column(arrays: Any, name: str, rows: NDArray[np.intp]) -> Column:
    """Some rows of what a file has of `name`; NaN where all its points failed."""
    if f"rows {name}" in arrays:
        return Rows(arrays[f"rows {name}"], arrays[f"sizes {name}"]).take(rows)
    if f"number {name}" in arrays:
        found: Column = arrays[f"number {name}"][rows]
        return found
    return np.full(rows.size, np.nan)
