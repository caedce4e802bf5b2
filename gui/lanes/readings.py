"""Numbers of a lane: the newest ones, those at a time, and what is said of spikes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gui.lanes.lane import Lane
from gui.lanes.source import Source
from gui.plots.numbers import number
from tactile_lab.arrays import FloatArray
from tactile_lab.spikes.rate import LEAST_SILENCE, NEVER, SILENCE, begins
from tactile_lab.trace import Trace

NEAR = 0.02
"""So much is read on either side of a time, s."""

FEW = 40
"""In so many columns."""

FINE, COARSE = 2 * NEAR / FEW, 0.02
"""Widest columns of a picture that values are read from, s; while it moves."""


def newest(lane: Lane, source: Source) -> float | None:
    """The newest value in shown units; None without data."""
    reach = source.reach
    if reach <= 0:
        return None
    if lane.raster:
        return float(source.spikes.size)
    if lane.key == "rate":
        spikes = source.spikes
        # spikes may be told before the samples they were found in
        now = max(reach, float(spikes[-1])) if spikes.size else reach
        return source.rate(now)
    if lane.symmetric:
        reach = min(reach, source.followed)
    (shown,) = source.shown(lane, reach - 0.05, reach, 50)
    return None if shown.empty else float(shown.mean[-1])


@dataclass(frozen=True, eq=False)
class Painted:
    """What a lane's picture shows.

    Attributes:
        start, end: of the visible time, s.
        runs: measured trace of each run, in shown units.
    """

    start: float = 0.0
    end: float = 0.0
    runs: tuple[Trace, ...] = ()

    def close(self, lane: Lane, time: float, widest: float = FINE) -> bool:
        """Whether the value at a time can be read: no column is above `widest` s."""
        inside = bool(self.runs) and self.start <= time <= self.end
        fine = lane.symmetric or all(run.step <= widest for run in self.runs)
        return inside and fine


def values_at(
    lane: Lane,
    source: Source,
    time: float,
    painted: Painted,
    widest: float = FINE,
) -> tuple[float | None, ...]:
    """Values at a time, one for each run, in shown units; None where there are none.

    They are those of the picture, so that numbers and traces do not disagree, but where
    a column of it is a mean over more than `widest` s.
    """
    runs = painted.runs if painted.close(lane, time, widest) else ()
    values: list[float | None] = []
    shown = runs or source.shown(lane, time - NEAR, time + NEAR, FEW)
    inside = painted.runs and painted.start <= time <= painted.end
    drawn = painted.runs if inside else shown
    for member, trace, picture in zip(source.members, shown, drawn, strict=True):
        run, own = member.source, time - member.shift
        if run.reach <= 0 or not 0 <= own <= run.reach:
            values.append(None)
        elif lane.key == "rate":
            values.append(run.rate(own))
        else:
            # a record may end some of its picture's columns before its run
            value = trace.at(time)
            values.append(picture.at(time) if value is None else value)
    return tuple(values)


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
