"""The twin of a run on disk, exact at any zoom: the model is solved once, and kept."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gui.lanes.twin import TwinSlice
from tactile_lab.model.simulate import Result
from tactile_lab.planning.preview import model
from tactile_lab.store.run import Run
from tactile_lab.trace import FloatArray, Trace

MODELLED = ("V_C1", "V_C2", "V_K")
STEP = 1e-3
"""Length of a bin of the whole run, s, while there are at most `MOST`."""

MOST = 65_536
PER = 4
"""Samples of the model in a bin, besides those at its spikes."""


class WholeTwin:
    """The scene's circuit under the current the coil really carried.

    As in the report, levels are those read back, and their edges lie where the shunt
    saw them.

    Args:
        folder: of the run.

    Raises:
        RunFolderError, SceneError: it cannot be read.
        SolverError: the model cannot follow this force.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        with Run.load(folder) as run:
            self._length, scene, force = run.duration, run.scene, run.force
            kept = [signal for signal in MODELLED if signal in run.signals]
        self._result = model(scene, force, self._length, (*kept, "spikes"))
        self._kept = kept

    def whole(self) -> TwinSlice:
        """The whole run, and every spike."""
        count = int(np.clip(self._length / STEP, 2, MOST))
        return self._slice(0.0, self._length, count)

    def part(self, start: float, end: float, count: int) -> TwinSlice:
        """What lies in [start, end] s, in `count` bins."""
        return self._slice(max(start, 0.0), min(end, self._length), count)

    def _slice(self, start: float, end: float, count: int) -> TwinSlice:
        spikes = self._result.spike_times
        spikes = np.empty(0) if spikes is None else spikes
        first, last = np.searchsorted(spikes, [start, end])
        inside = spikes[first:last]
        bins = {
            signal: binned(self._result, signal, inside, start, end, count)
            for signal in self._kept
        }
        return TwinSlice(bins, inside, end)


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
