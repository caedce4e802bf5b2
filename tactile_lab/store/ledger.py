"""What goes into `data.h5`, entry by entry, in a file beside it that only grows.

HDF5 writes its tables and its index of chunks again and again in place. A power cut in
the middle of that takes what had long been on the disk. An entry here is written once,
behind all others, so that a cut can spoil only the newest. `recover` reads it.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tactile_lab.store.layout import RECORDS

CHUNK = np.dtype(
    [("offset", "<u8"), ("size", "<u4"), ("samples", "<u4"), ("crc32", "<u4")]
)
"""Entry of a chunk: where its bytes lie in `data.h5`, its samples and their CRC-32."""

DECLARED = "data.h5"
"""Name of the first entry."""

_HEAD = struct.Struct("<24sQI")  # dataset, first row or chunk, bytes that follow
_CRC = struct.Struct("<I")  # of head and bytes


class Ledger:
    """Writes a new ledger.

    Args:
        path: of the file, which does not exist yet.
        declared: `data.h5` with every dataset and attribute, still empty.
    """

    def __init__(self, path: Path, declared: bytes) -> None:
        self._file = path.open("xb")
        self._write(DECLARED, 0, declared)

    def note(self, dataset: str, first: int, rows: NDArray[Any]) -> None:
        """Note `rows` of a table from number `first` on, or a chunk's `CHUNK`."""
        self._write(dataset, first, rows.tobytes())

    def close(self) -> None:
        """Let go of the file."""
        self._file.close()

    def _write(self, dataset: str, first: int, data: bytes) -> None:
        head = _HEAD.pack(dataset.encode(), first, len(data))
        self._file.write(head + _CRC.pack(zlib.crc32(data, zlib.crc32(head))) + data)
        self._file.flush()


@dataclass(frozen=True)
class LedgerContents:
    """What a ledger says was written.

    Attributes:
        declared: see `Ledger`; empty where not even that was written, or can be read.
        rows: of each table.
        chunks: of each dataset of samples, by number: (offset, bytes, samples, CRC-32).
            One that was written again, fuller, has several, the newest last.
    """

    declared: bytes
    rows: dict[str, list[Any]]
    chunks: dict[str, dict[int, list[tuple[int, int, int, int]]]]


def read_ledger(path: Path) -> LedgerContents:
    """Read every entry that is as it was written; nothing where there is no file."""
    declared, records = b"", RECORDS
    rows: defaultdict[str, list[Any]] = defaultdict(list)
    chunks: defaultdict[str, Any] = defaultdict(lambda: defaultdict(list))
    for dataset, first, data in _entries(path) if path.exists() else ():
        if dataset == DECLARED:
            declared, records = data, _records(data)
        elif dataset in records:
            rows[dataset][first:] = np.frombuffer(data, records[dataset]).tolist()
        else:
            chunks[dataset][first] += np.frombuffer(data, CHUNK).tolist()
    return LedgerContents(declared, rows, chunks)


def _records(declared: bytes) -> dict[str, np.dtype[Any]]:
    """Types of the tables' rows as that file has them: those of an older version."""
    with h5py.File(io.BytesIO(declared), "r") as file:
        return {name: file[name].dtype for name in RECORDS if name in file}


def goes_on(path: Path) -> bool:
    """Whether more follows the first entry, even where that cannot be read."""
    if not path.exists():
        return False
    with path.open("rb") as file:
        head = file.read(_HEAD.size)
    first = _HEAD.unpack(head)[2] if len(head) == _HEAD.size else 0
    whole: int = _HEAD.size + _CRC.size + first
    return path.stat().st_size > whole


def _entries(path: Path) -> Iterator[tuple[str, int, bytes]]:
    """(dataset, first row or chunk, bytes) of each entry."""
    with path.open("rb") as file:
        while len(head := file.read(_HEAD.size + _CRC.size)) == _HEAD.size + _CRC.size:
            dataset, first, size = _HEAD.unpack_from(head)
            data = file.read(size)
            (crc,) = _CRC.unpack_from(head, _HEAD.size)
            if zlib.crc32(data, zlib.crc32(head[: _HEAD.size])) == crc:
                yield dataset.rstrip(b"\0").decode(), first, data
