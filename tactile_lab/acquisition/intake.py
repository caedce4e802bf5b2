"""Where blocks go: detection on line, the live picture, the recorder. In that order."""

from __future__ import annotations

import math
from bisect import bisect_left
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_lab.acquisition.channel_mean import ChannelMean
from tactile_lab.acquisition.journal import Journal
from tactile_lab.acquisition.live import LiveBins
from tactile_lab.arrays import FloatArray
from tactile_lab.bench import Reading
from tactile_lab.errors import SamplesLostError, SurplusError
from tactile_lab.quantity import show
from tactile_lab.scope import CLOCK_ERROR, Block, Stream
from tactile_lab.signals import AVERAGED

if TYPE_CHECKING:  # compiled code, which a run without spikes does not load
    from tactile_lab.spikes.detector import Detector, ResetDetector

LAG_WINDOW = 1.0
"""Time over which the least lag of the samples behind this computer's clock is taken:
how long transfer takes differs from block to block, s."""

AHEAD = 3
"""Samples by which a stream may seem ahead of this computer's clock."""


class FoundSpikes(NamedTuple):
    """Spikes found in a block.

    Attributes:
        times: s on the run's axis, ascending.
        amplitudes: of each, V.
    """

    times: tuple[float, ...]
    amplitudes: tuple[float, ...]


NONE_FOUND = FoundSpikes((), ())


