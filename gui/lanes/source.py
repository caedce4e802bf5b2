"""Where lanes take their data from: a run in progress or a run on disk, alike."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from gui.lanes.decimate import Drawn, FloatArray
from gui.lanes.expected import Aligned, Hold, Preview, settled
from gui.lanes.history import SlowTrack, Track
from gui.lanes.phase import Phase, phase
from gui.lanes.twinned import TwinTracks, joined
from tactile_lab.acquisition.live import Bins

OSCILLATING = frozenset({"V_C2", "V_K"})
"""Signals that go with the spikes; the others go with the force."""


class Source(Protocol):
    """What a lane may ask for. All times are on the run's axis, s; values are SI."""

    @property
    def reach(self) -> float:
        """Time up to which there is data."""
        ...

    @property
    def length(self) -> float:
        """Time the whole run takes or took."""
        ...

    @property
    def running(self) -> bool:
        """Whether data still comes in."""
        ...

    @property
    def followed(self) -> float:
        """Time up to which the model is that of the force that was applied."""
        ...

    @property
    def holds(self) -> list[Hold]:
        """Named stretches, ascending."""
        ...

    @property
    def spikes(self) -> FloatArray:
        """Times of detected spikes, ascending."""
        ...

    @property
    def twin_spikes(self) -> FloatArray:
        """Times of the twin's spikes, ascending."""
        ...

    def trace(self, signal: str, start: float, end: float, count: int) -> Drawn:
        """The measured signal in about `count` columns."""
        ...

    def twin(self, signal: str, start: float, end: float, count: int) -> Drawn:
        """The same signal as the model has it, also ahead of the data."""
        ...

    def planned(self, start: float, end: float) -> tuple[FloatArray, FloatArray]:
        """Times and forces of the plan, N."""
        ...


class LiveSource:
    """A run in progress: remembers all it is told, decimated.

    Args:
        preview: the model's expectation; None until it is known.
        newtons_per_ampere: turns coil current into force.
    """

    def __init__(self, preview: Preview | None, newtons_per_ampere: float) -> None:
        self.preview = preview
        self.aligned = None if preview is None else Aligned(preview)
        self.tracks = TwinTracks()
        self.running = True
        self.holds: list[Hold] = []
        self._phase = Phase.none()
        self._carried: tuple[object, ...] = ()
        self._twin_spikes = np.empty(0)
        self._gain = newtons_per_ampere
        self._loop: list[tuple[float, float, float]] = []
        self._new = False
        self._tracks: dict[str, Track] = {}
        self._slow = {name: SlowTrack() for name in ("force", "field")}
        self._spikes = np.empty(1024)
        self._spike_count = 0

    @property
    def reach(self) -> float:
        """Time up to which there is data, s."""
        ends = [track.end for track in self._tracks.values()]
        slow = max(track.end for track in self._slow.values())
        return max(ends) if ends else slow

    @property
    def length(self) -> float:
        """Expected length, or the reach where that is longer, s."""
        planned = self.aligned.length if self.aligned and self.running else 0.0
        return max(planned, self.reach, 1.0)

    @property
    def followed(self) -> float:
        """Where the twin has come to; without a twin the plan has to do, s."""
        return self.tracks.end or self.reach

    @property
    def spikes(self) -> FloatArray:
        """Detected so far."""
        return self._spikes[: self._spike_count]

    @property
    def twin_spikes(self) -> FloatArray:
        """The twin's so far, then the plan's, carried on from the twin's last."""
        self._carry_on()
        return self._twin_spikes

    def _carry_on(self) -> Phase:
        """Move the planned oscillation to where the twin's has come, if that is new."""
        aligned, tracks = self.aligned, self.tracks
        if aligned is None:
            self._twin_spikes = tracks.spikes
            return self._phase
        as_of = (tracks, tracks.end, aligned.moves)
        if as_of != self._carried:
            known, planned = tracks.spikes, aligned.spikes
            if known.size:
                self._phase = phase(planned, float(known[-1]))
            ahead = self._phase.moved(planned)
            self._twin_spikes = np.concatenate([known, ahead[ahead > tracks.end]])
            self._carried = as_of
        return self._phase

    def add_bins(self, bins: dict[str, Bins]) -> None:
        """The newest samples by signal."""
        for signal, part in bins.items():
            self._tracks.setdefault(signal, Track()).add(part)
            self._new = self._new or part.time.size > 0

    def take_new(self) -> bool:
        """Whether samples have come since this was last asked."""
        new, self._new = self._new, False
        return new

    def add_spikes(self, times: tuple[float, ...]) -> None:
        """Detected spikes, ascending."""
        need = self._spike_count + len(times)
        if need > self._spikes.size:
            self._spikes = np.concatenate([self._spikes, np.empty(max(need, 1024))])
        self._spikes[self._spike_count : need] = times
        self._spike_count = need

    def add_current(self, time: float, amperes: float) -> None:
        """A read-back of the coil."""
        self._slow["force"].add(time, amperes * self._gain)

    def add_field(self, time: float, tesla: float) -> None:
        """A reading of the teslameter."""
        self._slow["field"].add(time, tesla)
        force = self._slow["force"].last
        if force is not None and len(self._loop) < 50_000:
            self._loop.append((time, force / self._gain, tesla))

    @property
    def loop(self) -> FloatArray:
        """Shape (n, 2): coil current, A, and the field read then, T; on steps only."""
        found = np.array(self._loop, dtype=np.float64).reshape(-1, 3)
        return found[settled(found[:, 0], self.holds), 1:]

    def begin_trial(self, index: int, hold: Hold) -> None:
        """A trial starts; the preview is moved to where it really starts."""
        if not self.holds or self.holds[-1].start < hold.start:
            self.holds.append(hold)
        if self.aligned is not None:
            self.aligned.begin(index, hold.start)

    def trace(self, signal: str, start: float, end: float, count: int) -> Drawn:
        """The measured signal; the force holds from each set-point to the next."""
        if signal in self._slow and signal not in self._tracks:
            hold = self.reach if signal == "force" else None
            return self._slow[signal].between(start, end, count, hold)
        track = self._tracks.get(signal)
        return Drawn.nothing() if track is None else track.between(start, end, count)

    def mean(self, signal: str) -> float | None:
        """Mean of the newest bins; None without any."""
        if signal in self._slow and signal not in self._tracks:
            return self._slow[signal].last
        track = self._tracks.get(signal)
        return None if track is None or track.mean != track.mean else track.mean

    def twin(self, signal: str, start: float, end: float, count: int) -> Drawn:
        """The twin under the applied current so far, then what the plan expects."""
        found = self.tracks.between(signal, start, end, count)
        if self.aligned is None or end <= self.tracks.end:
            return found
        how = self._carry_on() if signal in OSCILLATING else Phase.none()
        since = self.tracks.end
        if since > 0 and not self.tracks.knows(signal):
            since = max(since, self.reach)  # no plan over data without a twin beside it
        ahead = self.aligned.twin(signal, start, end, count, how, since)
        return joined(found, ahead)

    def planned(self, start: float, end: float) -> tuple[FloatArray, FloatArray]:
        """The planned force."""
        if self.aligned is None:
            return np.empty(0), np.empty(0)
        return self.aligned.planned()
