"""The last minute of a stream in memory: a journal that forgets, until asked to keep.

One writer (the deciding loop), any number of keepers in threads of their own.
"""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass, replace
from typing import Any

from numpy.typing import NDArray

from tactile_lab.acquisition.alignment import align
from tactile_lab.acquisition.journal import Journal
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import RecordingError
from tactile_lab.scope import Block, Stream

Spikes = tuple[FloatArray, NDArray[Any]]


@dataclass(frozen=True)
class RingContents:
    """What the ring held at one moment; times on the run's axis, s.

    Attributes:
        stream: how the samples are scaled.
        start: of the first sample held.
        blocks: in order, with gaps between them where the scope has some.
        spikes: detected among them.
        field: (time, T) read meanwhile.
        events: (time, kind, text).
    """

    stream: Stream
    start: float
    blocks: tuple[Block, ...]
    spikes: tuple[Spikes, ...]
    field: tuple[tuple[float, float], ...]
    events: tuple[tuple[float, str, str], ...]

    @property
    def samples(self) -> int:
        """Samples per channel."""
        return sum(block.samples for block in self.blocks)

    @property
    def begun(self) -> float:
        """Clock time of the first sample held, s."""
        return self.stream.started + self.blocks[0].first * self.stream.interval

    @property
    def length(self) -> float:
        """Duration, s, gaps between records included."""
        first, last = self.blocks[0], self.blocks[-1]
        return (last.first + last.samples - first.first) * self.stream.interval

    def replay(self, journal: Journal) -> None:
        """Tell it all to a journal whose time begins with the first sample held."""
        first = self.blocks[0].first
        journal.segment(replace(self.stream, started=self.begun), 0.0)
        for block in self.blocks:
            journal.append(replace(block, first=block.first - first))
        for times, found in self.spikes:
            inside = found["sample"] >= first
            moved = found[inside].copy()
            moved["sample"] -= first
            journal.spikes(times[inside] - self.start, moved)
        for time, value in self.field:
            journal.field(time - self.start, value)
        for time, kind, text in self.events:
            journal.event(max(time - self.start, 0.0), kind, text)
        if not self.stream.gapless:
            return
        told = align((), 0.0, self.length, self.stream.uncertainty)
        journal.align(
            offset=told.offset, drift=told.drift, uncertainty=told.uncertainty
        )


class Ring(Journal):
    """Holds the newest samples and what happened meanwhile.

    Args:
        length: how much it holds, s.
    """

    def __init__(self, length: float) -> None:
        self.length = length
        self._lock = threading.Lock()
        self._stream: Stream | None = None
        self._zero = 0.0
        self._blocks: deque[Block] = deque()
        self._spikes: deque[Spikes] = deque()
        self._field: deque[tuple[float, float]] = deque()
        self._events: list[tuple[float, str, str]] = []

    def held(self) -> RingContents:
        """All it holds now.

        Raises:
            RecordingError: nothing has been streamed yet.
        """
        with self._lock:
            if self._stream is None or not self._blocks:
                raise RecordingError("Nothing to keep: no sample has come yet.")
            return RingContents(
                self._stream,
                self._time(self._blocks[0].first),
                tuple(self._blocks),
                tuple(self._spikes),
                tuple(self._field),
                tuple(self._events),
            )

    def segment(self, stream: Stream, start: float) -> None:
        """A stream starts anew; what came before it is forgotten."""
        with self._lock:
            self._stream, self._zero = stream, start
            self._blocks.clear()
            self._spikes.clear()

    def append(self, block: Block) -> None:
        """Hold a block, and forget those that are older than the ring is long."""
        with self._lock:
            self._blocks.append(block)
            oldest = self._time(block.first + block.samples) - self.length
            while self._time(self._blocks[0].first + self._blocks[0].samples) <= oldest:
                self._blocks.popleft()
            first = self._time(self._blocks[0].first)  # of samples that stay
            while self._spikes and self._spikes[0][0][-1] < first:
                self._spikes.popleft()
            while self._field and self._field[0][0] < oldest:
                self._field.popleft()

    def spikes(self, times: FloatArray, found: NDArray[Any]) -> None:
        """Hold spikes."""
        with self._lock:
            self._spikes.append((times, found))

    def field(self, time: float, field: float) -> None:
        """Hold a reading, T."""
        with self._lock:
            self._field.append((time, field))

    def event(self, time: float, kind: str, text: str) -> None:
        """Hold what happened; the few events of a monitor are all held."""
        with self._lock:
            self._events.append((time, kind, text))

    def _time(self, sample: int) -> float:
        assert self._stream is not None
        return self._zero + sample * self._stream.interval
