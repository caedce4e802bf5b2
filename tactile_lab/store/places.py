"""Where each chunk lies in `data.h5`, in a file that only grows.

HDF5 keeps these places in blocks that it writes again for each new chunk. A power cut
in the middle of that loses a block, and with it the way to chunks that are whole. A
record here is written once, behind all others, so a cut can only spoil the newest.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tactile_lab.store.layout import create_channel

PLACES = "places.bin"
"""Name in a run's folder; gone once the run has ended well."""

PLACE = np.dtype(
    [
        ("signal", "S16"), ("chunk", "<u4"), ("offset", "<u8"), ("size", "<u4"),
        ("samples", "<u4"), ("crc32", "<u4"), ("own", "<u4"),
    ]
)  # fmt: skip
"""A chunk of a channel, its bytes, its samples, and a CRC-32 of the record."""


class Places:
    """Notes where chunks are written.

    Args:
        path: of the file, which does not exist yet.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("xb", buffering=0)

    def note(
        self, signal: str, dataset: h5py.Dataset, chunk: int, samples: int, crc: int
    ) -> None:
        """Chunk number `chunk` of `signal` was just written."""
        first = chunk * dataset.chunks[0]
        info = dataset.id.get_chunk_info_by_coord((first,))
        record = np.zeros(1, PLACE)
        record[0] = (
            signal.encode(),
            chunk,
            info.byte_offset,
            info.size,
            samples,
            crc,
            0,
        )
        record["own"] = _own(record)
        self._file.write(record.tobytes())

    def close(self) -> None:
        """Let go of the file."""
        self._file.close()


def read_places(path: Path) -> NDArray[Any]:
    """The whole records in a file, dtype `PLACE`; none where there is no file."""
    if not path.exists():
        return np.empty(0, PLACE)
    data = path.read_bytes()
    records = np.frombuffer(data[: len(data) // PLACE.itemsize * PLACE.itemsize], PLACE)
    whole = [i for i in range(records.size) if records["own"][i] == _own(records[i])]
    return records[whole]


def chunks_at(
    places: NDArray[Any], path: Path, signal: str, chunk: int, like: h5py.Dataset
) -> Iterator[NDArray[Any]]:
    """Codes of one chunk, wherever it was written, newest first, checked by CRC-32.

    Args:
        places: from `read_places`.
        path: of `data.h5`.
        signal: the channel's name.
        chunk: its number.
        like: the channel's dataset, for type, chunk and filter.
    """
    mine = places[(places["signal"] == signal.encode()) & (places["chunk"] == chunk)]
    for place in mine[::-1]:
        with path.open("rb") as file:
            file.seek(int(place["offset"]))
            raw = file.read(int(place["size"]))
        codes = _decompressed(raw, like)[: int(place["samples"])]
        if codes.size and zlib.crc32(codes.data) == int(place["crc32"]):
            yield codes


def _decompressed(raw: bytes, like: h5py.Dataset) -> NDArray[Any]:
    """The codes of a chunk's bytes; empty where they are none."""
    with h5py.File("chunk", "w", driver="core", backing_store=False) as file:
        made = create_channel(file, "one", like.dtype, like.chunks[0])
        made.resize(like.chunks[0], axis=0)
        made.id.write_direct_chunk((0,), raw)
        try:
            codes: NDArray[Any] = made[()]
        except OSError:
            return np.empty(0, like.dtype)
        return codes


def _own(record: NDArray[Any]) -> int:
    """CRC-32 of a record without its last field."""
    return zlib.crc32(record.tobytes()[:-4])
