"""Where lanes take what they show from; here what all have in common, and the plan.

All times are on the run's axis, s; values are SI unless a lane's unit is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gui.lanes.expected import Preview, Stretch, starts
from gui.lanes.lane import Lane
from gui.lanes.rate import rate_of
from tactile_lab.arrays import FloatArray
from tactile_lab.measurement import BETWEEN_SAMPLES
from tactile_lab.spikes.rate import rate_at
from tactile_lab.trace import Trace

if TYPE_CHECKING:
    from gui.lanes.view import TimeView

NONE = np.empty(0)
ALWAYS = Stretch(-math.inf, math.inf, "")


def no_counts(
    holds: Sequence[Stretch], reasons: Sequence[str]
) -> list[tuple[Stretch, str]]:
    """Steps whose spikes are no count, and why.

    Each reaches to the next step, and the first from the run's beginning: what comes
    between is found in the same way.

    Args:
        holds: all steps, ascending.
        reasons: of each; "" where its spikes are a count.
    """
    edges = [-math.inf, *(hold.start for hold in holds[1:]), math.inf]
    each = zip(holds, pairwise(edges), reasons, strict=False)
    return [(replace(one, start=a, end=b), why) for one, (a, b), why in each if why]


class Source:
    """What a lane may ask for; by itself empty, as before anything is opened.

    Attributes:
        signals: what has a lane, force and spikes included.
        simulated: whether any of it is computed physics.
        counted: whether all its spikes are seen: else no rate of them is told.
        path: folder of a run on disk.
    """

    signals: Sequence[str] = ()
    simulated = False
    counted = True
    path: Path | None = None

    @property
    def unrated(self) -> Sequence[tuple[Stretch, str]]:
        """Where spikes are no count, so that no rate of them is told, and why."""
        return () if self.counted else ((ALWAYS, BETWEEN_SAMPLES),)

    @property
    def rated(self) -> FloatArray:
        """Spikes of which a rate is told, s: those that are a count."""
        spikes, unrated = self.spikes, self.unrated
        if not unrated:
            return spikes
        told = np.full(spikes.size, True)
        for one, _ in unrated:
            first, last = np.searchsorted(spikes, (one.start, one.end))
            told[first:last] = False
        kept: FloatArray = spikes[told]
        return kept

    def why_unrated(self, start: float, end: float) -> str:
        """Why no rate is told between two times, s; "" where one is."""
        touched = (
            why for one, why in self.unrated if one.start < end and start < one.end
        )
        return next(touched, "")

    @property
    def of(self) -> Source:
        """What this is a view of: itself."""
        return self

    @property
    def folder(self) -> Path | None:
        """Of the run it is of, be it in progress; None where nothing is kept."""
        return self.path

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

    def read_all(self) -> None:
        """Return when all samples that were asked for have been read."""

    def close(self) -> None:
        """Let go of files."""

    # --- what lanes show

    def rate(self, time: float) -> float | None:
        """Rate at a time, s, in Hz; None where it cannot be told."""
        if self.why_unrated(time, time):
            return None
        return rate_at(self.rated, time, starts(self.holds))

    def trace(self, key: str, start: float, end: float, count: int) -> Trace:
        """What a lane shows of the run: a signal, its residual, the rate."""
        if key == "rate":
            return rate_of(self.rated, start, end, count, starts(self.holds))
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

    @property
    def sampled_until(self) -> float:
        """Time up to which there are samples; all there is where there are none, s."""
        return self.reach

    def ends(self, key: str) -> float:
        """Time up to which there is data of a lane, s; 0 where there is none.

        Instruments end at times of their own, and a coil may be late to go to 0 A.
        """
        return self.reach

    def right_edge(self, view: TimeView, lane: Lane) -> float:
        """Where a lane is read on the right: at the view's end, or its own, s."""
        edge, end = min(view.end, self.reach), self.ends(lane.key)
        return end if view.start < end < edge else edge


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

    running = simulated = True
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
