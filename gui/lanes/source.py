"""Where lanes take what they show from: a plan, a run in progress, a run on disk.

All times are on the run's axis, s; values are SI unless a lane's unit is asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gui.lanes.expected import Aligned, Preview, Stretch, settled, starts
from gui.lanes.lane import Lane
from gui.lanes.phase import Phase, phase
from gui.lanes.rate import rate_of
from gui.lanes.twin import TwinTraces
from tactile_lab.arrays import FloatArray
from tactile_lab.pyramid import Pyramid
from tactile_lab.signals import AVERAGED
from tactile_lab.trace import Trace

if TYPE_CHECKING:
    from gui.lanes.view import TimeView

OSCILLATING = frozenset({"V_C2", "V_K"})
"""Signals that go with the spikes; the others go with the force."""

NEWEST = 50
"""Bins that the newest value is the mean of."""

READINGS = 200_000
"""Readings of a slow signal kept; of more, every other older one is dropped."""

NONE = np.empty(0)


class Source:
    """What a lane may ask for; by itself empty, as before anything is opened.

    Attributes:
        signals: what has a lane, force and spikes included.
        simulated: whether any of it is computed physics.
        path: folder of a run on disk.
    """

    signals: Sequence[str] = ()
    simulated = False
    path: Path | None = None

    @property
    def has_model(self) -> bool:
        """Whether a model is beside the data."""
        return False

    @property
    def reach(self) -> float:
        """Time up to which there is data."""
        return 0.0

    @property
    def length(self) -> float:
        """Time the whole run takes or took."""
        return 5.0

    @property
    def running(self) -> bool:
        """Whether data still comes in."""
        return False

    @property
    def followed(self) -> float:
        """Time up to which the model is that of the force that was applied."""
        return self.reach

    @property
    def holds(self) -> list[Stretch]:
        """Named stretches, ascending."""
        return []

    @property
    def spikes(self) -> FloatArray:
        """Times of detected spikes, ascending."""
        return NONE

    @property
    def twin_spikes(self) -> FloatArray:
        """Times of the twin's spikes, ascending."""
        return NONE

    @property
    def notes(self) -> list[tuple[float, str]]:
        """What people noted, and at which time, s."""
        return []

    @property
    def threshold(self) -> float | None:
        """Level of V_K, V, at which spikes were counted; None where none is known."""
        return None

    def beyond(self, signal: str) -> FloatArray:
        """Stretches in which a signal's input left its range, shape (k, 2), s."""
        return NONE.reshape(0, 2)

    def read_notes(self) -> None:
        """Read anew what people noted; nothing where there is no run on disk."""

    @property
    def members(self) -> Sequence[Member]:
        """The runs it shows in each lane: itself, or those it compares."""
        return (Member("", self),)

    def measured(self, signal: str, start: float, end: float, count: int) -> Trace:
        """A signal that was measured, in about `count` cells."""
        return Trace.nothing()

    def modelled(self, signal: str, start: float, end: float, count: int) -> Trace:
        """A signal as the model has it, also ahead of the data."""
        return Trace.nothing()

    def planned(self, start: float, end: float) -> tuple[FloatArray, FloatArray]:
        """Times and forces of the plan, N."""
        return NONE, NONE

    def take_fetched(self) -> bool:
        """Whether samples have arrived since this was last asked."""
        return False

    def close(self) -> None:
        """Let go of files."""

    # --- what lanes show

    def trace(self, key: str, start: float, end: float, count: int) -> Trace:
        """What a lane shows of the run: a signal, its residual, the rate."""
        if key == "rate":
            return rate_of(self.spikes, start, end, count, starts(self.holds))
        if key != "residual":
            return self.measured(key, start, end, count)
        # ahead of the twin is the plan: measured less that is no error of the model
        end = max(start, min(end, self.followed))
        model = self.twin("V_C1", start, end, 4 * count)
        return self.measured("V_C1", start, end, count).residual(model)

    def twin(self, key: str, start: float, end: float, count: int) -> Trace:
        """The same as the model has it."""
        if key == "rate":
            return rate_of(self.twin_spikes, start, end, count, starts(self.holds))
        return self.modelled(key, start, end, count)

    def shown(self, lane: Lane, start: float, end: float, count: int) -> list[Trace]:
        """Each member's trace in a lane's unit, on the common time."""
        return [one.trace(lane, start, end, count) for one in self.members]

    def stacks(self, lane: Lane) -> bool:
        """Whether the members lie above each other in a lane."""
        return False

    def subtracts(self, lane: Lane) -> bool:
        """Whether the first member is taken from all in a lane."""
        return False

    def right_edge(self, view: TimeView) -> float:
        """The time that is read on the right: the view's end, or where data end, s."""
        return min(view.end, self.reach)


