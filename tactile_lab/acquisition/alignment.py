"""Where the scope's sample clock lies against host time, told by the coil's own edges.

A set-point takes effect between the moment it was sent and the moment the source had
acted on it. The shunt channel shows when it really did, on the sample clock. Each edge
so bounds the offset of the two clocks, and many edges bound it from all sides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tactile_lab.acquisition.coil_thread import Applied, PlayedList
from tactile_lab.analysis.delay import delay
from tactile_lab.arrays import FloatArray
from tactile_lab.current_list import CurrentList
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.lag import Lag
from tactile_lab.scope import CLOCK_ERROR
from tactile_lab.trace import Trace
from tactile_lab.waveform import Waveform

SMALLEST = 0.03
"""Smallest step of the current that counts as an edge, A (two codes of the shunt)."""

COIL_LAG = 2e-3
"""Longest time the coil's L/R takes to bring the current half the way, s."""

STEEPEST = 5e-4
"""Drift up to which edges of one end are still compared with each other, s/s."""

SEARCH = 0.02
"""How far beyond its host times an edge is looked for, where clocks agree, s."""

SHIFT = 5e-4
"""Step in which the place of a list is looked for, s."""

ROUNDS = 3
"""So often what is left of its delay is put right, each time to first order."""

PLACES = 8
"""Places looked at so finely, those where it seems the most alike."""

CLUSTER = 20
"""Edges at either end of a segment that fix the clocks there."""


@dataclass(frozen=True)
class Edge:
    """One step of the coil current, on both clocks, in run time.

    Attributes:
        sampled: when the samples show it, s.
        earliest, latest: between which host times it happened, s.
    """

    sampled: float
    earliest: float
    latest: float


@dataclass(frozen=True)
class Alignment:
    """How to correct a segment's sample times.

    Attributes:
        offset: to add to the time of the first sample, s.
        drift: to stretch the sample interval by, s/s.
        uncertainty: of a time so corrected, s.
    """

    offset: float
    drift: float
    uncertainty: float


@dataclass
class Clocks:
    """How the two clocks stood to each other when that was last seen.

    Attributes:
        at: run time of that, s.
        late: what a sample's time then lacked to be host time, s.
    """

    at: float = 0.0
    late: float = 0.0

    def see(self, edge: Edge) -> None:
        """Change by no more than an edge asks for."""
        least, most = edge.earliest - edge.sampled, edge.latest - edge.sampled
        self.at, self.late = edge.earliest, min(max(self.late, least), most)

    def part(self, time: float) -> float:
        """How far they may have parted since by run time `time` s, s."""
        return CLOCK_ERROR * max(0.0, time - self.at)


def find_edges(
    applied: Sequence[Applied], zero: float, shunt: Trace, clocks: Clocks | None = None
) -> list[Edge]:
    """Edges of the set-points in `applied`, as the binned coil current shows them.

    The points of a list are too near each other for that: see `find_list`.

    Args:
        applied: consecutive set-points, clock times in s.
        zero: clock time of run time 0, s.
        shunt: coil current, A, by the sample clock on the run's axis.
        clocks: how they stood before, and see what is found; in step unless given.
    """
    found = []
    clocks = clocks or Clocks()
    middle = shunt.time + shunt.width / 2
    before: float | None = None
    for one in applied:
        step = 0.0 if before is None else one.setpoint - before
        if before is not None and abs(step) >= SMALLEST and not one.listed:
            earliest, latest = one.asked - zero, one.time - zero + COIL_LAG
            reach = SEARCH + clocks.part(earliest)
            around = earliest - clocks.late - reach, latest - clocks.late + reach
            low, high = np.searchsorted(middle, around)
            # how far the current has come from the old level to the new one
            done = (shunt.mean[low:high].astype(np.float64) - before) / step
            at = _crossing(middle[low:high], done)
            if at is not None:
                found.append(Edge(at, earliest, latest))
                clocks.see(found[-1])
        before = one.setpoint
    return found


@dataclass(frozen=True)
class SeenList:
    """A list of currents, as the samples show it.

    Attributes:
        edge: when it began, on both clocks.
        unlike: part of the current's variance that the list does not account for.
        longer: by how much its second half came later than its first, s.
        scale: the current that was seen as a part of the list's.
    """

    edge: Edge
    unlike: float
    longer: float
    scale: float


def find_list(
    played: PlayedList, zero: float, shunt: Trace, coil_lag: float = 0.0
) -> SeenList | None:
    """Where the binned coil current shows a list; None where it moves too little.

    It is found as if the current came as it is set, but late, and then placed so that
    the current is that of the list behind the coil's L/R.

    Args:
        played: the list.
        zero: clock time of run time 0, s.
        shunt: coil current, A, on the run's axis.
        coil_lag: L/R of the coil, s.
    """
    points, began = played.points, played.began - zero
    if float(np.std(points.currents)) < SMALLEST:
        return None
    reach = played.latest - played.earliest + SEARCH
    shifts = np.arange(-reach, reach + COIL_LAG, SHIFT)
    # what flowed after a list that was cut off, the list does not say
    end = points.duration + (reach if played.whole else -reach)
    inside = shunt.cut(began - reach, began + end)
    if inside.time.size < 3:
        return None
    flow, _ = Lag(coil=coil_lag).follow(points.wave)
    # one that repeats itself is nearly as alike a period off: the finest look decides
    began, unlike = min(
        (
            _placed(flow, inside, began + late - coil_lag)
            for late in _alike(points, began, inside, shifts)[:PLACES]
        ),
        key=lambda place: place[1],
    )
    edge = Edge(began, played.earliest - zero, played.latest - zero + COIL_LAG)
    asked = flow.mean(inside.time - began, inside.width)
    seen = inside.mean.astype(np.float64)
    scale = float(np.cov(asked, seen)[0, 1] / (np.var(asked, ddof=1) or 1.0))
    return SeenList(edge, unlike, _longer(points, began + coil_lag, inside), scale)


