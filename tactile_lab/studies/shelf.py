"""Finished points on disk: what is computed once is never computed again.

Each batch is one file, written whole or not at all; a point is found by its address
(see `Points.address`), whichever study asked for it.
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

from tactile_lab.errors import RecordingError
from tactile_lab.studies.kept import Value
from tactile_lab.studies.points import ADDRESS

NAME = f"S{2 * ADDRESS}"
"""Addresses as numpy holds them: text, for bytes that end in 0 would be cut."""


Column = NDArray[np.float64] | list[NDArray[np.float64]]
"""Of each point a number, NaN where it failed; or a row of numbers."""


class Places(NamedTuple):
    """Where points are kept: number of the file, -1 for none, and row in it."""

    file: NDArray[np.intp]
    row: NDArray[np.intp]


@dataclass(frozen=True)
class Batch:
    """What is kept of some points.

    Attributes:
        addresses: of each.
        found: by name, for each point that was computed; None for one that failed.
        reasons: why, for each that failed; "" for the others.
    """

    addresses: Sequence[bytes]
    found: Sequence[Mapping[str, Value] | None]
    reasons: Sequence[str]


class Shelf:
    """A folder of finished batches.

    Args:
        folder: made when the first batch is put into it.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._files: list[Path] = []
        self._addresses: list[NDArray[np.bytes_]] = []
        for path in sorted(folder.glob("*.npz")):
            self._take(path)

    def find(self, addresses: NDArray[np.bytes_]) -> Places:
        """Where each of these points is kept.

        Args:
            addresses: shape (n,), of dtype `NAME`.
        """
        sizes = [part.size for part in self._addresses]
        whole = np.concatenate([np.empty(0, NAME), *self._addresses])
        order = np.argsort(whole, kind="stable")
        at = np.searchsorted(whole, addresses, sorter=order)
        known = at < whole.size
        place = order[np.where(known, at, 0)] if whole.size else np.zeros_like(at)
        known &= whole[place] == addresses if whole.size else False
        begins = np.cumsum([0, *sizes])
        number = np.searchsorted(begins, place, side="right") - 1
        return Places(np.where(known, number, -1), place - begins[number])

    def put(self, batch: Batch) -> None:
        """Keep a batch; it is on disk when this returns.

        Raises:
            RecordingError: the folder cannot be written.
        """
        arrays = _packed(batch)
        name = hashlib.blake2b(arrays["address"].tobytes(), digest_size=ADDRESS)
        path = self._folder / f"{name.hexdigest()}.npz"
        part = path.with_suffix(f".{os.getpid()}.part")
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            with part.open("wb") as file:
                np.savez(file, **arrays)  # type: ignore[arg-type] # names are ours
                file.flush()
                os.fsync(file.fileno())
            part.replace(path)
            descriptor = os.open(self._folder, os.O_RDONLY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
        except OSError as reason:
            raise RecordingError(
                f"{path} cannot be written: {reason.strerror or reason}. What was "
                "finished before is kept; make room and start the study again."
            ) from reason
        self._take(path)

    def gather(
        self, places: Places, names: Sequence[str]
    ) -> tuple[dict[str, Column], NDArray[np.str_]]:
        """What is kept by name, and why for each point that failed ("" for others).

        Args:
            places: as `find` gave them, all known.
            names: what is wanted.
        """
        columns: dict[str, Column] = {}
        reasons = np.zeros(places.file.size, dtype=object)
        for number in np.unique(places.file):
            mine = np.flatnonzero(places.file == number)
            rows = places.row[mine]
            with np.load(self._files[number]) as arrays:
                reasons[mine] = arrays["reason"][rows]
                for name in names:
                    _collect(columns, name, mine, rows, arrays, places.file.size)
        return columns, reasons.astype(np.str_)

    def _take(self, path: Path) -> None:
        try:
            with path.open("rb") as file, np.load(file) as arrays:
                self._addresses.append(arrays["address"])
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return  # damaged: its points are computed again, into the same file
        self._files.append(path)


def _collect(
    columns: dict[str, Column],
    name: str,
    mine: NDArray[np.intp],
    rows: NDArray[np.intp],
    arrays: Any,
    size: int,
) -> None:
    """Put what one file has of `name` where it belongs."""
    if f"number {name}" in arrays:
        column = columns.setdefault(name, np.full(size, np.nan))
        values = arrays[f"number {name}"][rows]
        if isinstance(column, list):
            for at, value in zip(mine, values, strict=True):
                column[at] = np.empty(0) if np.isnan(value) else np.array([value])
        else:
            column[mine] = values
    elif f"rows {name}" in arrays:
        long = columns.get(name)
        if not isinstance(long, list):  # a batch before gave one number a point
            short = np.full(size, np.nan) if long is None else long
            long = [np.empty(0) if np.isnan(one) else np.array([one]) for one in short]
            columns[name] = long
        begin, whole = arrays[f"begin {name}"], arrays[f"rows {name}"]
        for at, row in zip(mine, rows, strict=True):
            long[at] = whole[begin[row] : begin[row + 1]]


def _packed(batch: Batch) -> dict[str, NDArray[Any]]:
    """Numbers as a column, rows of numbers joined with where each begins."""
    whole: dict[str, NDArray[Any]] = {
        "address": np.array(batch.addresses, dtype=NAME),
        "reason": np.array(batch.reasons, dtype=np.str_),
    }
    names = next((list(row) for row in batch.found if row is not None), [])
    for name in names:
        values = [np.nan if row is None else row[name] for row in batch.found]
        if all(isinstance(value, float) for value in values):
            whole[f"number {name}"] = np.array(values)
            continue
        rows = [np.empty(0) if row is None else np.atleast_1d(row[name])
                for row in batch.found]  # fmt: skip
        whole[f"rows {name}"] = np.concatenate(rows)
        whole[f"begin {name}"] = np.cumsum([0, *(row.size for row in rows)])
    return whole
