"""Two or three runs in the same lanes: colour means run here, never channel.

Oscillating channels are stacked: three saw-teeth over each other cannot be read. Slow
ones and the rate lie over each other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtGui import QPainter

from gui.lanes import paint
from gui.lanes.axis import nice_range
from gui.lanes.decimate import Drawn, FloatArray
from gui.lanes.derive import averaged, less, rate_of, scaled
from gui.lanes.expected import Hold, starts
from gui.lanes.ground import Place, ground, row_names, rows_of
from gui.lanes.lane import Kind, Lane
from gui.lanes.paint import Frame
from gui.lanes.view import TimeView
from gui.look.tokens import Tokens

if TYPE_CHECKING:
    from gui.lanes.stored import RunSource


class Layout(Enum):
    """How compared runs share a lane."""

    STACK = "stack oscillating channels, lay slow ones over each other"
    OVERLAY = "lay all over each other"
    DIFFERENCE = "slow channels less those of the reference, the others stacked"


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
        layout: how they share a lane.
    """

    running = False
    model = None
    followed = 0.0

    def __init__(self, members: list[Member]) -> None:
        self.members = members
        self.layout = Layout.STACK

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

    def align(self, how: str, at: float = 0.0) -> float:
        """Shift the runs; the reference stays.

        Args:
            how: "start"; "step": the reference's step at `at` and the same of others;
                "cursor": what is nearest to `at` as the runs lie now, a spike or the
                beginning of a step, whichever it is in the reference.
            at: s.

        Returns:
            Where they agree, s.
        """
        if how == "cursor":
            return self._align_nearest(at)
        index = _index(self.first, at)
        agreed = _start(self.first, index) if how == "step" else 0.0
        self.members = [
            replace(
                member,
                shift=agreed - _start(member.source, index) if how == "step" else 0.0,
            )
            for member in self.members
        ]
        return agreed

    def _align_nearest(self, at: float) -> float:
        events = (self.first.spikes, starts(self.first.holds))
        near = [_nearest(times, at) for times in events]
        agreed = min(near, key=lambda time: abs(time - at))
        spike = agreed == near[0]
        moved = []
        for member in self.members:
            times = member.source.spikes if spike else starts(member.source.holds)
            found = _nearest(times, at - member.shift)
            shift = agreed - found if np.isfinite(found) else member.shift
            moved.append(replace(member, shift=shift))
        self.members = moved
        return agreed

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

    def stacks(self, lane: Lane) -> bool:
        """Whether the runs lie above each other in a lane."""
        return self.layout is not Layout.OVERLAY and lane.signal in STACKED

    def subtracts(self, lane: Lane) -> bool:
        """Whether the reference is taken from the runs in a lane.

        Not from the rate: that of a run is not defined at another run's spikes.
        """
        slow = lane.signal not in STACKED and lane.kind is not Kind.RATE
        return self.layout is Layout.DIFFERENCE and slow

    def drawn(self, lane: Lane, start: float, end: float, count: int) -> list[Drawn]:
        """Each run's trace of a lane, in shown units and on the common time."""
        found = [self._of(member, lane, start, end, count) for member in self.members]
        if self.subtracts(lane):
            grid = np.linspace(start, end, count)
            return [less(one, found[0], grid) for one in found]
        return found

    def right_edge(self, view: TimeView) -> float:
        """Where runs are read on the right: all at once, where all are seen to go on.

        Runs of the same length end a little apart, when shifted.
        """
        ends = [m.source.reach + m.shift for m in self.members]
        return min([view.end, *(e for e in ends if e > view.end - 0.1 * view.width)])

    def _of(
        self, member: Member, lane: Lane, start: float, end: float, count: int
    ) -> Drawn:
        a, b = start - member.shift, end - member.shift
        if lane.kind is Kind.RATE:
            steps = starts(member.source.holds)
            found = rate_of(member.source.spikes, a, b, count, steps)
        else:
            found = member.source.trace(lane.signal, a, b, count)
        found = scaled(found, lane.scale)
        if member.shift and not found.empty:
            return replace(found, time=found.time + member.shift)
        return found


def _index(source: RunSource, time: float) -> int:
    return max(0, int(np.searchsorted(starts(source.holds), time, side="right")) - 1)


def _start(source: RunSource, index: int) -> float:
    """Start of a step, or of the last if there are fewer, s."""
    found = starts(source.holds)
    return float(found[min(index, found.size - 1)]) if found.size else 0.0


def _nearest(times: FloatArray, at: float) -> float:
    """Of `times`, s, the one nearest to `at`; infinite without any."""
    return float(times[np.argmin(np.abs(times - at))]) if times.size else float("inf")


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
    stacked = source.stacks(lane)
    drawn = source.drawn(lane, frame.start, frame.end, count)
    least = 0.1 * lane.least if source.subtracts(lane) else lane.least
    extents = [d.extent for d in drawn if d.extent is not None]
    if lane.kind in (Kind.FORCE, Kind.RATE):
        extents.append((0.0, 0.0))
    low, high = nice_range(
        min((e[0] for e in extents), default=0.0),
        max((e[1] for e in extents), default=1.0),
        least,
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