@dataclass(frozen=True, eq=False)
class Member:
    """One of the runs that a source shows; `shift` is added to its times, s."""

    name: str
    source: Source
    shift: float = 0.0

    @property
    def spikes(self) -> FloatArray:
        """Times of its spikes, on the common time, s."""
        return self.source.spikes + self.shift if self.shift else self.source.spikes

    def trace(self, lane: Lane, start: float, end: float, count: int) -> Trace:
        """What a lane shows of it, in the lane's unit and on the common time."""
        a, b = start - self.shift, end - self.shift
        found = self.source.trace(lane.key, a, b, count)
        return found.scaled(lane.scale, lane.unit).shifted(self.shift)


class PlanSource(Source):
    """No data yet: the plan and what the model expects of it."""

    running = True
    length = 0.0
    holds: list[Stretch] = []  # noqa: RUF012
    twin_spikes = NONE

    def __init__(self, preview: Preview) -> None:
        self.preview = preview
        self.length, self.holds = preview.length, preview.holds
        self.twin_spikes = preview.spikes

    @property
    def has_model(self) -> bool:
        """Whether the plan was computed with the sensor."""
        return bool(self.preview.traces)

    def modelled(self, signal: str, start: float, end: float, count: int) -> Trace:
        """The model's."""
        if signal not in self.preview.traces:
            return Trace.nothing()
        line = Trace.line(*self.preview.traces[signal])
        return line.around(start, end).thin(count)

    def planned(self, start: float, end: float) -> tuple[FloatArray, FloatArray]:
        """The planned force."""
        return self.preview.force.time, self.preview.force.value


