"""Readings of a slow signal that is wired to a scope channel: field or temperature."""

from __future__ import annotations

import numpy as np

from tactile_lab.bench import Reading
from tactile_lab.errors import LimitError
from tactile_lab.quantity import show
from tactile_lab.scope import Block, Stream
from tactile_lab.signals import FIELD_AVERAGING, SIGNALS

FULL = 0.95
"""Part of the channel's range beyond which a mean is no reading any more."""


class ChannelMean:
    """Means of one channel of a stream, each over `FIELD_AVERAGING`.

    A reading ends with its record where a scope has gaps between records.

    Args:
        stream: as it runs.
        start: of its first sample on the run's axis, s.
        signal: that the channel carries.
    """

    def __init__(self, stream: Stream, start: float, signal: str) -> None:
        self._row = [channel.signal for channel in stream.channels].index(signal)
        self._stream = stream
        self._start = start
        self._span = max(1, round(FIELD_AVERAGING / stream.interval))
        self._sum = 0
        self._count = 0
        self._first = 0

    def feed(self, block: Block) -> list[Reading]:
        """Readings completed by `block`, each at the middle of its time, SI.

        Raises:
            LimitError: the signal leaves, or nearly fills, its channel's range.
        """
        if block.overrange[self._row]:
            raise self._beyond()
        readings = []
        if not self._count:
            self._first = block.first
        codes = block.codes[self._row]
        while codes.size:
            part = codes[: self._span - self._count]
            codes = codes[part.size :]
            self._sum += int(part.sum(dtype=np.int64))
            self._count += part.size
            if self._count == self._span:
                readings.append(self._reading())
        if self._count and not self._stream.gapless:
            readings.append(self._reading())
        return readings

    def _reading(self) -> Reading:
        code = self._sum / self._count
        middle = self._first + (self._count - 1) / 2
        self._first += self._count
        self._sum = self._count = 0
        if abs(code) > FULL * self._stream.full_scale:
            raise self._beyond()
        gain, offset = self._stream.volts_per_code(self._row)
        time = self._start + middle * self._stream.interval
        return Reading(time, gain * code + offset)

    def _beyond(self) -> LimitError:
        channel = self._stream.channels[self._row]
        unit = SIGNALS[channel.signal].unit
        low, high = (show(end, unit) for end in channel.span)
        more = (
            ", or of the teslameter; the latter changes tesla_per_volt"
            if channel.signal == "field"
            else ""
        )
        return LimitError(
            f"The {channel.signal} fills the range of scope input {channel.input}, "
            f"{low} to {high}. Choose a larger range of the channel in the bench "
            f"file{more}."
        )
