"""A run in progress, as lanes show it: it remembers all that it is told."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from pathlib import Path

import numpy as np

from gui.lanes.expected import Aligned, Preview, Stretch, settled, starts
from gui.lanes.phase import Phase, phase
from gui.lanes.source import NONE, Source, no_counts
from gui.lanes.twin import TwinTraces
from tactile_lab.arrays import FloatArray
from tactile_lab.measurement import TOO_FAST
from tactile_lab.pyramid import Pyramid
from tactile_lab.signals import AVERAGED
from tactile_lab.spikes.false import are_false
from tactile_lab.trace import Trace

OSCILLATING = frozenset({"V_C2", "V_K"})
"""Signals that go with the spikes; the others go with the force."""

NEWEST = 50
"""Bins that the newest value is the mean of."""

READINGS = 200_000
"""Readings of a slow signal kept; of more, every other older one is dropped."""


class LiveSource(Source):
    """A run in progress: remembers all it is told, at several resolutions.

    Args:
        preview: the model's expectation; None until it is known.
        newtons_per_ampere: turns coil current into force.
        folder: it is recorded to; None where nothing is kept.

    Attributes:
        model: the twin beside the run, as far as it has come.
        holds: the trials so far.
        shortest_interval: less than any between two spikes of the sensor, s.
    """

    running = True
    holds: list[Stretch] = []  # noqa: RUF012
    notes: list[tuple[float, str]] = []  # noqa: RUF012

    folder: Path | None = None
    shortest_interval = 0.0

    def __init__(
        self,
        preview: Preview | None,
        newtons_per_ampere: float,
        folder: Path | None = None,
    ) -> None:
        self.preview, self.folder = preview, folder
        self.aligned = None if preview is None else Aligned(preview)
        self.model = TwinTraces()
        self.holds, self.notes = [], []
        self._phase = Phase.none()
        self._carried: tuple[object, ...] = ()
        self._twin_spikes = NONE
        self._gain = newtons_per_ampere
        self._loop: list[tuple[float, float]] = []
        self._pyramids: dict[str, Pyramid] = {}
        self._streamed = 0.0  # to where; asked 50 times a frame
        self._slow = {name: Readings() for name in ("force", *AVERAGED)}
        self._spikes = np.empty(1024)
        self._spike_count = 0
        self._judged: dict[int, tuple[int, int]] = {}
        """Of each trial: intervals that are too short, and spikes."""
        self._of: LiveSource | None = None

    def frozen(self) -> LiveSource:
        """The same up to now: what comes later is not in it."""
        made = copy(self)
        made.stay(self)
        return made

    def stay(self, of: LiveSource) -> None:
        """Be a view of a run in progress as it is now."""
        self._of, self.holds = of, list(self.holds)
        reach = self.reach
        self._slow = {name: one.until(reach) for name, one in self._slow.items()}
        self._judged = dict(self._judged)

    @property
    def of(self) -> Source:
        """The run in progress, of which this may be a frozen view."""
        return self._of or self

    @property
    def has_model(self) -> bool:
        """Whether there is a plan with the sensor, or the twin has begun."""
        planned = self.preview is not None and bool(self.preview.traces)
        return planned or self.model.end > 0

    @property
    def reach(self) -> float:
        """Time up to which there is data, s; of a scope's while the run goes on."""
        if self._pyramids and self.running:
            return self._streamed
        return max(self._streamed, *(one.end for one in self._slow.values()))

    @property
    def sampled_until(self) -> float:
        """Time up to which samples have come, s."""
        return self._streamed if self._pyramids else self.reach

    def ends(self, key: str) -> float:
        """Time up to which there is data of a lane, s."""
        if key == "force":
            return self.reach
        if key in self._slow and key not in self._pyramids:
            return self._slow[key].end
        end = self.sampled_until
        return min(end, self.followed) if key == "residual" else end

    @property
    def length(self) -> float:
        """Expected length, or the reach where that is longer, s."""
        planned = self.aligned.length if self.aligned and self.running else 0.0
        return max(planned, self.reach, 1.0)

    @property
    def sampled(self) -> bool:
        """Whether any samples have come: a run may do without a scope."""
        return bool(self._pyramids)

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
            pyramid = self._pyramids.get(signal) or Pyramid()
            pyramid.add(part)
            self._pyramids[signal] = pyramid
            self._streamed = max(self._streamed, pyramid.end)

    def add_spikes(self, times: tuple[float, ...]) -> None:
        """Detected spikes, ascending."""
        need = self._spike_count + len(times)
        if need > self._spikes.size:
            self._spikes = np.concatenate([self._spikes, np.empty(max(need, 1024))])
        before = self._spikes[self._spike_count - 1] if self._spike_count else -np.inf
        self._spikes[self._spike_count : need] = times
        self._spike_count = need
        self._judge(np.array([before, *times]))

    def _judge(self, times: FloatArray) -> None:
        """Count the intervals between new spikes that no circuit gives.

        Args:
            times: s, after the spike before them.
        """
        trial = np.searchsorted(starts(self.holds), times, side="right") - 1
        short = (np.diff(times) < self.shortest_interval) & (np.diff(trial) == 0)
        for number in np.unique(trial[1:]).tolist():
            mine = trial[1:] == number
            false, seen = self._judged.get(number, (0, 0))
            false += int(np.count_nonzero(short & mine))
            self._judged[number] = false, seen + int(np.count_nonzero(mine))

    @property
    def unrated(self) -> Sequence[tuple[Stretch, str]]:
        """Also the trials whose spikes come faster than the sensor can fire."""
        false = {n for n, found in self._judged.items() if are_false(*found)}
        if not false:
            return super().unrated
        why = [TOO_FAST if n in false else "" for n in range(len(self.holds))]
        return (*super().unrated, *no_counts(self.holds, why))

    def add_current(self, time: float, amperes: float) -> None:
        """A read-back of the coil."""
        self._slow["force"].add(time, amperes * self._gain)

    def add_reading(self, signal: str, time: float, value: float) -> None:
        """A reading of a signal that comes now and then, SI."""
        self._slow.setdefault(signal, Readings()).add(time, value)

    def add_field(self, time: float, tesla: float) -> None:
        """A reading of the teslameter."""
        self._slow["field"].add(time, tesla)
        if len(self._loop) < 50_000:
            self._loop.append((time, tesla))

    @property
    def loop(self) -> FloatArray:
        """Shape (n, 2): coil current, A, and the field read under it, T; on steps only.

        A reading is told after currents that were set since it was taken.
        """
        time, tesla = np.array(self._loop, dtype=np.float64).reshape(-1, 2).T
        inside = settled(time, self.holds)
        current = self._slow["force"].at(time[inside]) / self._gain
        found = np.column_stack((current, tesla[inside]))
        return found[np.isfinite(current)]

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
            if self._of is None:
                return pyramid.between(start, end, count)
            until = self._streamed  # its pyramids go on growing
            found = pyramid.between(start, max(start, min(end, until)), count)
            cells = np.searchsorted(found.time + found.width, until, side="right")
            return found[: int(cells)]
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

    def at(self, times: FloatArray) -> FloatArray:
        """The reading that holds at each of `times`, s; NaN before the first."""
        before = np.searchsorted(self._rows[0, : self._count], times, side="right")
        return np.concatenate([[np.nan], self._rows[1, : self._count]])[before]

    def until(self, time: float) -> Readings:
        """Those up to a time, s, which no later ones are added to."""
        made = Readings()
        count = np.searchsorted(self._rows[0, : self._count], time, side="right")
        made._rows, made._count = self._rows.copy(), int(count)
        return made

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
        return line.around(start, end).corners(count)
