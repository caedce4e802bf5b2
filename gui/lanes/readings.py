"""Numbers of a lane: the newest ones, those at a time, and what is said of spikes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gui.lanes.axis import number
from gui.lanes.compare import Comparison
from gui.lanes.decimate import Drawn, FloatArray
from gui.lanes.derive import (
    LEAST_SILENCE,
    NEVER,
    SILENCE,
    begins,
    difference,
    rate_at,
    rate_of,
    scaled,
)
from gui.lanes.expected import starts
from gui.lanes.lane import Kind, Lane
from gui.lanes.source import Source
from gui.lanes.view import TimeView

NEAR = 0.02
"""So much is read on either side of a time, s."""

FEW = 40
"""In so many columns."""


def newest(lane: Lane, source: Source) -> float | None:
    """The newest value in shown units; None without data."""
    reach = source.reach
    if reach <= 0:
        return None
    if lane.kind is Kind.RASTER:
        return float(source.spikes.size)
    if lane.kind is Kind.RATE:
        spikes = source.spikes
        # spikes may be told before the samples they were found in
        now = max(reach, float(spikes[-1])) if spikes.size else reach
        return rate_at(spikes, now, starts(source.holds))
    if lane.kind is Kind.RESIDUAL:
        reach = min(reach, source.followed)
    drawn = traces(lane, source, reach - 0.05, reach, 50, model=False)[0]
    return None if drawn.empty else float(drawn.mean[-1])


def right_edge(source: Source, view: TimeView) -> float:
    """The time that is read on the right: the view's end, or where the data end, s."""
    if isinstance(source, Comparison):
        return source.right_edge(view)
    return min(view.end, source.reach)


@dataclass(frozen=True, eq=False)
class Painted:
    """What a lane's picture shows.

    Attributes:
        start, end: of the visible time, s.
        runs: measured trace of each run, in shown units.
    """

    start: float = 0.0
    end: float = 0.0
    runs: tuple[Drawn, ...] = ()

    def close(self, lane: Lane, time: float) -> bool:
        """Whether the value at a time can be read from it."""
        inside = bool(self.runs) and self.start <= time <= self.end
        fine = all(run.column <= 2 * NEAR / FEW for run in self.runs)
        return inside and (fine or lane.kind is Kind.RESIDUAL)


def traces(
    lane: Lane, source: Source, start: float, end: float, count: int, *, model: bool
) -> tuple[Drawn, Drawn]:
    """What is measured, and what the model has if wanted, in shown units."""
    none = Drawn.nothing()
    if lane.kind is Kind.RASTER:
        return none, none
    if lane.kind is Kind.RATE:
        steps = starts(source.holds)
        twin = rate_of(source.twin_spikes, start, end, count, steps) if model else none
        return rate_of(source.spikes, start, end, count, steps), twin
    if lane.kind is Kind.RESIDUAL:
        # ahead of the twin is the plan: measured less that is no error of the model
        end = max(start, min(end, source.followed))
    measured = source.trace(lane.signal, start, end, count)
    if lane.kind is Kind.RESIDUAL:
        expected = source.twin(lane.signal, start, end, 4 * count)
        return scaled(difference(measured, expected), lane.scale), none
    twin = none
    if model and lane.kind is not Kind.FORCE:
        twin = scaled(source.twin(lane.signal, start, end, count), lane.scale)
    return scaled(measured, lane.scale), twin


def values_at(
    lane: Lane, source: Source, time: float, painted: Painted
) -> tuple[float | None, ...]:
    """Values at a time, one for each run, in shown units; None where there are none.

    They are those of the picture, so that numbers and traces do not disagree, but where
    a column of it is a mean over long.
    """
    start, end = time - NEAR, time + NEAR
    if not painted.close(lane, time):
        painted = Painted()
    if isinstance(source, Comparison):
        drawn = painted.runs or source.drawn(lane, start, end, FEW)
        return tuple(
            _value(lane, member.source, time, time - member.shift, one)
            for member, one in zip(source.members, drawn, strict=True)
        )
    (one,) = painted.runs or traces(lane, source, start, end, FEW, model=False)[:1]
    return (_value(lane, source, time, time, one),)


def _value(
    lane: Lane, source: Source, time: float, own: float, drawn: Drawn
) -> float | None:
    """At `time` of the picture, which is `own` of the run."""
    if source.reach <= 0 or not 0 <= own <= source.reach:
        return None
    if lane.kind is Kind.RATE:
        return rate_at(source.spikes, own, starts(source.holds))
    return drawn.at(time)


def count_between(spikes: FloatArray, start: float, end: float) -> int:
    """Spikes in [start, end] s."""
    first = np.searchsorted(spikes, start, side="left")
    return max(0, int(np.searchsorted(spikes, end, side="right") - first))


def interval_text(spikes: FloatArray, now: float, steps: FloatArray = NEVER) -> str:
    """The last interval, or the silence before the newest spike, or since it."""
    if spikes.size < 2:
        return ""
    last = float(spikes[-1] - spikes[-2])
    since = now - float(spikes[-1])
    if begins(spikes[-3:], steps)[-1]:
        if since > LEAST_SILENCE:
            return f"silent {since:.1f} s"
        return f"after {last:.1f} s of silence"
    words = f"ISI {number(1e3 * last, 1)} ms"
    silent = since > max(SILENCE * last, LEAST_SILENCE)
    return f"{words} · silent {since:.1f} s" if silent else words


def view_text(
    spikes: FloatArray, start: float, end: float, steps: FloatArray = NEVER
) -> str:
    """How many spikes the run has, and the last interval in [start, end] s."""
    words = f"of {spikes.size}"
    last = int(np.searchsorted(spikes, end, side="right")) - 1
    if last > 0 and spikes[last - 1] >= start:
        near = spikes[max(0, last - 2) : last + 2]
        if not begins(near, steps)[min(last, 2)]:
            interval = 1e3 * float(spikes[last] - spikes[last - 1])
            words += f" · last ISI {number(interval, 1)} ms"
    return words
