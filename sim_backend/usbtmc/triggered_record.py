"""One record of a digitiser with memory: what block mode and bench scopes capture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim_backend.plant.scope_source import Acquisition, Codes, SampleSource

_PART = 1 << 18


@dataclass(frozen=True)
class Edge:
    """A trigger: input row, code to cross, and in which direction."""

    row: int
    code: int
    rising: bool = True

    def first(self, codes: Codes, previous: int | None) -> int | None:
        """Index of the first sample beyond the edge; `previous` came just before."""
        level = codes[self.row].astype(np.int32)
        before = np.empty_like(level)
        before[0] = level[0] if previous is None else previous
        before[1:] = level[:-1]
        if self.rising:
            crossed = (before < self.code) & (level >= self.code)
        else:
            crossed = (before > self.code) & (level <= self.code)
        found = np.flatnonzero(crossed)
        return int(found[0]) if found.size else None


class TriggeredRecord:
    """Samples around a trigger, searched causally as they are taken.

    Args:
        source: what lies at the inputs.
        acquisition: how it is sampled; sample 0 is taken when armed.
        before, after: samples before and from the trigger on.
        edge: what to wait for; None for nothing but force.
        forced_at: sample at which it triggers by itself; None waits for ever.
    """

    def __init__(
        self,
        source: SampleSource,
        acquisition: Acquisition,
        *,
        before: int,
        after: int,
        edge: Edge | None = None,
        forced_at: int | None = None,
    ) -> None:
        self.acquisition = acquisition
        self.trigger: int | None = None
        self._source = source
        self._before, self._after = before, after
        self._edge = edge
        self._forced_at = forced_at
        self._kept = np.zeros((len(acquisition.inputs), 0), dtype=np.int16)
        self._over = np.zeros(len(acquisition.inputs), dtype=bool)
        self._next = 0

    @property
    def armed(self) -> bool:
        """Whether it waits for a trigger with all samples before it taken."""
        return self.trigger is None and self._next >= self._before

    def force(self, sample: int) -> None:
        """Trigger at `sample`, or as soon after it as possible."""
        self._forced_at = max(sample, self._next, self._before)

    def advance(self, produced: int) -> bool:
        """Take all samples up to `produced`; whether the record is complete."""
        while self._next < produced and not self.complete:
            if self.trigger is None:
                most = self._next + _PART
            else:
                most = self.trigger + self._after
            self._take(min(produced, most) - self._next)
        return self.complete

    @property
    def complete(self) -> bool:
        """Whether all samples are there."""
        return self.trigger is not None and self._next >= self.trigger + self._after

    @property
    def first(self) -> int:
        """Index of the record's first sample since it was armed."""
        return (self.trigger or 0) - self._before

    def codes(self) -> tuple[Codes, tuple[bool, ...]]:
        """The complete record, (inputs, before + after), and over-range flags."""
        begin = self._kept.shape[1] - (self._next - self.first)
        wanted = self._kept[:, begin : begin + self._before + self._after]
        return wanted, tuple(bool(o) for o in self._over)

    def _take(self, samples: int) -> None:
        codes, over = self._source.render(self.acquisition, self._next, samples)
        previous = None
        if self._edge is not None and self._kept.shape[1]:
            previous = int(self._kept[self._edge.row, -1])
        start, self._next = self._next, self._next + samples
        self._over |= np.array(over, dtype=bool)
        self._kept = np.concatenate([self._kept, codes], axis=1)
        if self.trigger is None:
            self.trigger = self._search(codes, previous, start)
        if self.trigger is None and self._before:
            self._kept = self._kept[:, -self._before :]
        elif self.trigger is None:
            self._kept = self._kept[:, -1:]
        elif self._next < self.trigger + self._after:
            # the trigger lies in this part, the record's end does not
            self._kept = self._kept[:, -(self._next - self.first) :]

    def _search(self, codes: Codes, previous: int | None, start: int) -> int | None:
        blind = max(0, self._before - start)
        if blind >= codes.shape[1]:
            return None
        forced = self._forced_at
        found = None
        if self._edge is not None:
            if blind:
                previous = int(codes[self._edge.row, blind - 1])
            found = self._edge.first(codes[:, blind:], previous)
        index = None if found is None else start + blind + found
        if forced is not None and start <= forced < self._next:
            index = forced if index is None else min(index, forced)
        return index
