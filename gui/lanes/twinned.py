"""The twin: what the model made of the force that was really applied, so far."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gui.lanes.decimate import Drawn, FloatArray
from gui.lanes.history import Track
from tactile_lab.acquisition.live import Bins


@dataclass(frozen=True, eq=False)
class TwinSlice:
    """What the twin did in one slice of time.

    Attributes:
        bins: signal -> its bins.
        spikes: times, ascending, s.
        end: time up to which the twin has come, s.
    """

    bins: dict[str, Bins]
    spikes: FloatArray
    end: float


class TwinTracks:
    """Slices put together, bounded as measured tracks are."""

    def __init__(self) -> None:
        self.end = 0.0
        self._tracks: dict[str, Track] = {}
        self._spikes: list[FloatArray] = []

    def add(self, part: TwinSlice) -> None:
        """Append the next slice."""
        for signal, bins in part.bins.items():
            self._tracks.setdefault(signal, Track()).add(bins)
        if part.spikes.size:
            self._spikes.append(part.spikes)
        self.end = part.end

    @property
    def spikes(self) -> FloatArray:
        """The twin's spikes so far, s."""
        if len(self._spikes) > 1:
            self._spikes = [np.concatenate(self._spikes)]
        return self._spikes[0] if self._spikes else np.empty(0)

    def knows(self, signal: str) -> bool:
        """Whether the twin computes a signal."""
        return signal in self._tracks

    def between(self, signal: str, start: float, end: float, count: int) -> Drawn:
        """The twin's signal, as far as it has come."""
        track = self._tracks.get(signal)
        if track is None or start >= self.end:
            return Drawn.nothing()
        return track.between(start, min(end, self.end), count)


def joined(one: Drawn, other: Drawn) -> Drawn:
    """One trace after another."""
    if one.empty:
        return other
    if other.empty:
        return one
    return Drawn(
        np.concatenate([one.time, other.time]),
        np.concatenate([one.low, other.low]),
        np.concatenate([one.high, other.high]),
        np.concatenate([one.mean, other.mean]),
        np.concatenate([one.gap, other.gap]),
    )
