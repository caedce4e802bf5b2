"""Growing datasets: rows as they come, samples in whole chunks."""

from __future__ import annotations

import zlib
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tactile_lab.errors import RecordingError
from tactile_lab.store.layout import BIN, CHECK, pyramid_record
from tactile_lab.store.ledger import CHUNK, Ledger

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


class SampleColumn:
    """One channel's codes with their checksums and pyramid, a chunk at a time."""

    def __init__(
        self, file: h5py.File, signal: str, ledger: Ledger | None = None
    ) -> None:
        samples = file[f"samples/{signal}"]
        self._file, self._dataset, self._ledger = file, samples.id, ledger
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
        offset = self._file.id.get_filesize()
        self._samples.put(self._first, held)
        number, crc = self._first // self._chunk.size, zlib.crc32(held.data)
        self._checks.put(number, np.array([(held.size, crc)], CHECK))
        if self._ledger is not None:
            self._note(self._ledger, number, offset, held.size, crc)
        self._bins = self._bins[: self._first // BIN - self._pyramid.length]
        self._bins = np.concatenate([self._bins, pyramid_of(held)])
        self.written = end
        if self._bins.size >= BINS_HELD and self._held == self._chunk.size:
            self.write_pyramid()

    def _note(
        self, ledger: Ledger, number: int, offset: int, samples: int, crc: int
    ) -> None:
        """Note where a chunk was written: where the file ended, at `offset`.

        HDF5 tells a chunk's place by going through all of them; for the first, before
        which it writes the channel's index, that is quick.
        """
        if number == 0:
            info = self._dataset.get_chunk_info_by_coord((0,))
            offset, size = info.byte_offset, info.size
        else:
            size = len(self._dataset.read_direct_chunk((self._first,))[1])
        entry = np.array([(offset, size, samples, crc)], CHUNK)
        ledger.note(f"samples/{self.signal}", number, entry)

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
