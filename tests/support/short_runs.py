"""Scenes short enough to be run whole, on the simulated bench, many times."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from tactile_lab.acquisition import events
from tactile_lab.acquisition.ending import Executed
from tactile_lab.bench import Bench
from tactile_lab.engine.execution import Execution
from tactile_lab.scene.load import load
from tactile_lab.scene.scene import Scene
from tactile_lab.store.run import Run
from tactile_lab.waveform import Waveform


@dataclass
class Ran:
    """A run that has ended, and all it told."""

    done: Executed
    told: list[events.Event] = field(default_factory=list)

    @property
    def folder(self) -> Path:
        return self.done.folder

    def stored(self) -> Run:
        return Run.load(self.folder)

    def lateness(self) -> list[float]:
        """How late the samples of each trial are after the run's points, ±20 ms, s."""
        run = self.stored()
        trace = run.signal("coil_current").trace(cells=20_000)
        applied = Waveform.stairs(run.applied.steps, run.duration)
        shifts, found = np.arange(-20e-3, 20e-3, 0.5e-3), []
        for start in run.trials["start"]:
            inside = (trace.time > start - 0.05) & (trace.time < start + 1.15)
            time, seen = trace.time[inside] + trace.width / 2, trace.mean[inside]
            off = [np.abs(applied.at(time - by) - seen).mean() for by in shifts]
            found.append(float(shifts[np.argmin(off)]))
        return found


@pytest.fixture
def run_scene(tmp_path: Path) -> Callable[..., Ran]:
    """Run a scene by name with overrides, SI overrides as text, to the end."""

    def run(
        *overrides: str,
        scene: str = "demo",
        bench: Callable[[Scene], Bench] | None = None,
        watch: Callable[[Execution, events.Event], None] | None = None,
    ) -> Ran:
        loaded = load(scene, overrides)
        told: list[events.Event] = []

        def emit(event: events.Event) -> None:
            told.append(event)
            if watch is not None:
                watch(execution, event)

        made = bench(loaded) if bench is not None else None
        execution = Execution(loaded, tmp_path / "runs", bench=made, emit=emit)
        return Ran(execution.run(), told)

    return run


SHORT = (
    'protocol.levels=["200 mN"]',
    "protocol.hold=0.8 s",
    "protocol.rest=0.3 s",
)
"""One pulse at the highest level: 1.6 s, a dozen spikes."""


@pytest.fixture
def short() -> tuple[str, ...]:
    return SHORT
