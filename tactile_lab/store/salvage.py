"""The samples of one channel that a crash left behind, chunk by chunk."""

from __future__ import annotations

import zlib
from typing import Any

from numpy.typing import NDArray

from tactile_lab.store.folder import DATA
from tactile_lab.store.places import PLACES, chunks_at, read_places
from tactile_lab.store.run import Run
from tactile_lab.store.torn import rows_of


class Salvage:
    """Reads chunks that are as written, by HDF5's index or by the noted places.

    Attributes:
        size: samples in a full chunk.
    """

    def __init__(self, run: Run, name: str) -> None:
        self._samples, checks, _ = run.column(name)
        self._checks = rows_of(checks)
        self._places = read_places(run.path / PLACES)
        self._file, self._name = run.path / DATA, name
        self.size = int(self._samples.chunks[0])

    @property
    def samples(self) -> int:
        """Samples up to the first that cannot be had."""
        end = number = 0
        while (codes := self.chunk(number)) is not None:
            end, number = end + codes.size, number + 1
            if codes.size < self.size:
                break  # written when it was the last; what follows has no such place
        return end

    def chunk(self, number: int) -> NDArray[Any] | None:
        """Codes of a chunk, as many as hold; None where none do."""
        best = self._by_index(number)
        if best is not None and best.size == self.size:
            return best
        held = chunks_at(self._places, self._file, self._name, number, self._samples)
        found = [codes for codes in (best, *held) if codes is not None]
        return max(found, key=len, default=None)

    def _by_index(self, number: int) -> NDArray[Any] | None:
        if number >= self._checks.size:
            return None
        count, crc = self._checks[number].tolist()
        first = number * self.size
        if count == 0 or first + count > self._samples.shape[0]:
            return None
        try:
            codes: NDArray[Any] = self._samples[first : first + count]
        except (OSError, RuntimeError):
            return None
        return codes if zlib.crc32(codes.data) == crc else None
