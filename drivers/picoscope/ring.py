"""Memory a streaming PicoScope writes into, and the callback that copies out of it."""

from __future__ import annotations

import threading
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivers.picoscope.sdk import STREAMING_READY
from tactile_lab.errors import SamplesLostError


class StreamRing:
    """Registered ring buffers, one row per input, and samples copied out so far.

    Keep the object while the stream runs: the library holds its callback, which copies
    and nothing else. It may run within the poll (it does on all known ps3000a) or on a
    thread of the library's own.

    Args:
        bits: per row, the input's bit in the callback's overflow argument.
        samples: length of the ring, samples per row.
    """

    def __init__(self, bits: Sequence[int], samples: int) -> None:
        self.samples = samples
        self.callback = STREAMING_READY(self._ready)
        self.at_end = False
        """The last callback ended at the ring's end: more may wait from its start."""
        self.bits = tuple(bits)
        # written now: a page touched for the first time while samples come costs them
        self._ring = np.full((len(bits), samples), 0, dtype=np.int16)
        self._parts: list[NDArray[np.int16]] = []
        self._lock = threading.Lock()
        self.clear()

    def clear(self) -> None:
        """Make ready for a new stream."""
        with self._lock:
            self._parts = []
            self._filled = self._overflow = self._next = 0
            self._failure: BaseException | None = None

    def row(self, number: int) -> NDArray[np.int16]:
        """One row's ring, for the library to write into."""
        row: NDArray[np.int16] = self._ring[number]
        return row

    def take(self) -> tuple[NDArray[np.int16], tuple[bool, ...]] | None:
        """All samples copied out since the last time, and over-range flags per row."""
        with self._lock:
            if self._filled == 0:
                return None
            parts, self._parts = self._parts, []
            overrange = tuple(bool(self._overflow >> bit & 1) for bit in self.bits)
            self._filled, self._overflow = 0, 0
        codes = parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)
        return codes, overrange

    def failure(self) -> BaseException | None:
        """What went wrong in a callback since the last time, or None.

        An exception must not leave a C callback: ctypes would print and forget it.
        """
        error, self._failure = self._failure, None
        return error

    def _ready(
        self,
        handle: int,
        samples: int,
        start: int,
        overflow: int,
        trigger_at: int,
        triggered: int,
        auto_stop: int,
        parameter: int | None,
    ) -> None:
        try:
            with self._lock:
                self._copy(samples, start, overflow)
        except BaseException as error:
            self._failure = error

    def _copy(self, samples: int, start: int, overflow: int) -> None:
        if samples == 0:
            self.at_end = False
            return
        end = start + samples
        if samples < 0 or end > self.samples:
            raise SamplesLostError(
                f"The scope's library reported samples {start} to {end} in a ring of "
                f"{self.samples}; start again, and report this if it comes back."
            )
        # some libraries return to the start early when a part would not fit
        if start not in (self._next, 0):
            raise SamplesLostError(
                f"The scope's library jumped from ring index {self._next} to {start}: "
                "samples are missing. Relieve the computer or lower record.sample_rate."
            )
        self._parts.append(self._ring[:, start:end].copy())
        self._filled += samples
        self._overflow |= overflow
        self._next = end % self.samples
        self.at_end = end == self.samples
