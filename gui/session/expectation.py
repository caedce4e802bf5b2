"""What is expected of a scene: its plan and the model's run of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from gui.lanes.expected import Preview, Stretch
from tactile_lab.engine.request import Request
from tactile_lab.store.applied_trial import stood
from tactile_lab.trial import BASELINE

if TYPE_CHECKING:
    # loading these takes a second: the window is on screen before
    from tactile_lab.engine.engine import Engine
    from tactile_lab.planning.estimate import Cost
    from tactile_lab.planning.needs import Needs
    from tactile_lab.planning.outcome import Step
    from tactile_lab.planning.plan import Plan
    from tactile_lab.scene.scene import Scene
    from tactile_lab.scene.tables import Record

MODELLED = ("V_C1", "V_C2", "V_K", "I_DS")
SPACING = 1e-3
MOST = 400_000


@dataclass(frozen=True, eq=False)
class Expectation:
    """A scene that can be run, and what it will do.

    Attributes:
        record: what is asked for.
        needs: what it opens and keeps.
        estimate: its cost.
        preview: what the model expects.
        warnings: where the run would not be what is asked for.
        assumptions: what its numbers rest on.
    """

    record: Record
    needs: Needs
    estimate: Cost
    preview: Preview
    warnings: tuple[str, ...]
    assumptions: tuple[str, ...]


def plan_request(engine: Engine, request: Request) -> Expectation:
    """Plan a request and have the model run it; in the engine."""
    return expect(request.load())


def expect(scene: Scene) -> Expectation:
    """Plan a scene and have the model run it.

    Raises:
        SceneError, LimitError: the scene cannot be run on its bench.
    """
    from tactile_lab.planning.plan import plan

    made = plan(scene)
    return Expectation(
        record=scene.record,
        needs=made.needs,
        estimate=made.estimate,
        preview=_preview(made),
        warnings=made.warnings,
        assumptions=made.assumptions,
    )


def _preview(made: Plan) -> Preview:
    """The plan's own prediction on the run's axis, which starts a baseline earlier."""
    drive, result = made.timeline, made.preview
    length = drive.duration + BASELINE
    holds = [_stretch(step) for step in drive.steps]
    force, none = drive.force.shifted(BASELINE), np.empty(0)
    if result is None:
        return Preview(force, {}, none, holds, length)
    count = int(np.clip(drive.duration / SPACING, 2000, MOST))
    time = np.linspace(0.0, drive.duration, count)
    traces = {}
    for name in MODELLED:
        if name not in made.scene.record.signals:
            continue
        at = time
        if name == "V_K" and result.spike_times is not None:
            at = np.union1d(time, _around(result.spike_times, drive.duration))
        traces[name] = (at + BASELINE, result.sample(name, at))
    spikes = none if result.spike_times is None else result.spike_times
    spikes = spikes[drive.streams_at(spikes)] + BASELINE  # others nobody sees
    return Preview(force, traces, spikes, holds, length)


def _stretch(step: Step) -> Stretch:
    """A trial, held while the force it is given stands still."""
    trial, start = step.trial, step.start + BASELINE
    found = Stretch.of(trial, start)
    held = stood(trial.hold, trial.level, step.force, step.force, 0.0, trial.length)
    return replace(found, held=held and (start + held[0], start + held[1]))


def _around(spikes: np.ndarray, length: float) -> np.ndarray:
    """Times at which a pulse of V_K shows its height, around each of the spikes."""
    if spikes.size > 20_000:
        return np.empty(0)
    offsets = np.array([-2e-6, 0.0, 1e-6, 3e-6, 1e-5, 4e-5])
    times = (spikes[:, None] + offsets[None, :]).ravel()
    clipped: np.ndarray = np.clip(times, 0.0, length)
    return clipped
