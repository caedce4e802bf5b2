"""Driving a protocol's generator with the model's outcomes: what a run will ask for."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import closing, suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.current_list import CurrentList
from tactile_lab.drive import Drive
from tactile_lab.errors import LimitError, ParameterError, SceneError, TactileLabError
from tactile_lab.planning.current import cut
from tactile_lab.planning.heat import heat_along
from tactile_lab.planning.outcome import ModelAlong, ModelOutcome, Step, joined
from tactile_lab.planning.way import drive_for
from tactile_lab.quantity import show
from tactile_lab.scene.scene import Scene
from tactile_lab.trial import BASELINE, Outcome, Probes, Trial, Trials, playable
from tactile_lab.voltage_source import SETTLED
from tactile_lab.waveform import Waveform

MOST_TRIALS = 10_000
"""A protocol that asks for more never ends, as far as planning is concerned."""
MOST_BENDS = 200_000
"""Points of the force that stairs may have, 6 minutes of a sine or an hour of a slow
ramp; each takes the plan up to 2.3 kB. Trials after that have the current as asked."""

RAMPED = 1.5
"""Time that a source meter takes for a ramp over what its slew limit allows: each step
waits for the answer to the one before (measured, 57600 baud)."""


@dataclass(frozen=True, eq=False)
class Timeline:
    """All trials of a scene, one after another.

    Attributes:
        steps: in order.
        force: of the whole run, N against s from 0.
        duration: s, planned pauses included.
        rests: time at rest that a run samples besides its trials, s.
        warnings: where the coil cannot follow.
        adaptive: the protocol looked at what the sensor did, so that another sensor
            may get other trials.
        spikes: that the model gave in the trials whose spikes it looked at.
    """

    steps: tuple[Step, ...]
    force: Waveform
    duration: float
    rests: float
    warnings: tuple[str, ...]
    adaptive: bool
    spikes: int

    @property
    def streamed(self) -> float:
        """Time of trials during which samples are taken, s: all but planned pauses."""
        return sum(step.trial.length for step in self.steps if not step.trial.pause)

    def streams_at(self, time: FloatArray) -> NDArray[np.bool_]:
        """Whether samples are taken then, in no pause and no list's loading; (n,)."""
        found = np.zeros(time.size, dtype=np.bool_)
        for step in self.steps:
            if not step.trial.pause:
                end = step.start + step.trial.length
                found |= (time >= step.start) & (time < end)
        return found

    @property
    def loading(self) -> float:
        """Time during which lists are loaded, s: nothing is streamed meanwhile."""
        return self.duration - sum(step.trial.length for step in self.steps)

    @property
    def drives(self) -> bool:
        """Whether any trial asks the coil for a current other than 0 A."""
        return any(
            step.force.peak > 0 or (step.current is not None and step.current.peak > 0)
            for step in self.steps
        )

    @property
    def asks_force(self) -> bool:
        """Whether any trial asks for a force, not for a current, other than 0 N."""
        return any(
            step.trial.current is None and step.trial.force.peak > 0
            for step in self.steps
        )

    @property
    def current(self) -> Waveform | None:
        """Current of the whole run, A; None where the force is taken as given."""
        played = [(s.start, s.current) for s in self.steps if s.current is not None]
        return joined(played) if len(played) == len(self.steps) else None


def timeline(scene: Scene, *, through_coil: bool) -> Timeline:
    """All trials of `scene`, each outcome computed by the model if it is looked at.

    Args:
        scene: what to drive.
        through_coil: apply calibration, limits, slew and update grid, as `run` does;
            otherwise take each force as given, as `simulate` does.

    Raises:
        LimitError: a force lies beyond the coil, or the coil would get too hot (only
            `through_coil`).
        SceneError: the protocol fails, asks for nothing, or never ends; or the coil
            cannot follow and the scene says ``coil.strict = true``.
    """
    driver = _Driver(scene, through_coil)
    name = f"protocol {scene.protocol.name}"
    try:
        asked = scene.protocol.trials()
        if not isinstance(asked, Generator):
            raise TypeError(f"trials gave {type(asked).__name__}; yield Trials")
        with closing(asked) as trials:
            _play(trials, driver, name)
    except ParameterError as reason:
        raise SceneError(f"{name} cannot be played: {reason}") from reason
    except LimitError as reason:
        raise LimitError(f"{scene.path or scene.name}: {reason}") from reason
    except TactileLabError:
        raise
    except (Exception, SystemExit, GeneratorExit) as reason:
        raise SceneError(f"{name} fails: {scene.protocol.fault(reason)}") from reason
    if not driver.steps:
        raise SceneError(f"{name} asks for no trial.")
    return driver.timeline()


def _play(trials: Trials, driver: _Driver, name: str) -> None:
    with suppress(StopIteration):
        trial = next(trials)
        while True:
            outcome = driver.take(playable(trial))
            if len(driver.steps) >= MOST_TRIALS:
                raise SceneError(f"{name} asks for more than {MOST_TRIALS} trials.")
            trial = trials.send(outcome)


