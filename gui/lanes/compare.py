"""Two or three runs in the same lanes: colour means run here, never channel.

Oscillating channels are stacked: three saw-teeth over each other cannot be read. Slow
ones and the rate lie over each other.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtGui import QPainter

from gui.lanes import paint
from gui.lanes.axis import nice_range
from gui.lanes.decimate import Drawn, FloatArray
from gui.lanes.derive import averaged, rate_of, scaled
from gui.lanes.expected import Hold
from gui.lanes.ground import Place, ground, row_names, rows_of
from gui.lanes.lane import Kind, Lane
from gui.lanes.paint import Frame
from gui.look.tokens import Tokens

if TYPE_CHECKING:
    from gui.lanes.stored import RunSource

STACKED = frozenset({"V_C2", "V_K", "spikes"})
MARKS = ("●", "■", "▲")
"""Runs differ in marker too, not by colour alone."""


@dataclass(frozen=True, eq=False)
class Member:
    """One of the compared runs; `shift` is added to its times, s."""

    name: str
    source: RunSource
    shift: float = 0.0


class Comparison:
    """Compared runs as one source; what is asked of it is answered by the first.

    Attributes:
        members: two or three runs, the reference first.
        stacked: stack oscillating channels, else lay all over each other.
    """

    running = False
    model = None
    followed = 0.0

    def __init__(self, members: list[Member]) -> None:
        self.members = members
        self.stacked = True

    @property
    def first(self) -> RunSource:
        """The reference."""
        return self.members[0].source

    @property
    def reach(self) -> float:
        """End of the longest, s."""
        return max(m.source.reach + m.shift for m in self.members)

    @property
    def length(self) -> float:
        """End of the longest, s."""
        return self.reach

    @property
    def holds(self) -> list[Hold]:
        """Of the reference."""
        return self.first.holds

    @property
    def spikes(self) -> FloatArray:
        """Of the reference."""
        return self.first.spikes

    @property
    def twin_spikes(self) -> FloatArray:
        """None: the model is not compared."""
        return np.empty(0)

    @property
    def signals(self) -> set[str]:
        """What every one of the runs stored."""
        return set.intersection(*(set(m.source.signals) for m in self.members))

    def align(self, how: str, cursor: float = 0.0) -> None:
        """Shift runs to agree at their "start" or at the "step" under `cursor`."""
        moved = []
        for member in self.members:
            shift = 0.0
            if how == "step":
                shift = _near(self.first, cursor, None) - _near(
                    member.source, cursor, _index(self.first, cursor)
                )
            moved.append(Member(member.name, member.source, shift))
        self.members = moved

    def trace(self, signal: str, start: float, end: float, count: int) -> Drawn:
        """Of the reference."""
        return self.first.trace(signal, start, end, count)

    def twin(self, signal: str, start: float, end: float, count: int) -> Drawn:
        """Nothing: the model is not compared."""
        return Drawn.nothing()

    def planned(self, start: float, end: float) -> tuple[FloatArray, FloatArray]:
        """Nothing."""
        return np.empty(0), np.empty(0)

    def take_fetched(self) -> bool:
        """Whether samples have arrived since this was last asked."""
        return any([member.source.take_fetched() for member in self.members])

    @property
    def simulated(self) -> bool:
        """Whether any of them is simulated."""
        return any(member.source.simulated for member in self.members)

    @property
    def path(self) -> Path:
        """Folder of the reference."""
        return self.first.path

    def close(self) -> None:
        """Let go of all files."""
        for member in self.members:
            member.source.close()

    def of(
        self, member: Member, lane: Lane, start: float, end: float, count: int
    ) -> Drawn:
        """One run's trace of a lane, in shown units and on the common time."""
        a, b = start - member.shift, end - member.shift
        if lane.kind is Kind.RATE:
            found = rate_of(member.source.spikes, a, b, count)
        else:
            found = member.source.trace(lane.signal, a, b, count)
        found = scaled(found, lane.scale)
        if member.shift and not found.empty:
            time = found.time + member.shift
            found = Drawn(time, found.low, found.high, found.mean, found.gap)
        return found


def _index(source: RunSource, time: float) -> int:
    starts = np.array([hold.start for hold in source.holds] or [0.0])
    return max(0, int(np.searchsorted(starts, time, side="right")) - 1)


def _near(source: RunSource, time: float, index: int | None) -> float:
    holds = source.holds
    if not holds:
        return 0.0
    at = _index(source, time) if index is None else index
    return holds[min(at, len(holds) - 1)].start


def paint_lane(
    painter: QPainter,
    frame: Frame,
    lane: Lane,
    place: Place,
    source: Comparison,
    tokens: Tokens,
) -> tuple[tuple[float, float], list[Drawn]]:
    """Draw one lane of a comparison; the value range it used, and each run's trace."""
    count = max(50, int(frame.right - frame.left))
    stacked = source.stacked and lane.signal in STACKED
    drawn = [source.of(m, lane, frame.start, frame.end, count) for m in source.members]
    extents = [d.extent for d in drawn if d.extent is not None]
    if lane.kind in (Kind.FORCE, Kind.RATE):
        extents.append((0.0, 0.0))
    low, high = nice_range(
        min((e[0] for e in extents), default=0.0),
        max((e[1] for e in extents), default=1.0),
        lane.least,
    )
    raster = lane.kind is Kind.RASTER
    whole = Frame(
        frame.left, frame.right, frame.top, frame.bottom, frame.start, frame.end,
        low, high,
    )  # fmt: skip
    ground(
        painter, whole, source, tokens,
        Place(place.top, place.bottom, not (stacked or raster)),
    )  # fmt: skip
    names = MARKS[: len(source.members)]
    rows = rows_of(whole, len(names)) if stacked or raster else []
    if rows:
        row_names(painter, whole, tokens, names, tokens.runs)
    painter.save()
    painter.setClipRect(whole.area.adjusted(0, -5, 0, 4))
    painter.setRenderHint(QPainter.RenderHint.Antialiasing, not raster)
    for number, (member, found) in enumerate(zip(source.members, drawn, strict=True)):
        line = paint.pen(tokens.runs[number])
        if raster:
            times = member.source.spikes + member.shift
            paint.bars(painter, whole, times, rows[number], line)
            continue
        own = whole
        if rows:
            top, bottom = rows[number]
            own = Frame(
                whole.left, whole.right, top, bottom, whole.start, whole.end, low, high
            )
        plain = found if lane.signal == "V_K" else averaged(found)
        paint.trace(painter, own, plain, line)
    painter.restore()
    return (low, high), drawn
