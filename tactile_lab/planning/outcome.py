"""Outcomes as the model expects them, computed only when they are looked at."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.drive import Drive
from tactile_lab.errors import SceneError
from tactile_lab.scene.scene import Scene
from tactile_lab.trial import Outcome, Trial
from tactile_lab.waveform import Waveform

if TYPE_CHECKING:
    from tactile_lab.model.solution import Solution
    from tactile_lab.model.state import State

TRACE_POINTS = 2000


@dataclass(frozen=True, eq=False)
class Step:
    """One trial in its place.

    Attributes:
        trial: what was asked.
        start: on the run's time axis, s.
        force: N, from 0 to the trial's length: as given, or as the coil plays it.
        current: A, likewise; None where the force is taken as given.
        drive: how the coil plays it; None where the force is taken as given.
        voltages: of the circuit, by name, V, that sources were set to so far.
    """

    trial: Trial
    start: float
    force: Waveform
    current: Waveform | None
    drive: Drive | None = None
    voltages: Mapping[str, float] = field(default_factory=dict)

    @property
    def listed(self) -> int:
        """Points of the list that plays it; 0 where none does."""
        if self.drive is None or self.drive.points is None:
            return 0
        return len(self.drive.points)


class ModelAlong:
    """The model along the steps of a plan, solved a step at a time as it is asked for.

    Each step goes on from the state the one before has left, so that many presses take
    as much longer as there are more of them.

    Attributes:
        steps: in order; whoever plans puts them in.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.steps: list[Step] = []
        self._states: dict[tuple[Any, ...], list[State]] = {}

    def during(self, index: int, keep: tuple[str, ...]) -> Solution:
        """What the model does in a step, at times of the run.

        Raises:
            ParameterError: a force or start the model does not take.
            SolverError: the model cannot answer.
        """
        from tactile_lab.model.advance import advance
        from tactile_lab.model.simulate import state_at_start
        from tactile_lab.planning.preview import DEFAULT_TOLERANCE

        voltages = self.steps[index].voltages
        # V_P depends on no voltage, and the rest has settled since one was changed
        circuit = self.scene.circuit.at(voltages)
        known = self._states.setdefault((keep, *sorted(voltages.items())), [])
        if not known:
            force = float(self.steps[0].force.value[0])
            known.append(state_at_start(circuit, force, self.scene.start))
        while True:
            at = min(len(known) - 1, index)
            step, before = self.steps[at], known[at]
            # lists load between two steps, where the force stays as it was
            held = Waveform.constant(before.force)
            found = advance(
                circuit,
                before,
                joined([(before.time, held), (step.start, step.force)]),
                step.start + step.trial.length,
                keep=keep,
                tolerance=DEFAULT_TOLERANCE,
            )
            if at + 1 == len(known):
                known.append(found.after)
            if at == index:
                return found


class ModelOutcome(Outcome):
    """An outcome the model computes when, and only when, it is looked at."""

    def __init__(self, model: ModelAlong, index: int) -> None:
        step = model.steps[index]
        for name, value in (
            ("trial", step.trial),
            ("index", index),
            ("start", step.start),
            ("skipped", 0),
            ("codes", {}),
            ("_model", model),
            ("looked_at", False),
            ("fired", 0),
        ):
            object.__setattr__(self, name, value)

    _model: ModelAlong
    looked_at: bool
    """Whether anything of the model was asked for: what follows may depend on it."""
    fired: int
    """Spikes, where these were asked for; else 0."""

    @property
    def spike_times(self) -> FloatArray:
        """Spikes of this trial, s from its start."""
        scene = self._model.scene
        if not scene.asked & {"spikes", "rate"}:
            raise SceneError(
                f"protocol {scene.protocol.name} looks at spikes, but neither "
                'records them nor declares needs = ("spikes",).'
            )
        spikes = self._found("spikes").spike_times
        end = self.start + self.trial.length
        mine = spikes[(spikes >= self.start) & (spikes < end)] - self.start
        object.__setattr__(self, "fired", int(mine.size))
        return mine

    @property
    def current(self) -> FloatArray:
        """Planned current, A."""
        wave = self._model.steps[self.index].current
        if wave is None:
            return np.empty((0, 2))
        return np.column_stack([wave.time, wave.value])

    @property
    def rest(self) -> dict[str, float]:
        """The model's signals just before the trial."""
        found = self._found(*self._measured)
        at = np.array([self.start])
        return {name: float(found.sample(name, at)[0]) for name in self._measured}

    @property
    def traces(self) -> dict[str, FloatArray]:
        """The model's signals during the trial."""
        found = self._found(*self._measured)
        times = np.linspace(0.0, self.trial.length, TRACE_POINTS)
        absolute = np.minimum(self.start + times, found.end)
        return {
            name: np.column_stack([times, found.sample(name, absolute)])
            for name in self._measured
        }

    @property
    def _measured(self) -> tuple[str, ...]:
        signals = ("V_C1", "V_C2")
        recorded = self._model.scene.record.signals
        return tuple(name for name in signals if name in recorded)

    def _found(self, *keep: str) -> Solution:
        object.__setattr__(self, "looked_at", True)
        return self._model.during(self.index, keep)


def joined(waves: Sequence[tuple[float, Waveform]]) -> Waveform:
    """Waveforms one after another, each put at its start."""
    time = np.concatenate([wave.time + start for start, wave in waves])
    value = np.concatenate([wave.value for _, wave in waves])
    # the sum of lengths may round
    return Waveform.tidied(np.maximum.accumulate(time), value)
