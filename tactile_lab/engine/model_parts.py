"""The model beside a run, in progress or on disk, as parts that can be drawn."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.engine.events import ModelPart
from tactile_lab.errors import TactileLabError
from tactile_lab.trace import Trace

if TYPE_CHECKING:
    from tactile_lab.acquisition.live_model import LiveModel
    from tactile_lab.model.solution import Solution
    from tactile_lab.model.state import State
    from tactile_lab.waveform import Waveform

STEP = 1e-3
"""Length of a bin, s; of a whole run on disk while there are at most `MOST`."""

MOST = 65_536
PER = 4
"""Samples of the model in a bin, besides those at its spikes."""
SOLVED = 4
"""Slices that are kept solved, some 8 MB each: who looks closely looks on beside."""


def live_part(model: LiveModel, end: float) -> ModelPart | None:
    """Advance a model to run time `end` s; None: nothing is new, or no answer."""
    begin = model.reached
    if end - begin < 2 * STEP:
        return None
    try:
        out = model.until(end)
    except TactileLabError:
        return None
    count = max(2, round((end - begin) / STEP))
    grid = np.linspace(begin, end, count, endpoint=False)
    bins = {}
    for signal in ("V_C1", "V_C2"):
        value = out.sample(signal, grid)
        bins[signal] = Trace.bins(grid, value, value, value, (end - begin) / count)
    return ModelPart(bins, out.spike_times, end)


class StoredParts:
    """The circuit of a run on disk, exact at any zoom.

    It is solved once as a whole, in slices of which only the states between are kept;
    a closer look solves those it sees anew. As in the report, levels are those read
    back, and their edges lie where the shunt saw them.

    Raises:
        RunFolderError, SceneError: it cannot be read.
        SolverError: the model cannot follow this force.
    """

    def __init__(self, folder: Path) -> None:
        from tactile_lab.planning.preview import in_slices
        from tactile_lab.store.run import Run

        with Run.load(folder) as run:
            self._length, self._scene, force = run.duration, run.scene, run.force
            self._kept = [s for s in ("V_C1", "V_C2", "V_K") if s in run.signals]
        self._keep = (*self._kept, "spikes")
        self._begins: list[tuple[State, Waveform, float]] = []
        spikes: list[FloatArray] = []

        def slices() -> Iterator[Solution]:
            for part in in_slices(self._scene, force, self._length, self._keep):
                self._begins.append((part.before, part.force, part.end))
                spikes.append(part.spike_times)
                yield part

        self._solved = lru_cache(maxsize=SOLVED)(self._solve)
        count = self._count(0.0, self._length)
        self._whole = binned(slices(), self._kept, 0.0, self._length, count)
        self._ends = np.array([end for _, _, end in self._begins])
        self._spikes = np.concatenate(spikes)

    def part(
        self, start: float = 0.0, end: float = np.inf, count: int | None = None
    ) -> ModelPart:
        """What lies in [start, end] s, in `count` bins; the whole run unless given."""
        start, end = max(start, 0.0), min(end, self._length)
        if count is None and (start, end) == (0.0, self._length):
            return ModelPart(self._whole, self._spikes, end)
        first, last = np.searchsorted(self._spikes, [start, end])
        begin = int(np.searchsorted(self._ends, start, side="right"))
        stop = int(np.searchsorted(self._ends, end)) + 1
        parts = (self._solved(number) for number in range(begin, stop))
        count = count or self._count(start, end)
        bins = binned(parts, self._kept, start, end, count)
        return ModelPart(bins, self._spikes[first:last], end)

    def _solve(self, number: int) -> Solution:
        from tactile_lab.model.advance import advance

        before, force, end = self._begins[number]
        return advance(self._scene.circuit, before, force, end, keep=self._keep)

    @staticmethod
    def _count(start: float, end: float) -> int:
        return int(np.clip((end - start) / STEP, 2, MOST))


def binned(
    parts: Iterable[Solution],
    signals: Sequence[str],
    start: float,
    end: float,
    count: int,
) -> dict[str, Trace]:
    """Signals in `count` bins of [start, end] s; no spike falls between.

    Args:
        parts: consecutive slices of a model that keeps them and its spikes.
        signals: some of V_C1, V_C2 and V_K.
        start: not before the first slice, s.
        end: not after the last slice, s.
        count: of bins.
    """
    from tactile_lab.model.slices import Samples

    bins = np.linspace(start, end, count, endpoint=False)
    width = (end - start) / count
    grid = bins[:, None] + width / PER * np.arange(PER)
    regular = {name: Samples(name, grid, end) for name in signals}
    # a bin sees both sides of its spike: the peak before and the bottom after
    low = {name: np.full(count, np.inf) for name in signals}
    high = {name: np.full(count, -np.inf) for name in signals}
    for part in parts:
        spikes = part.spike_times
        spikes = spikes[(spikes >= start) & (spikes < end)]
        at = np.clip(((spikes - start) / width).astype(np.intp), 0, count - 1)
        before = np.maximum(np.nextafter(spikes, 0.0), part.before.time)
        for name in signals:
            regular[name].take(part)
            for when in (before, spikes):
                value = part.sample(name, when)
                np.minimum.at(low[name], at, value)
                np.maximum.at(high[name], at, value)
    found = {}
    for name, samples in regular.items():
        value = samples.value
        least = np.minimum(low[name], value.min(axis=1))
        most = np.maximum(high[name], value.max(axis=1))
        found[name] = Trace.bins(bins, least, most, value.mean(axis=1), width)
    return found
