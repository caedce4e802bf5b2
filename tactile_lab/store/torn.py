"""Reads a table of which a power cut left only parts on the disk."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

FLETCHER32 = 4
"""Bytes of HDF5's checksum behind a chunk of a table."""


def rows_of(dataset: h5py.Dataset) -> NDArray[Any]:
    """The rows of a table, as far as they reached the disk.

    The last chunk is written again and again as rows are appended. Cut in the middle
    of that, its checksum fails, yet each of its pages is either old or new, and rows
    are never changed: what is there is right, and what is not there is zero.
    """
    try:
        rows: NDArray[Any] = dataset[()]
    except OSError:
        rows = np.concatenate(
            [dataset[:0], *(_chunk(dataset, at) for at in _starts(dataset))]
        )
    return rows[: _written(rows)]


def _starts(dataset: h5py.Dataset) -> range:
    return range(0, dataset.shape[0], dataset.chunks[0])


def _chunk(dataset: h5py.Dataset, first: int) -> NDArray[Any]:
    """One chunk; its bytes as they lie there where the checksum fails."""
    count = min(dataset.chunks[0], dataset.shape[0] - first)
    try:
        rows: NDArray[Any] = dataset[first : first + count]
        return rows
    except OSError:
        pass
    try:
        _, raw = dataset.id.read_direct_chunk((first,))
    except (OSError, RuntimeError):
        return np.zeros(count, dataset.dtype)
    whole = np.frombuffer(raw[:-FLETCHER32], dataset.dtype)
    return whole[:count]


def _written(rows: NDArray[Any]) -> int:
    """Rows up to the last that is not all zero."""
    if rows.size == 0:
        return 0
    table = np.ascontiguousarray(rows).view(np.uint8).reshape(rows.size, -1)
    used = np.flatnonzero(table.any(axis=1))
    return int(used[-1]) + 1 if used.size else 0