def _placed(flow: Waveform, seen: Trace, began: float) -> tuple[float, float]:
    """When a list of that current began near `began`, s, and how unlike it is then."""
    mean, place = seen.mean.astype(np.float64), began
    for _ in range(ROUNDS):
        try:
            place += delay(flow, seen.time - place, seen.width, mean).value
        except NotIdentifiableError:
            break
    if abs(place - began) > 2 * SHIFT:
        place = began
    unlike = np.var(flow.mean(seen.time - place, seen.width) - mean)
    return place, float(unlike / (np.var(mean) or 1.0))


def _longer(points: CurrentList, began: float, seen: Trace) -> float:
    """By how much the second half of a list came later than its first, s.

    The halves have as much to show each; 0 where one of them has too little.
    """
    change = np.cumsum(np.abs(np.diff(seen.mean, prepend=seen.mean[:1])))
    half = int(np.searchsorted(change, change[-1] / 2))
    near = np.arange(-SEARCH, SEARCH, SHIFT)
    found = []
    for part in (seen[:half], seen[half:]):
        if part.time.size < 3 or float(np.std(part.mean)) < SMALLEST:
            return 0.0
        shift = float(_alike(points, began, part, near)[0])
        if abs(shift) > SEARCH - 2 * SHIFT:
            return 0.0  # it fits nowhere here, which says nothing of time
        found.append(shift)
    return found[1] - found[0]


def _alike(
    points: CurrentList, began: float, seen: Trace, shifts: FloatArray
) -> FloatArray:
    """Where a list is more like what was seen than just beside, the most alike first.

    Args:
        points: the list, as if its current came as it is set.
        began: near when, s.
        seen: the binned coil current.
        shifts: later by these, s, evenly spaced by `SHIFT`.
    """
    mean = seen.mean.astype(np.float64)
    unlike = [
        np.var(points.mean(seen.time - began - by, seen.width) - mean) for by in shifts
    ]
    left = np.pad(np.array(unlike), 1, mode="edge")
    k = np.flatnonzero((left[1:-1] <= left[:-2]) & (left[1:-1] <= left[2:]))
    k = k[np.argsort(left[k + 1], kind="stable")]
    before, at, after = left[k], left[k + 1], left[k + 2]
    bend = before - 2 * at + after
    off = np.where(bend > 0, (before - after) / np.where(bend > 0, 2 * bend, 1.0), 0.0)
    return np.asarray(shifts[k] + off * SHIFT)


def align(
    edges: Sequence[Edge], start: float, stop: float, uncertainty: float
) -> Alignment:
    """The alignment of a segment.

    Args:
        edges: of the segment, ascending; none: host time stands as it is.
        start: run time of the segment's first sample as the host has it, s.
        stop: likewise of its last sample, s.
        uncertainty: of `start`, s.
    """
    unaided = Alignment(0.0, 0.0, uncertainty + CLOCK_ERROR * (stop - start))
    first, last = edges[:CLUSTER], edges[-CLUSTER:]
    begin, end = _bounds(first, unaided.uncertainty), _bounds(last, np.inf)
    if begin is None or end is None:
        return unaided
    apart = _mean_time(last) - _mean_time(first)
    if apart > 0 and (end[0] > begin[1] or end[1] < begin[0]):
        drift = (_middle(end) - _middle(begin)) / apart
        at_begin = _middle(begin)
        left = max(end[1] - end[0], begin[1] - begin[0]) / 2
    else:
        # equal clocks are the simplest account of edges that allow them
        both = max(begin[0], end[0]), min(begin[1], end[1])
        drift, at_begin = 0.0, _middle(both)
        left = max(abs(bound - at_begin) for bound in (*begin, *end))
    # before the first edges and after the last, the clocks may part further
    steep = CLOCK_ERROR
    if apart > 0:
        parted = end[1] - begin[0] - drift * apart, begin[1] - end[0] + drift * apart
        steep = min(steep, max(parted) / apart)
    left += steep * max(_mean_time(first) - start, stop - _mean_time(last), 0.0)
    if drift == 0.0 and left >= unaided.uncertainty:
        return unaided
    return Alignment(at_begin - drift * (_mean_time(first) - start), drift, left)


def _middle(bounds: tuple[float, float]) -> float:
    return (bounds[0] + bounds[1]) / 2


def _bounds(edges: Sequence[Edge], uncertainty: float) -> tuple[float, float] | None:
    """Least and largest correction at the edges' mean time that all of them allow.

    None where there are no edges, or where they contradict each other.
    """
    if not edges:
        return None
    middle = _mean_time(edges)
    low, high = -uncertainty, uncertainty
    for edge in edges:
        parted = STEEPEST * abs(edge.sampled - middle)
        low = max(low, edge.earliest - edge.sampled - parted)
        high = min(high, edge.latest - edge.sampled + parted)
    return (low, high) if low <= high else None


def _mean_time(edges: Sequence[Edge]) -> float:
    return float(np.mean([edge.sampled for edge in edges]))


def _crossing(time: FloatArray, done: FloatArray) -> float | None:
    """When `done` first passes one half, between two bins; None if it never does."""
    past = np.flatnonzero(done >= 0.5)
    if past.size == 0 or past[0] == 0:
        return None
    i = int(past[0])
    part = (0.5 - done[i - 1]) / (done[i] - done[i - 1])
    return float(time[i - 1] + part * (time[i] - time[i - 1]))