class Intake:
    """Takes each block once, in order, and accounts for it.

    Attributes:
        spikes: number of spikes so far.
        searched: whether spikes were looked for.
        produced: samples per channel the scope delivered.
        late: by how much more the samples' times lag behind this computer's clock than
            when the stream began, as the scope's clock is another one, s; never more
            than two clocks part.
    """

    def __init__(self, live: LiveBins) -> None:
        self._live = live
        self._row, self._scale = 0, (1.0, 0.0)
        self._journal: Journal | None = None
        self._detector: Detector | ResetDetector | None = None
        self._stream: Stream | None = None
        self._means: dict[str, ChannelMean] = {}
        self._readings: list[tuple[str, Reading]] = []
        self._start = 0.0
        self._expected = 0
        self.spikes, self.searched = 0, False
        self._spike_times: list[float] = []
        self.produced = 0
        self.late = 0.0
        self._least_lag = math.inf
        self._surplus = False
        self._lag_at_begin: float | None = None
        self._lags_since = 0.0
        self.overrange: dict[str, float] = {}
        """By signal that left its channel's range: until when at the latest, s."""

    @property
    def streaming(self) -> bool:
        """Whether blocks are taken."""
        return self._stream is not None

    @property
    def reached(self) -> float:
        """Run time just past the newest sample, s."""
        interval = self._stream.interval if self._stream else 0.0
        return self._start + self._expected * interval

    def sampled(self, time: float) -> float:
        """What the samples' clock shows at run time `time` s, about now, s."""
        return time - self.late

    def cut_off(self, since: float) -> frozenset[str]:
        """Signals that left their channel's range after `since` s of run time."""
        left = (name for name, until in self.overrange.items() if until > since)
        return frozenset(left)

    def lacks(self, time: float) -> float:
        """How much is still to come of the samples up to run time `time` s, s."""
        return self.sampled(time) - self.reached

    def begin(
        self,
        stream: Stream,
        start: float,
        journal: Journal,
        detector: Detector | ResetDetector | None = None,
        row: int = 0,
        scale: tuple[float, float] = (1.0, 0.0),
    ) -> None:
        """A stream starts.

        Args:
            stream: as it runs.
            start: of its first sample on the run's axis, s.
            journal: stores what comes.
            detector: finds spikes; None where none are searched.
            row: of each block that is searched.
            scale: gain and offset, V, of a spike's amplitude in codes.
        """
        self._row, self._scale = row, scale
        self._stream, self._start, self._expected = stream, start, 0
        self._detector, self._journal = detector, journal
        self.searched = detector is not None
        self.late, self._least_lag, self._lag_at_begin = 0.0, math.inf, None
        self._lags_since, self._surplus = start, False
        self._means = {
            channel.signal: ChannelMean(stream, start, channel.signal)
            for channel in stream.channels
            if channel.signal in AVERAGED
        }
        self._live.begin(stream, start)
        journal.segment(stream, start)

    def add(self, block: Block) -> FoundSpikes:
        """Take a block; the spikes it completed.

        Raises:
            SamplesLostError: samples between this block and the last are missing,
                though the scope streams without gaps.
            SurplusError: there are more than time went by for, by then all stored and
                searched; told once a stream.
        """
        if self._stream is None or self._journal is None:
            raise SamplesLostError("A block arrived although no stream runs.")
        missing = block.first - self._expected
        if missing and (self._stream.gapless or missing < 0):
            raise SamplesLostError(
                f"{missing} samples are missing before sample {block.first}: the "
                "scope or its driver lost them. Lower the rate."
            )
        self._expected = block.first + block.samples
        self.produced += block.samples
        if self._stream.gapless:
            self._note_lag(block.received - self._stream.started, self._stream.interval)
        for channel, over in zip(self._stream.channels, block.overrange, strict=True):
            if over:
                self.overrange[channel.signal] = self.reached
        self._journal.append(block)
        self._live.add(block)
        for signal, mean in self._means.items():
            self._readings += [(signal, reading) for reading in mean.feed(block)]
        found = NONE_FOUND
        if self._detector is not None:
            codes = block.codes[self._row]
            found = self._keep(self._detector.feed(block.first, codes))
        self._refuse_surplus(self._stream, block.received)
        return found

    def take_readings(self) -> list[tuple[str, Reading]]:
        """Readings of slow channels since last asked; times on the run's axis."""
        taken, self._readings = self._readings, []
        return taken

    def spikes_between(self, start: float, end: float) -> FloatArray:
        """Times of remembered spikes in [start, end) s on the run's axis.

        One that has begun and is not over is among them.
        """
        times = self._spike_times + self._begun
        return np.array(times[bisect_left(times, start) : bisect_left(times, end)])

    @property
    def _begun(self) -> list[float]:
        """Time of the spike that is not yet over, s, if there is one."""
        if self._detector is None or self._stream is None:
            return []
        sample = self._detector.begun
        return [] if sample is None else [self._start + sample * self._stream.interval]

    def forget_spikes_before(self, time: float) -> None:
        """Let go of spikes that no trial to come can ask for."""
        del self._spike_times[: bisect_left(self._spike_times, time)]

    def end(self, time: float) -> FoundSpikes:
        """The stream ended at run time `time`, s; the spike still open, if any."""
        if self._stream is not None and self._journal is not None:
            # a scope that was never polled has seen nothing, at no time
            polled = time > self.reached and not self._stream.gapless
            unseen = (
                round((time - self.reached) / self._stream.interval) if polled else 0
            )
            if unseen > 0:
                self._journal.gap(unseen)
        found = NONE_FOUND
        if self._detector is not None:
            found = self._keep(self._detector.flush())
        self._stream, self._detector = None, None
        return found

    def _refuse_surplus(self, stream: Stream, received: float) -> None:
        """Transfer only makes samples late: none comes before it was taken."""
        elapsed = received - stream.started
        ahead = self._expected * stream.interval - elapsed
        allowed = stream.uncertainty + AHEAD * stream.interval + CLOCK_ERROR * elapsed
        if not stream.gapless or self._surplus or ahead <= allowed:
            return
        self._surplus = True
        raise SurplusError(
            f"Too many samples: the scope delivered {self._expected} a channel within "
            f"{elapsed:.3f} s, {round(ahead / stream.interval)} more than it takes in "
            f"that time at {show(1 / stream.interval, 'S/s')}. Its clock is fast by "
            f"more than {CLOCK_ERROR * 1e6:.0f} ppm, or it or its driver repeats "
            "samples, so when they were taken is not known. Measure a known frequency "
            "with it; use another scope or driver if that is wrong."
        )

    def _note_lag(self, elapsed: float, interval: float) -> None:
        """Follow the scope's clock: the newest samples came `elapsed` s after it began.

        Records with gaps are dated one by one, so that nothing adds up.
        """
        streamed = self._expected * interval
        self._least_lag = min(self._least_lag, elapsed - streamed)
        if self.reached - self._lags_since < LAG_WINDOW:
            return
        least, self._least_lag = self._least_lag, math.inf
        self._lags_since = self.reached
        if self._lag_at_begin is None:
            self._lag_at_begin = least
        most = CLOCK_ERROR * streamed
        self.late = min(max(least - self._lag_at_begin, -most), most)

    def _keep(self, found: NDArray[np.void]) -> FoundSpikes:
        if found.size == 0 or self._stream is None or self._journal is None:
            return NONE_FOUND
        times = self._start + found["sample"] * self._stream.interval
        self._journal.spikes(times, found)
        new: list[float] = times.tolist()
        self._spike_times.extend(new)
        self.spikes += len(new)
        gain, offset = self._scale
        volts = found["amplitude"] * gain + offset
        return FoundSpikes(tuple(new), tuple(volts.tolist()))
