"""Advancing the twin beside a run, in slices, away from the window's thread."""

from __future__ import annotations

import time
from collections.abc import Callable
from queue import Empty, SimpleQueue

import numpy as np

from gui.lanes.twinned import TwinSlice
from tactile_lab.acquisition.live import Bins
from tactile_lab.errors import TactileLabError
from tactile_lab.model.advance import advance, rest
from tactile_lab.model.state import State
from tactile_lab.scene.scene import Scene
from tactile_lab.waveform import Waveform

EVERY = 0.3
"""Seconds between slices."""

STEP = 1e-3
"""Length of a bin of the twin, s."""

TOLERANCE = 1e-6
KEPT = ("V_C1", "V_C2")


class LiveTwin:
    """The scene's circuit under the force that the applied current gives.

    Each set-point holds until the next, as in the report.
    """

    def __init__(self, scene: Scene) -> None:
        self._circuit = scene.circuit
        self._magnet = scene.bench.magnet
        self._points: SimpleQueue[tuple[float, float]] = SimpleQueue()
        start = scene.start
        self._state = rest(scene.circuit)
        if start is not None:
            self._state = State(
                time=0.0, force=0.0, V_P=start.V_P, V_C1=start.V_C1, V_C2=start.V_C2
            )
        self._force = 0.0

    def add(self, at: float, amperes: float) -> None:
        """A set-point was applied at run time `at` s."""
        self._points.put((at, amperes))

    def run(
        self, reach: Callable[[], float | None], tell: Callable[[TwinSlice], None]
    ) -> None:
        """Follow a run until `reach()` is None; call in a thread of its own."""
        while (until := reach()) is not None:
            part = self.until(until)
            if part is not None:
                tell(part)
            time.sleep(EVERY)

    def until(self, end: float) -> TwinSlice | None:
        """Advance to `end` s; None where there is nothing new or no answer."""
        begin = self._state.time
        if end - begin < 2 * STEP:
            return None
        times, forces = [begin], [self._force]
        while True:
            try:
                at, amperes = self._points.get_nowait()
            except Empty:
                break
            at = min(max(at, times[-1]), end)
            force = float(self._magnet.force(amperes))
            if at > times[-1]:
                times.append(at)
                forces.append(forces[-1])
            elif len(times) > 1 and times[-2] == at:
                forces[-1] = force
                continue
            times.append(at)
            forces.append(force)
        self._force = forces[-1]
        wave = Waveform(np.array(times), np.array(forces))
        keep = (*KEPT, "spikes")
        try:
            self._state, out = advance(
                self._circuit, self._state, wave, end, keep=keep, tolerance=TOLERANCE
            )
        except TactileLabError:
            return None
        count = max(2, round((end - begin) / STEP))
        grid = np.linspace(begin, end, count, endpoint=False)
        bins = {}
        for signal in KEPT:
            value = out.sample(signal, grid).astype(np.float32)
            bins[signal] = Bins(grid, (end - begin) / count, value, value, value)
        spikes = np.empty(0) if out.spike_times is None else out.spike_times
        return TwinSlice(bins, spikes, end)


def twin_of(scene: Scene, current: np.ndarray, end: float) -> list[TwinSlice]:
    """The twin of a whole run; `current` has rows of time, s, and current, A."""
    twin = LiveTwin(scene)
    for at, amperes in current:
        twin.add(float(at), float(amperes))
    part = twin.until(end)
    return [] if part is None else [part]
