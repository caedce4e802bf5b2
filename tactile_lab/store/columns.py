"""Growing datasets: samples in whole chunks, records in batches."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tactile_lab.errors import RecordingError
from tactile_lab.store.layout import BIN, CHECK, pyramid_record

Wrote = Callable[[h5py.Dataset, int, int, int], None]

BINS_HELD = 2048
"""Entries of the pyramid that are written at once."""


class Column:
    """A growing one-dimensional dataset, written without h5py's general indexing.

    At a few writes per chunk that indexing would cost more than the compression.
    """

    def __init__(self, dataset: h5py.Dataset) -> None:
        self._id = dataset.id
        self._type = h5py.h5t.py_create(dataset.dtype, logical=True)
        self.length = int(dataset.shape[0])
        self.dtype = dataset.dtype

    def put(self, first: int, values: NDArray[Any]) -> None:
        """Write `values` from index `first` on; the dataset then ends after them."""
        end = first + values.size
        if end != self.length:
            self._id.set_extent((end,))
            self.length = end
        if values.size == 0:
            return
        place = self._id.get_space()
        place.select_hyperslab((first,), (values.size,))
        memory = h5py.h5s.create_simple((values.size,))
        self._id.write(memory, place, np.ascontiguousarray(values), self._type)


class Records:
    """One dataset of fixed records; buffered until `flush`."""

    def __init__(self, record: np.dtype[Any]) -> None:
        self._column: Column | None = None
        self._record = record
        self._waiting: list[Any] = []
        self._written = 0

    @property
    def count(self) -> int:
        """Records appended so far."""
        return self._written + len(self._waiting)

    def attach(self, dataset: h5py.Dataset) -> None:
        """Give records that came before the file a place."""
        self._column = Column(dataset)

    def append(self, *values: Any) -> None:
        """Add one record, fields in order."""
        self._waiting.append(values)

    def replace_last(self, *values: Any) -> None:
        """Overwrite the newest record."""
        if self._waiting:
            self._waiting[-1] = values
        elif self._column is not None:
            self._column.put(self._written - 1, np.array([values], self._record))

    def flush(self) -> None:
        """Write what waits."""
        if self._column is None or not self._waiting:
            return
        self._column.put(self._written, np.array(self._waiting, self._record))
        self._written += len(self._waiting)
        self._waiting = []


class SampleColumn:
    """One channel's codes with their checksums and pyramid, a chunk at a time.

    Args:
        file: with the channel declared.
        signal: its name.
        wrote: told each chunk's dataset, number, samples and CRC-32 once it is written.
    """

    def __init__(
        self, file: h5py.File, signal: str, wrote: Wrote | None = None
    ) -> None:
        samples = file[f"samples/{signal}"]
        self._dataset, self._wrote = samples, wrote
        self._samples = Column(samples)
        self._pyramid = Column(file[f"pyramid/{signal}"])
        self._checks = Column(file[f"checks/{signal}"])
        self.signal = signal
        self.narrow = samples.dtype == np.int8
        self._chunk = np.empty(samples.chunks[0], dtype=samples.dtype)
        self._bins = pyramid_of(self._chunk[:0])
        self._held = 0
        self._first = 0
        self.written = 0

    @property
    def count(self) -> int:
        """Samples taken so far, written or held back."""
        return self._first + self._held

    def append(self, codes: NDArray[np.int16]) -> bool:
        """Take codes, shape (n,); True where at least one chunk went to the file.

        Raises:
            RecordingError: a code does not fit the 8 bits the scope promised.
        """
        if self.narrow and codes.size and int(np.bitwise_or.reduce(codes)) & 0xFF:
            raise RecordingError(
                f"Codes of {self.signal} use more than the scope's upper 8 bits; "
                "storing them would lose data. Report the scope's resolution."
            )
        done, wrote = 0, False
        while done < codes.size:
            part = codes[done : done + self._chunk.size - self._held]
            room = self._chunk[self._held : self._held + part.size]
            if self.narrow:
                np.right_shift(part, 8, out=room, casting="unsafe")
            else:
                room[:] = part
            self._held += part.size
            done += part.size
            if self._held == self._chunk.size:
                self.write()
                self._first += self._held
                self._held = 0
                wrote = True
        return wrote

    def write(self) -> None:
        """Write what is held, full chunk or not; a fuller one replaces it later."""
        if self._first + self._held == self.written:
            return
        held, end = self._chunk[: self._held], self._first + self._held
        self._samples.put(self._first, held)
        number, crc = self._first // self._chunk.size, zlib.crc32(held.data)
        self._checks.put(number, np.array([(held.size, crc)], CHECK))
        if self._wrote is not None:
            self._wrote(self._dataset, number, held.size, crc)
        self._bins = self._bins[: self._first // BIN - self._pyramid.length]
        self._bins = np.concatenate([self._bins, pyramid_of(held)])
        self.written = end
        if self._bins.size >= BINS_HELD and self._held == self._chunk.size:
            self.write_pyramid()

    def write_pyramid(self) -> None:
        """Write the bins held back; a crash may cost them, for samples give them."""
        self._pyramid.put(self._pyramid.length, self._bins)
        self._bins = self._bins[:0]


def pyramid_of(codes: NDArray[Any]) -> NDArray[Any]:
    """Smallest, largest and sum of each `BIN` codes; the last entry may have fewer.

    Args:
        codes: shape (n,), int8 or int16.

    Returns:
        Shape (bins,), dtype `layout.pyramid_record`.
    """
    bins = np.empty(-(-codes.size // BIN), pyramid_record(codes.dtype))
    whole = codes.size // BIN
    cells = codes[: whole * BIN].reshape(whole, BIN)
    bins["low"][:whole] = cells.min(axis=1)
    bins["high"][:whole] = cells.max(axis=1)
    bins["sum"][:whole] = cells.sum(axis=1, dtype=np.int32)
    rest = codes[whole * BIN :]
    if rest.size:
        bins[-1] = (rest.min(), rest.max(), rest.sum(dtype=np.int32))
    return bins
