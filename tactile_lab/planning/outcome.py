"""Outcomes as the model expects them, computed only when they are looked at."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tactile_lab.drive import Drive
from tactile_lab.errors import SceneError
from tactile_lab.scene.scene import Scene
from tactile_lab.trial import Outcome, Trial
from tactile_lab.waveform import Waveform

if TYPE_CHECKING:
    from tactile_lab.model.simulate import Result

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


class ModelOutcome(Outcome):
    """An outcome the model computes when, and only when, it is looked at."""

    def __init__(
        self, scene: Scene, step: Step, index: int, steps: Sequence[Step]
    ) -> None:
        for name, value in (
            ("trial", step.trial),
            ("index", index),
            ("start", step.start),
            ("skipped", 0),
            ("codes", {}),
            ("_scene", scene),
            ("_step", step),
            ("_steps", steps),
            ("looked_at", False),
        ):
            object.__setattr__(self, name, value)

    _scene: Scene
    _step: Step
    _steps: Sequence[Step]
    looked_at: bool
    """Whether anything of the model was asked for: what follows may depend on it."""

    @property
    def spike_times(self) -> NDArray[np.float64]:
        """Spikes of this trial, s from its start."""
        if not self._scene.asked & {"spikes", "rate"}:
            raise SceneError(
                f"protocol {self._scene.protocol.name} looks at spikes, but neither "
                'records them nor declares needs = ("spikes",).'
            )
        spikes = self._model("spikes").spike_times
        assert spikes is not None
        end = self.start + self.trial.length
        return spikes[(spikes >= self.start) & (spikes < end)] - self.start

    @property
    def current(self) -> NDArray[np.float64]:
        """Planned current, A."""
        wave = self._step.current
        if wave is None:
            return np.empty((0, 2))
        return np.column_stack([wave.time, wave.value])

    @property
    def rest(self) -> dict[str, float]:
        """The model's signals just before the trial."""
        found = self._model(*self._measured)
        at = np.array([self.start])
        return {name: float(found.sample(name, at)[0]) for name in self._measured}

    @property
    def traces(self) -> dict[str, NDArray[np.float64]]:
        """The model's signals during the trial."""
        found = self._model(*self._measured)
        times = np.linspace(0.0, self.trial.length, TRACE_POINTS)
        absolute = np.minimum(self.start + times, found.duration)
        return {
            name: np.column_stack([times, found.sample(name, absolute)])
            for name in self._measured
        }

    @property
    def _measured(self) -> tuple[str, ...]:
        signals = ("V_C1", "V_C2")
        return tuple(name for name in signals if name in self._scene.record.signals)

    def _model(self, *keep: str) -> Result:
        from tactile_lab.planning.preview import model

        object.__setattr__(self, "looked_at", True)
        force = joined(
            [(step.start, step.force) for step in self._steps[: self.index + 1]]
        )
        end = self.start + self.trial.length
        # V_P depends on no voltage, and the rest has settled since one was changed
        return model(self._scene, force, end, keep, voltages=self._step.voltages)


def joined(waves: Sequence[tuple[float, Waveform]]) -> Waveform:
    """Waveforms one after another, each put at its start."""
    time = np.concatenate([wave.time + start for start, wave in waves])
    value = np.concatenate([wave.value for _, wave in waves])
    # the sum of lengths may round
    return Waveform.tidied(np.maximum.accumulate(time), value)