class LiveSource(Source):
    """A run in progress: remembers all it is told, at several resolutions.

    Args:
        preview: the model's expectation; None until it is known.
        newtons_per_ampere: turns coil current into force.

    Attributes:
        model: the twin beside the run, as far as it has come.
        holds: the trials so far.
    """

    running = True
    holds: list[Stretch] = []  # noqa: RUF012
    notes: list[tuple[float, str]] = []  # noqa: RUF012

    def __init__(self, preview: Preview | None, newtons_per_ampere: float) -> None:
        self.preview = preview
        self.aligned = None if preview is None else Aligned(preview)
        self.model = TwinTraces()
        self.holds, self.notes = [], []
        self._phase = Phase.none()
        self._carried: tuple[object, ...] = ()
        self._twin_spikes = NONE
        self._gain = newtons_per_ampere
        self._loop: list[tuple[float, float, float]] = []
        self._new = False
        self._pyramids: dict[str, Pyramid] = {}
        self._slow = {name: Readings() for name in ("force", *AVERAGED)}
        self._spikes = np.empty(1024)
        self._spike_count = 0

    @property
    def has_model(self) -> bool:
        """Whether there is a plan with the sensor, or the twin has begun."""
        planned = self.preview is not None and bool(self.preview.traces)
        return planned or self.model.end > 0

    @property
    def reach(self) -> float:
        """Time up to which there is data, s."""
        ends = [pyramid.end for pyramid in self._pyramids.values()]
        slow = max(readings.end for readings in self._slow.values())
        return max(ends) if ends else slow

    @property
    def length(self) -> float:
        """Expected length, or the reach where that is longer, s."""
        planned = self.aligned.length if self.aligned and self.running else 0.0
        return max(planned, self.reach, 1.0)

    @property
    def followed(self) -> float:
        """Where the twin has come to; without a twin the plan has to do, s."""
        return self.model.end or self.reach

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
        aligned, model = self.aligned, self.model
        if aligned is None:
            self._twin_spikes = model.spikes
            return self._phase
        as_of = (model, model.end, aligned.moves)
        if as_of != self._carried:
            known, planned = model.spikes, aligned.spikes
            if known.size:
                self._phase = phase(planned, float(known[-1]))
            ahead = self._phase.moved(planned)
            self._twin_spikes = np.concatenate([known, ahead[ahead > model.end]])
            self._carried = as_of
        return self._phase

    def add_bins(self, bins: dict[str, Trace]) -> None:
        """The newest samples by signal."""
        for signal, part in bins.items():
            self._pyramids.setdefault(signal, Pyramid()).add(part)
            self._new = self._new or not part.empty

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

    def add_reading(self, signal: str, time: float, value: float) -> None:
        """A reading of a signal that comes now and then, SI."""
        self._slow.setdefault(signal, Readings()).add(time, value)

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

    def begin_trial(self, index: int, hold: Stretch) -> None:
        """A trial starts; the preview is moved to where it really starts."""
        if not self.holds or self.holds[-1].start < hold.start:
            self.holds.append(hold)
        if self.aligned is not None:
            self.aligned.begin(index, hold.start)

    def measured(self, signal: str, start: float, end: float, count: int) -> Trace:
        """The measured signal; the force holds from each set-point to the next."""
        pyramid = self._pyramids.get(signal)
        if pyramid is not None:
            return pyramid.between(start, end, count)
        if signal not in self._slow:
            return Trace.nothing()
        hold = self.reach if signal == "force" else None
        return self._slow[signal].between(start, end, count, hold)

    def mean(self, signal: str) -> float | None:
        """Mean of the newest bins, or the last reading; None without any."""
        pyramid = self._pyramids.get(signal)
        if pyramid is not None:
            newest = pyramid.newest(NEWEST).mean
            return float(newest.mean()) if newest.size else None
        return self._slow[signal].last if signal in self._slow else None

    def modelled(self, signal: str, start: float, end: float, count: int) -> Trace:
        """The twin under the applied current so far, then what the plan expects."""
        model = self.model
        found = model.trace(signal, start, end, count)
        if self.aligned is None or end <= model.end:
            return found
        how = self._carry_on() if signal in OSCILLATING else Phase.none()
        since = model.end
        if since > 0 and not model.knows(signal):
            since = max(since, self.reach)  # no plan over data without a twin beside it
        ahead = self.aligned.twin(signal, start, end, count, how, since)
        return found.join(ahead)

    def planned(self, start: float, end: float) -> tuple[FloatArray, FloatArray]:
        """The planned force."""
        return (NONE, NONE) if self.aligned is None else self.aligned.planned()


class Readings:
    """A value read now and then: a line through its readings."""

    def __init__(self) -> None:
        self._rows = np.empty((2, 4096))
        self._count = 0

    @property
    def end(self) -> float:
        """Time of the last reading, s; 0 without one."""
        return float(self._rows[0, self._count - 1]) if self._count else 0.0

    @property
    def last(self) -> float | None:
        """The last reading."""
        return float(self._rows[1, self._count - 1]) if self._count else None

    def add(self, time: float, value: float) -> None:
        """Append a reading."""
        if self._count == self._rows.shape[1]:
            if self._count >= READINGS:
                half = self._rows[:, : self._count : 2].copy()
                self._rows[:, : half.shape[1]] = half
                self._count = half.shape[1]
            else:
                self._rows = np.concatenate([self._rows, np.empty_like(self._rows)], 1)
        self._rows[:, self._count] = time, value
        self._count += 1

    def between(
        self, start: float, end: float, count: int, hold: float | None = None
    ) -> Trace:
        """A line through the readings around [start, end] s.

        With `hold`, each reading holds until the next and the last until `hold` s.
        """
        first = np.searchsorted(self._rows[0, : self._count], start)
        time, value = self._rows[:, max(0, int(first) - 1) : self._count]
        line = Trace.line(time, value)
        if hold is not None:
            line = Trace.steps(time, value, hold)
        return line.around(start, end).thin(count)
