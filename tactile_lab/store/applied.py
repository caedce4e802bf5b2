"""The current the coil really carried, from what the run recorded of it.

Levels come from the source's read-back. The shunt tells when each step came, which the
host only knows to lie between sending a set-point and hearing that it was taken. One
scope code of a 0.1 Ohm shunt is 16 mA, so it gives no level by itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.analysis.estimate import Z95
from tactile_lab.arrays import FloatArray
from tactile_lab.scope import CLOCK_ERROR
from tactile_lab.store.list_timing import list_timing
from tactile_lab.store.shunt import BIN_TIME, Shunt

SAME = 2e-5
"""Set-points nearer than this are one level, A."""
VISIBLE = 0.03
"""Smallest step an edge of which the shunt shows, A, whatever its codes."""
VISIBLE_CODES = 1.9
"""And in codes: 16 mA each in the usual range of a shunt of 0.1 Ohm."""
ENOUGH = 5
"""So many edges seen tell how early the others came."""
MANY = 20
"""So many tell by their scatter how well each was seen."""
BEFORE, AFTER = 0.06, 0.004
"""An edge is looked for so long before and after the host heard of the step, s, or from
when it was sent, if that was earlier: an answer may be lost."""
BACK = 0.25
"""Part of its step below which the shunt does not fall once an edge has come."""
TOO_NOISY = 0.45
"""Part of its step to which noise may lift or lower the shunt with an edge believed."""
SETTLED = 5e-3
"""Time after a step until the shunt shows a level, s."""

BY_SAMPLES, BY_HOST = 1, 2
"""What told when a list began, of which a set-point was a point."""


@dataclass(frozen=True, eq=False)
class AppliedCurrent:
    """What the coil carried.

    Attributes:
        steps: shape (n, 2): from that time on, s, the source gives this current, A.
        ends: shape (n,): when the host heard of what came after each step, s.
        edges: number of steps whose time the shunt gave, points of lists among them.
        lead: by how much those came before the host heard of them, s (median): the
            others were moved as those next to them; 0 where there were too few.
        away: shape (n,): how long before the first of those or after the last each
            step came, s; 0 between them.
        timing: half of the 95 % band to which the shunt dates them, s.
        doubt: shape (n,): how far each step may lie on either side of where the others
            say, s; 0 where the shunt tells.
    """

    steps: FloatArray
    ends: FloatArray
    edges: int
    lead: float
    away: FloatArray
    timing: float = BIN_TIME
    doubt: FloatArray = field(default_factory=lambda: np.empty(0))

    def uncertainty(self, start: float = -np.inf, end: float = np.inf) -> float | None:
        """Half of the 95 % band of the steps' times against the samples, s.

        What the shunt leaves open (`timing`), and what the clocks may part where it
        showed nothing any more; None where it told too few, and the clocks alone do.

        Args:
            start: from which time on steps are asked for, s.
            end: up to which, s.
        """
        if self.edges < ENOUGH:
            return None
        inside = (self.steps[:, 0] >= start) & (self.steps[:, 0] <= end)
        return self.timing + CLOCK_ERROR * float(self.away[inside].max(initial=0.0))


def applied_current(
    time: ArrayLike,
    setpoint: ArrayLike,
    measured: ArrayLike,
    shunt: Shunt | None = None,
    coil_lag: float = 0.0,
    listed: ArrayLike = False,
    asked: ArrayLike = np.nan,
    visible: float = VISIBLE,
    acted: ArrayLike = np.nan,
) -> AppliedCurrent:
    """Join what source and shunt tell.

    Args:
        time: when the host heard of each set-point or read-back, s, ascending.
        setpoint: A.
        measured: read back, A; not a number where it was not read.
        shunt: the recorded coil current; None where the run has none.
        coil_lag: L/R of the coil, s: the current passes half of a step ln 2 times
            that after the source stepped.
        listed: which of them the source took by its own clock, so that they came when
            `time` says: `BY_SAMPLES` where the shunt showed when their list began,
            `BY_HOST` where only the host told, else 0.
        asked: when the host sent each, s; not a number where that is not known.
        visible: smallest step an edge of which the shunt shows, A.
        acted: when the source is taken to have acted on each, s: as its answer set out;
            it dates them where the shunt does not, else `time`.
    """
    t, sent, read = (np.asarray(v, np.float64) for v in (time, setpoint, measured))
    if not t.size:
        return AppliedCurrent(np.empty((0, 2)), np.empty(0), 0, 0.0, np.empty(0))
    first = np.flatnonzero(np.abs(np.diff(sent, prepend=np.inf)) > SAME)
    last = np.append(first[1:], t.size)
    level = np.array(
        [_level(sent[a], read[a:b]) for a, b in zip(first, last, strict=True)]
    )
    dated = np.broadcast_to(np.asarray(listed), t.shape)[first]
    own_clock = dated > 0
    begin, ends = t[first].copy(), np.append(t[first][1:], t[-1])
    edges, lead, away, timing = 0, 0.0, np.zeros(begin.size), 0.0
    sent_at = np.broadcast_to(np.asarray(asked, np.float64), t.shape)[first].copy()
    sent_at[0] = np.nan  # it stood when the run began, and was read back
    doubt = _doubt(t[first] - np.where(own_clock, np.nan, sent_at))
    answered = np.broadcast_to(np.asarray(acted, np.float64), t.shape)[first].copy()
    answered[0] = np.nan
    seen, bands = np.full(begin.size, np.nan), np.zeros(begin.size)
    if shunt is not None:
        width = BIN_TIME
        for i in np.flatnonzero(~own_clock[1:]) + 1:
            since = max(begin[i - 1], np.fmin(begin[i] - BEFORE, sent_at[i]))
            if abs(level[i] - level[i - 1]) < visible:
                continue
            edge = _edge(shunt, since, begin[i], level[i - 1], level[i], coil_lag)
            if edge is not None:
                seen[i], bands[i] = edge.time - math.log(2) * coil_lag, edge.band
                width = max(width, edge.width)
        shown = np.isfinite(seen)
        edges = int(shown.sum())
        if edges >= ENOUGH:
            early, at = begin[shown] - seen[shown], begin[shown]
            lead = float(np.median(early))
            noise = math.sqrt(float(np.mean(bands[shown] ** 2)))
            timing = max(_timing(at, early, coil_lag, width), noise)
            moved = ~own_clock & (np.arange(begin.size) > 0)
            # the small ones came as early as those next to them that the shunt shows:
            # the clocks part in time
            begin[moved] -= np.interp(begin[moved], at, _of_three(early))
            away[moved] = np.maximum(at[0] - t[first], t[first] - at[-1])[moved]
            away = np.maximum(away, 0.0)
        doubt[shown] = 0.0
    if edges < ENOUGH:
        begin = np.fmin(begin, answered)
    begin = np.maximum.accumulate(np.where(np.isfinite(seen), seen, begin))
    begin = np.maximum.accumulate(begin - doubt)
    steps = np.column_stack([begin, level])
    by_host, by_samples = bool(np.any(dated == BY_HOST)), dated == BY_SAMPLES
    if shunt is not None and by_samples.any():
        told = list_timing(steps, by_samples, shunt, coil_lag, visible)
        timing = max(timing, BIN_TIME if told is None else told)
    edges = 0 if by_host else edges + int(np.sum(by_samples))
    return AppliedCurrent(steps, ends, edges, lead, away, timing or BIN_TIME, doubt)


def _doubt(rounds: FloatArray) -> FloatArray:
    """How far a step may lie on either side of where the others say, s; shape (n,).

    By how much longer its round trip took than the quickest: either on the way there or
    on the way back, which the host cannot tell apart.

    Args:
        rounds: from sending a set-point to hearing of it, s; not a number where that
            is not known.
    """
    known = np.isfinite(rounds)
    if not known.any():
        return np.zeros(rounds.size)
    return np.where(known, rounds - rounds[known].min(), 0.0) / 2


def _timing(
    heard: FloatArray, early: FloatArray, coil_lag: float, width: float
) -> float:
    """Half of the 95 % band of a step's time, s: its bin, or less if they agree better.

    What scatters between neighbours is how well edges are seen and how steadily the
    host heard of them, so it holds for steps that were moved by their neighbours too.
    What all edges share is that a current bends by L/R within a bin, which is put right
    (`_edge`) and left open as well: L/R is not known exactly.

    Args:
        heard: when the host heard of each step that was seen, s.
        early: by how much it came before, s.
        coil_lag: L/R, s; 0 where it is not known.
        width: of a bin, s.
    """
    if heard.size < MANY or coil_lag <= 0:
        return width
    beside = (heard[1:-1] - heard[:-2]) / (heard[2:] - heard[:-2])
    between = (1 - beside) * early[:-2] + beside * early[2:]
    apart = (early[1:-1] - between) ** 2 / (1 + (1 - beside) ** 2 + beside**2)
    scatter = math.sqrt(float(np.mean(apart)))
    return min(width, math.hypot(Z95 * scatter, width**2 / (8 * coil_lag)))


def _of_three(values: FloatArray) -> FloatArray:
    """Each value, or where it lies outside those beside it the nearer of them."""
    beside = np.pad(values, 1, mode="edge")
    middle: FloatArray = np.median([beside[:-2], values, beside[2:]], axis=0)
    return middle


def _level(sent: float, read: FloatArray) -> float:
    known = read[np.isfinite(read)]
    return float(known.mean()) if known.size else float(sent)


class _Edge(NamedTuple):
    """A step of the current, as the shunt shows it.

    Attributes:
        time: when half of it was passed, s.
        width: of the bins in which it was seen, s.
        band: half of the 95 % band that noise and hum leave to `time`, s.
    """

    time: float
    width: float
    band: float


def _edge(
    shunt: Shunt, since: float, heard: float, old: float, new: float, coil_lag: float
) -> _Edge | None:
    """When the current passed half the step to `new` A; None if no shunt shows it.

    Between two bins the shunt is taken to rise along a line, and a bin has the current
    of its middle; that is put right for what bends by L/R, to second order of a bin.
    """
    time, value = shunt(since, heard + AFTER)
    if time.size < 3:
        return None
    done = (value - old) / (new - old)
    past = np.flatnonzero(done >= 0.5)
    if not past.size or past[0] == 0:
        return None
    i = int(past[0])
    if done[i:].min() < BACK:
        return None  # a crest of hum nearly as large as the step
    if time[i] - time[i - 1] > 1.5 * np.median(np.diff(time)):
        return None  # it came in a gap
    level = value[: i - 1][time[: i - 1] > since + SETTLED]
    noise = float(level.std()) if level.size > 1 else 0.0
    band = edge_band(noise, new - old, coil_lag)
    if band is None:
        return None
    part = (0.5 - done[i - 1]) / (done[i] - done[i - 1])
    width = float(time[i] - time[i - 1])
    if coil_lag < width:  # what then happens within a bin is no bend
        return _Edge(float(time[i - 1] + part * width), width, band)
    late = (part * (1 - part) / 2 + 1 / 24) * width**2 / coil_lag
    return _Edge(float(time[i - 1] + part * width - late), width, band)


def edge_band(noise: float, step: float, coil_lag: float) -> float | None:
    """Half of the 95 % band, s, of when a step passed half its height under noise.

    What lowers the current of a step that comes by L/R delays that more than as much
    that raises it hastens it. None where so much may pass for an edge.

    Args:
        noise: standard deviation of the shunt's bins, A; 0.71 of a hum's amplitude.
        step: of the current, A.
        coil_lag: L/R, s.
    """
    part = Z95 * noise / abs(step)
    if part >= TOO_NOISY:
        return None
    return max(-coil_lag * math.log1p(-2 * part), part * BIN_TIME)
