"""The model beside a run, in progress or on disk, as parts that can be drawn."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.engine.events import ModelPart
from tactile_lab.errors import TactileLabError
from tactile_lab.trace import Trace

if TYPE_CHECKING:
    from tactile_lab.acquisition.live_model import LiveModel
    from tactile_lab.model.simulate import Result

STEP = 1e-3
"""Length of a bin, s; of a whole run on disk while there are at most `MOST`."""

MOST = 65_536
PER = 4
"""Samples of the model in a bin, besides those at its spikes."""


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
    """The circuit of a run on disk, exact at any zoom: the model is solved once.

    As in the report, levels are those read back, and their edges lie where the shunt
    saw them.

    Raises:
        RunFolderError, SceneError: it cannot be read.
        SolverError: the model cannot follow this force.
    """

    def __init__(self, folder: Path) -> None:
        from tactile_lab.planning.preview import model
        from tactile_lab.store.run import Run

        with Run.load(folder) as run:
            self._length, scene, force = run.duration, run.scene, run.force
            self._kept = [s for s in ("V_C1", "V_C2", "V_K") if s in run.signals]
        self._result = model(scene, force, self._length, (*self._kept, "spikes"))

    def part(
        self, start: float = 0.0, end: float = np.inf, count: int | None = None
    ) -> ModelPart:
        """What lies in [start, end] s, in `count` bins; the whole run unless given."""
        start, end = max(start, 0.0), min(end, self._length)
        if count is None:
            count = int(np.clip((end - start) / STEP, 2, MOST))
        spikes = self._result.spike_times
        spikes = np.empty(0) if spikes is None else spikes
        first, last = np.searchsorted(spikes, [start, end])
        inside = spikes[first:last]
        bins = {
            str(signal): binned(self._result, signal, inside, start, end, count)
            for signal in self._kept
        }
        return ModelPart(bins, inside, end)


def binned(
    result: Result,
    signal: str,
    spikes: FloatArray,
    start: float,
    end: float,
    count: int,
) -> Trace:
    """A model's signal in `count` bins of [start, end] s; no spike falls between."""
    bins = np.linspace(start, end, count, endpoint=False)
    width = (end - start) / count
    grid = (bins[:, None] + width / PER * np.arange(PER)).ravel()
    regular = result.sample(signal, grid).reshape(count, PER)
    low, high = regular.min(axis=1), regular.max(axis=1)
    if spikes.size:
        at = np.clip(((spikes - start) / width).astype(np.intp), 0, count - 1)
        # a bin sees both sides of its spike: the peak before and the bottom after
        for when in (np.nextafter(spikes, 0.0), spikes):
            value = result.sample(signal, when)
            np.minimum.at(low, at, value)
            np.maximum.at(high, at, value)
    return Trace.bins(bins, low, high, regular.mean(axis=1), width)