class _Driver:
    """Collects trials and answers each with what the model makes of it."""

    def __init__(self, scene: Scene, through_coil: bool) -> None:
        self.scene = scene
        self.through_coil = through_coil
        self.model = ModelAlong(scene)
        self.steps = self.model.steps
        self._outcomes: list[ModelOutcome] = []
        self._limited: list[tuple[str, str]] = []
        self._time = 0.0
        self._rests = BASELINE
        self._probes: Probes = "circuit"
        self._amperes = 0.0
        self._field = (0.0, 0.0)
        self._heat = 0.0
        self._bends = 0
        self._voltages: dict[str, float] = {}
        self._loaded: CurrentList | None = None

    def take(self, trial: Trial) -> Outcome:
        trial = self._held(trial)
        length, force, current = trial.length, trial.force, trial.current
        magnet, drive = self.scene.bench.magnet, None
        if self.through_coil:
            drive = self._played(trial)
            current = drive.current
            if drive.force is None:
                force, self._field = self._by_set_points(drive)
            else:
                force, self._field = drive.force, (0.0, 0.0)
            self._wait_for_load(drive)
        elif current is not None:
            force = cut(magnet.force_for(current, beyond="hold"), length)
        else:
            force = cut(force, length)
        step = Step(trial, self._time, force, current, drive, self._voltages)
        self.steps.append(step)
        self._time += length
        self._rest_beside(trial)
        outcome = ModelOutcome(self.model, len(self.steps) - 1)
        self._outcomes.append(outcome)
        return outcome

    def _held(self, trial: Trial) -> Trial:
        """The trial with its voltages: a pause lasts until the circuit has settled.

        Before any other trial that is time at rest. A run begins with its first ones.
        """
        sources, before = self.scene.bench.voltage_sources, self._voltages
        self._voltages = {**before, **trial.voltages}
        stood = {**self.scene.sourced, **before}
        takes = [
            RAMPED * abs(volts - stood[name]) / sources[name].limits.slew
            for name, volts in trial.voltages.items()
            if volts != stood.get(name, volts) and name in sources
        ]
        if not takes or not self.steps:
            return trial
        settled = max(takes) + SETTLED * self.scene.circuit.tau_L
        if trial.pause:
            return replace(trial, duration=max(trial.length, settled))
        self._rests += settled
        return trial

    def _by_set_points(self, drive: Drive) -> tuple[Waveform, tuple[float, float]]:
        """The force of stairs, N, and what the lags leave of it."""
        lagged = self.scene.bench.magnet.lagged_force
        if drive.stairs is not None:
            force, field = lagged(drive.stairs, self._field)
            self._bends += force.time.size
            if self._bends <= MOST_BENDS:
                return force, field
        return lagged(drive.current, self._field)

    def _rest_beside(self, trial: Trial) -> None:
        """The rest that is sampled after a pause, and where probes were moved."""
        if trial.pause:
            self._rests += BASELINE
        elif trial.probes != self._probes:
            self._probes = trial.probes
            self._rests += 2 * BASELINE

    def _wait_for_load(self, drive: Drive) -> None:
        """The time that a list takes to load goes by, unless it is there already."""
        if drive.points is not None and not drive.points.same_as(self._loaded):
            self._loaded = drive.points
            self._time += drive.load
            self._rests += 2 * BASELINE

    def _played(self, trial: Trial) -> Drive:
        """How the coil plays the trial."""
        bench, length = self.scene.bench, trial.length
        if bench.coil is None:
            if (trial.current or trial.force).peak > 0:
                raise SceneError(
                    f"bench {bench.name} has no [coil], but the protocol asks for a "
                    "force."
                )
            return Drive(Waveform.through([(0, 0), (length, 0)]))
        drive = drive_for(trial, self.scene, self._amperes)
        current, warning = drive.current, drive.warning
        if warning is not None:
            text = f'the coil cannot follow trial "{trial.label}": {warning}'
            if self.scene.coil.strict:
                raise SceneError(f"{text} (coil.strict = true refuses that).")
            self._limited.append((trial.label, warning))
        self._amperes = float(current.value[-1])
        limits = bench.coil.limits
        self._heat, _, spent = heat_along(current, limits, self._heat)
        if spent is not None:
            raise LimitError(
                f'trial "{trial.label}" spends the coil\'s heat budget of '
                f"{limits.heat:g} A² s (above {show(limits.continuous, 'A')}) "
                f"{show(spent, 's')} after its start. Ask for less force, a shorter "
                "hold, or a longer rest before it."
            )
        return drive

    def timeline(self) -> Timeline:
        force = joined([(step.start, step.force) for step in self.steps])
        return Timeline(
            tuple(self.steps),
            force,
            self._time,
            self._rests,
            tuple(self._told()),
            any(outcome.looked_at for outcome in self._outcomes),
            sum(outcome.fired for outcome in self._outcomes),
        )

    def _told(self) -> Iterator[str]:
        if self._limited:
            label, warning = self._limited[-1]
            more = len(self._limited) - 1
            others = f" and {more} other{'s' if more > 1 else ''}" if more else ""
            yield (
                f'the coil cannot follow trial "{label}"{others}: {warning}; the '
                "limited waveform is used"
            )
