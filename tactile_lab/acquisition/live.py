"""The newest samples, decimated, for whoever watches: latest values win.

One writer (the deciding loop), any number of readers. Each bin keeps minimum, maximum
and mean, so no spike is invisible and averaging stays honest. Readers copy; a reader
that is too slow loses old bins from the picture, never from the record.
"""

from __future__ import annotations

import threading

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.pyramid import Level
from tactile_lab.scope import Block, Channel, Stream
from tactile_lab.trace import Trace

BIN = 1e-3
"""Length of one bin, s (at least one sample)."""

CAPACITY = 1 << 17
"""Bins kept per channel: 131 s at 1 ms."""


class LiveBins:
    """The newest bins of each channel."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._channels: tuple[Channel, ...] = ()
        self._levels: list[Level] = []
        self._per_bin = 1
        self._interval = 0.0
        self._start = 0.0
        self._gapless = True
        self._scale = np.empty((2, 0, 1))
        self._rest: NDArray[np.int16] = np.empty((0, 0), np.int16)
        self._next_time = 0.0

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of the measured signals, in channel order."""
        return tuple(channel.signal for channel in self._channels)

    @property
    def reach(self) -> float:
        """Run time up to which there are bins, s; 0 before any."""
        return self._next_time

    @property
    def gapless(self) -> bool:
        """Whether the scope streams without gaps."""
        return self._gapless

    def begin(self, stream: Stream, start: float) -> None:
        """Start a segment whose first sample is at `start` s on the run's axis."""
        with self._lock:
            if stream.channels != self._channels:
                self._channels = stream.channels
                self._levels = [
                    Level(CAPACITY, channel.signal) for channel in stream.channels
                ]
            self._interval = stream.interval
            self._per_bin = max(1, round(BIN / stream.interval))
            rows = range(len(stream.channels))
            scale = [stream.volts_per_code(row) for row in rows]
            self._scale = np.array(scale).T[:, :, np.newaxis]
            self._rest = np.empty((len(stream.channels), 0), np.int16)
            self._next_time = self._start = start
            self._gapless = stream.gapless

    def add(self, block: Block) -> None:
        """Decimate a block; where the stream has gaps, no bin reaches across blocks."""
        if not self._gapless:
            self._next_time = self._start + block.first * self._interval
        codes = block.codes
        if self._rest.shape[1]:
            codes = np.concatenate([self._rest, codes], axis=1)
        whole = codes.shape[1] // self._per_bin * self._per_bin
        self._write(codes[:, :whole], self._per_bin)
        self._rest = codes[:, whole:].copy()
        if not self._gapless:
            self._write(self._rest, self._rest.shape[1])
            self._rest = self._rest[:, :0]

    def _write(self, codes: NDArray[np.int16], per_bin: int) -> None:
        """Append bins of `per_bin` samples each."""
        if codes.shape[1] == 0:
            return
        bins = codes.shape[1] // per_bin
        cells = codes.reshape(codes.shape[0], bins, per_bin)
        low, high = cells.min(axis=2), cells.max(axis=2)
        # twice as fast as a mean; int32 holds the sum of 65535 codes
        kind = np.int32 if per_bin < 1 << 16 else np.int64
        mean = cells.sum(axis=2, dtype=kind) / np.float32(per_bin)
        width = per_bin * self._interval
        time = self._next_time + width * np.arange(bins)
        whole = self._per_bin * self._interval
        gain, offset = self._scale
        low, high, mean = np.stack([low, high, mean]) * gain + offset
        gap = np.arange(bins) == 0
        with self._lock:
            for row, level in enumerate(self._levels):
                level.add(Trace(time, low[row], high[row], mean[row], gap, whole))
            self._next_time += bins * width

    def since(self, written: int, signal: str) -> Trace:
        """Bins of `signal` from number `written` on, as far as they are still kept.

        Raises:
            KeyError: the signal is not measured.
        """
        if signal not in self.signals:
            raise KeyError(signal)
        with self._lock:
            return self._levels[self.signals.index(signal)].since(written)

    def fresh(self, written: int) -> tuple[int, dict[str, Trace]]:
        """Number of bins written, and of each signal those from `written` on."""
        with self._lock:
            count = self._levels[0].count if self._levels else 0
            first = written if count >= written else 0
            if first == count:
                return count, {}
            pairs = zip(self._channels, self._levels, strict=True)
            return count, {one.signal: level.since(first) for one, level in pairs}

    def mean(self, signal: str, start: float, end: float) -> tuple[float, float] | None:
        """From when on, s, what is in [start, end) s is still kept, and its mean.

        None where the signal is not measured or nothing of it is kept.
        """
        if signal not in self.signals:
            return None
        kept = self.between(start, end, signal)
        if kept.time.size == 0:
            return None
        return float(kept.time[0]), float(kept.mean.mean())

    def levels(self, start: float, end: float) -> dict[str, float]:
        """Mean of each measured signal over [start, end) s, where there is any."""
        means = {signal: self.mean(signal, start, end) for signal in self.signals}
        return {signal: seen[1] for signal, seen in means.items() if seen is not None}

    def traces(
        self, start: float, end: float, points: int = 4000
    ) -> dict[str, FloatArray]:
        """Each measured signal over [start, end) s, thinned to at most `points` means.

        Returns:
            Shape (n, 2) by name: s after `start`, SI unit.
        """
        found = {}
        for signal in self.signals:
            bins = self.between(start, end, signal)
            every = max(1, -(-bins.time.size // points))
            time = bins.time[::every] + bins.width / 2 - start
            found[signal] = np.column_stack([time, bins.mean[::every]])
        return found

    def between(self, start: float, end: float, signal: str) -> Trace:
        """Bins of `signal` that start in [start, end) s on the run's axis."""
        return self.since(0, signal).cut(start, end)
