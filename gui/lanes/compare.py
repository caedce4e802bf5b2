"""Two or three runs in the same lanes: colour means run here, never channel.

Oscillating channels are stacked: three saw-teeth over each other cannot be read. Slow
ones and the rate lie over each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np

from gui.lanes.expected import Stretch, starts
from gui.lanes.lane import Lane
from gui.lanes.source import Member, Source
from tactile_lab.arrays import FloatArray
from tactile_lab.trace import Trace

if TYPE_CHECKING:
    from gui.lanes.view import TimeView


class ComparisonRows(Enum):
    """How compared runs share a lane."""

    STACK = "stack oscillating channels, lay slow ones over each other"
    OVERLAY = "lay all over each other"
    DIFFERENCE = "slow channels less those of the reference, the others stacked"


STACKED = frozenset({"V_C2", "V_K", "spikes"})
MARKS = ("●", "■", "▲")
"""Runs differ in marker too, not by colour alone."""


class Comparison(Source):
    """Compared runs as one source; what is asked of one run is answered by the first.

    Args:
        members: two or three runs, the reference first.

    Attributes:
        layout: how they share a lane.
        first: the reference.
    """

    holds: list[Stretch] = []  # noqa: RUF012
    spikes: FloatArray = np.empty(0)

    def __init__(self, members: list[Member]) -> None:
        self._members = members
        self.layout = ComparisonRows.STACK
        # what every one of the runs stored has a lane
        common = set.intersection(*(set(m.source.signals) for m in members))
        self.signals = tuple(common)
        self.first = members[0].source
        self.holds, self.spikes = self.first.holds, self.first.spikes
        self.counted = self.first.counted
        self.simulated = any(member.source.simulated for member in members)

    @property
    def members(self) -> list[Member]:
        """The runs, shifted as they were aligned."""
        return self._members

    @property
    def unrated(self) -> Sequence[tuple[Stretch, str]]:
        """Of the reference."""
        return self.first.unrated

    @property
    def reach(self) -> float:
        """End of the longest, s."""
        return max(m.source.reach + m.shift for m in self.members)

    @property
    def length(self) -> float:
        """End of the longest, s."""
        return self.reach

    def measured(self, signal: str, start: float, end: float, count: int) -> Trace:
        """Of the reference."""
        return self.first.measured(signal, start, end, count)

    def take_fetched(self) -> bool:
        """Whether samples have arrived since this was last asked."""
        return any([member.source.take_fetched() for member in self.members])

    def read_all(self) -> None:
        """Of each run."""
        for member in self.members:
            member.source.read_all()

    def close(self) -> None:
        """Let go of all files."""
        for member in self.members:
            member.source.close()

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
        self._members = [
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
        self._members = moved
        return agreed

    def stacks(self, lane: Lane) -> bool:
        """Whether the runs lie above each other in a lane."""
        return self.layout is not ComparisonRows.OVERLAY and lane.key in STACKED

    def subtracts(self, lane: Lane) -> bool:
        """Whether the reference is taken from the runs in a lane.

        Not from the rate: that of a run is not defined at another run's spikes.
        """
        slow = lane.key not in STACKED and lane.key != "rate"
        return self.layout is ComparisonRows.DIFFERENCE and slow

    def shown(self, lane: Lane, start: float, end: float, count: int) -> list[Trace]:
        """Each run's trace in a lane's unit, on the common time."""
        found = super().shown(lane, start, end, count)
        if self.subtracts(lane):
            grid = np.linspace(start, end, count)
            return [one.minus(found[0], grid) for one in found]
        return found

    def right_edge(self, view: TimeView, lane: Lane) -> float:
        """Where runs are read on the right: all at once, where all are seen to go on.

        Runs of the same length end a little apart, when shifted.
        """
        ends = [m.source.ends(lane.key) + m.shift for m in self.members]
        return min([view.end, *(e for e in ends if e > view.end - 0.1 * view.width)])


def _index(source: Source, time: float) -> int:
    return max(0, int(np.searchsorted(starts(source.holds), time, side="right")) - 1)


def _start(source: Source, index: int) -> float:
    """Start of a step, or of the last if there are fewer, s."""
    found = starts(source.holds)
    return float(found[min(index, found.size - 1)]) if found.size else 0.0


def _nearest(times: FloatArray, at: float) -> float:
    """Of `times`, s, the one nearest to `at`; infinite without any."""
    return float(times[np.argmin(np.abs(times - at))]) if times.size else float("inf")
