"""Advancing the twin beside a run, in slices, away from the window's thread."""

from __future__ import annotations

import numpy as np

from gui.lanes.twin import TwinSlice
from tactile_lab.acquisition.live_model import LiveModel
from tactile_lab.errors import TactileLabError
from tactile_lab.scene.scene import Scene
from tactile_lab.trace import Trace

EVERY = 0.3
"""Seconds between slices."""

BEHIND = 0.15
"""How far the twin of a run in progress stays behind the samples, s: the host hears of
a set-point only after the samples that it moved."""

STEP = 1e-3
"""Length of a bin of the twin, s."""

KEPT = ("V_C1", "V_C2")


class LiveTwin:
    """The scene's circuit under the force that the applied current gives."""

    def __init__(self, scene: Scene) -> None:
        self._model = LiveModel.of(scene)

    def add(self, at: float, amperes: float) -> None:
        """A set-point was applied at run time `at` s."""
        self._model.add(at, amperes)

    def until(self, end: float) -> TwinSlice | None:
        """Advance to `end` s; None where there is nothing new or no answer."""
        begin = self._model.reached
        if end - begin < 2 * STEP:
            return None
        try:
            out = self._model.until(end)
        except TactileLabError:
            return None
        count = max(2, round((end - begin) / STEP))
        grid = np.linspace(begin, end, count, endpoint=False)
        bins = {}
        for signal in KEPT:
            value = out.sample(signal, grid)
            step = (end - begin) / count
            bins[signal] = Trace.bins(grid, value, value, value, step)
        spikes = np.empty(0) if out.spike_times is None else out.spike_times
        return TwinSlice(bins, spikes, end)
