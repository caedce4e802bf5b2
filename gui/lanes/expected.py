"""What is expected of a run: the plan, the model, and where they really came to lie."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gui.lanes.phase import Phase
from tactile_lab.arrays import FloatArray
from tactile_lab.trace import Trace
from tactile_lab.trial import Trial
from tactile_lab.waveform import Waveform


@dataclass(frozen=True)
class Stretch:
    """A stretch of the run that has a name, such as "120 mN", in run time, s.

    Attributes:
        start, end: of the whole stretch.
        label: its name.
        pause: whether it is neither streamed nor stored.
        held: (start, end) of the part in which the force stands still, if it does.
    """

    start: float
    end: float
    label: str
    pause: bool = False
    held: tuple[float, float] | None = None

    @classmethod
    def of(cls, trial: Trial, start: float) -> Stretch:
        """A trial that starts at `start` s of the run."""
        held = trial.hold and (start + trial.hold[0], start + trial.hold[1])
        return cls(start, start + trial.length, trial.label, trial.pause, held)


def starts(holds: list[Stretch]) -> FloatArray:
    """When each of them starts, s."""
    return np.array([hold.start for hold in holds])


def settled(times: FloatArray, holds: list[Stretch]) -> np.ndarray:
    """Which of `times`, ascending, lie where the force stands still."""
    inside = np.zeros(times.size, dtype=bool)
    for hold in holds:
        if hold.held is not None and not hold.pause:
            first, last = np.searchsorted(times, hold.held)
            inside[first:last] = True
    return inside


@dataclass(eq=False)
class Preview:
    """What the model expects of the run.

    Attributes:
        force: N against run time.
        traces: signal -> (times, values).
        spikes: times, s.
        holds: named stretches.
        length: s.
    """

    force: Waveform
    traces: dict[str, tuple[FloatArray, FloatArray]] = field(default_factory=dict)
    spikes: FloatArray = field(default_factory=lambda: np.empty(0))
    holds: list[Stretch] = field(default_factory=list)
    length: float = 0.0


class Aligned:
    """A preview moved, trial by trial, to where the trials really started."""

    def __init__(self, preview: Preview) -> None:
        self.preview = preview
        self._planned = starts(preview.holds)
        self._offsets = np.zeros(max(len(preview.holds), 1))
        self._known = 0
        self._cache: dict[str, tuple[int, FloatArray]] = {}

    def begin(self, index: int, start: float) -> None:
        """Trial `index` really started at `start` s; later ones will be as late."""
        if index < self._planned.size:
            self._offsets[index:] = start - self._planned[index]
            self._known += 1

    @property
    def moves(self) -> int:
        """How many trials have started so far."""
        return self._known

    @property
    def length(self) -> float:
        """Expected length, s."""
        return self.preview.length + float(self._offsets[-1])

    def times(self, name: str, planned: FloatArray) -> FloatArray:
        """Planned times where they really are; kept under `name` until they move."""
        known, kept = self._cache.get(name, (-1, planned))
        if known == self._known:
            return kept
        if self._planned.size:
            at = np.searchsorted(self._planned, planned, side="right") - 1
            moved = planned + self._offsets[np.maximum(at, 0)]
            moved = np.maximum.accumulate(moved)
        else:
            moved = planned
        self._cache[name] = (self._known, moved)
        return moved

    def twin(
        self,
        signal: str,
        start: float,
        end: float,
        count: int,
        phase: Phase,
        since: float,
    ) -> Trace:
        """What the model has in [start, end] s, moved by `phase`, `since` a time on."""
        if signal not in self.preview.traces:
            return Trace.nothing()
        time, value = self.preview.traces[signal]
        time = self.times(signal, time)
        # a preview has up to 4e5 points: move only those that may come into view
        first, last = np.searchsorted(time, [start - phase.most, end + phase.most])
        near = slice(max(0, first - 1), last + 1)
        time, value = phase.moved(time[near]), value[near]
        seam = int(np.searchsorted(time, since))
        return Trace.line(time[seam:], value[seam:]).around(start, end).thin(count)

    @property
    def spikes(self) -> FloatArray:
        """The model's spikes."""
        return self.times("spikes", self.preview.spikes)

    def planned(self) -> tuple[FloatArray, FloatArray]:
        """Times and forces of the plan, N."""
        force = self.preview.force
        return self.times("force", force.time), force.value
