"""What a report is written from: what a run measured, and what else is known of it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

from tactile_lab.analysis.belief import Belief
from tactile_lab.arrays import FloatArray
from tactile_lab.measurement import TOO_FAST, Measurement
from tactile_lab.model.state import Start
from tactile_lab.trial import Protocol


@dataclass(frozen=True, kw_only=True)
class Loss:
    """The loss certificate of a run.

    Attributes:
        samples_produced: by the scope, all channels; None if the run could not say.
        samples_stored: all channels.
        spikes_online: spikes found while the run went on.
        spikes: found by only one of the searches on line and in the stored samples;
            None where the searched channel was not stored.
        covered: time that has samples, s; None for a scope without gaps.
        streamed: time the scope was asked to see, s; None likewise.
        sentence: all of it: "loss: 0 of 72000000 samples, 0 of 47 spikes".
    """

    samples_produced: int | None
    samples_stored: int
    spikes_online: int
    spikes: int | None
    sentence: str
    covered: float | None = None
    streamed: float | None = None

    @property
    def samples(self) -> int | None:
        """Samples lost; None if not known."""
        if self.samples_produced is None:
            return None
        return self.samples_produced - self.samples_stored


@dataclass(frozen=True, kw_only=True, eq=False)
class RunData(Measurement):
    """One run, ready to be reported.

    Attributes:
        protocol: what was run, with its parameters.
        title: the protocol's title.
        scene: name of the scene.
        run: name of the run's folder.
        status: "complete", "aborted", "faulted" or "recovered".
        took: wall time the run needed, s, or None.
        belief: sensor and bench as they are believed to be, and how well; None where
            the run has no current.
        compared: whether the model is computed and compared with it.
        counted: whether each spike of the believed circuit lasts for a sample, so that
            none is missed between two.
        start: voltages the circuit began with; None for the equilibrium.
        asks_I_DS: I_DS was asked for, and is derived from V_C1 where not measured.
        loss: counters, or None where nothing was acquired.
        accuracy: how accurate the simulation was, one sentence, or "".
        warnings: one sentence each.
        assumptions: one sentence each.
        parameters: the protocol's parameters as text by name.
        sensor: the sensor's parameters as text by name.
        calibration: calibration of force and field, as text by name.
        environment: versions and machine, as text by name.
    """

    protocol: Protocol
    title: str
    run: str
    status: str
    scene: str = ""
    took: float | None = None
    belief: Belief | None = None
    compared: bool = True
    counted: bool = True
    start: Start | None = None
    asks_I_DS: bool = True
    loss: Loss | None = None
    accuracy: str = ""
    warnings: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()
    parameters: Mapping[str, str] = dataclasses.field(default_factory=dict)
    sensor: Mapping[str, str] = dataclasses.field(default_factory=dict)
    calibration: Mapping[str, str] = dataclasses.field(default_factory=dict)
    environment: Mapping[str, str] = dataclasses.field(default_factory=dict)

    @property
    def train(self) -> FloatArray | None:
        """Spikes that tell of the circuit, s; None where some are missed, or false."""
        false = any(trial.uncounted == TOO_FAST for trial in self.trials)
        told = self.searched and self.counted and not false
        return self.spike_times if told else None

    @property
    def subtitle(self) -> str:
        """Scene, folder and date, for a figure's second line."""
        return " · ".join(p for p in (self.scene, self.run, self.started) if p)
