"""One execution of a scene: bench, run folder, loop, record.

from tactile_lab.engine.execution import Execution
from tactile_lab.scene.load import load

done = Execution(load("demo"), "runs").run()
print(done.state, done.folder, done.spikes)
"""

from __future__ import annotations

import time
import traceback
from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from tactile_lab.acquisition import events
from tactile_lab.acquisition.asked_field import AskedField
from tactile_lab.acquisition.drift import Drift
from tactile_lab.acquisition.drive_check import DriveCheck
from tactile_lab.acquisition.ending import CoilState, Ending, Executed
from tactile_lab.acquisition.person import Ask
from tactile_lab.acquisition.program import Program
from tactile_lab.acquisition.runner import Runner
from tactile_lab.acquisition.search import SpikeSearch
from tactile_lab.bench import Bench, OffReport
from tactile_lab.clock import steady
from tactile_lab.drive import Drive
from tactile_lab.engine.bench import open_bench
from tactile_lab.engine.coil_heat import CoilHeat
from tactile_lab.engine.provenance import keep_scene, layout, origin, temperature
from tactile_lab.engine.task import Task
from tactile_lab.errors import SceneError, TactileLabError
from tactile_lab.planning.calibrated import check_coil
from tactile_lab.planning.plan import plan
from tactile_lab.planning.warn import misses_spikes
from tactile_lab.planning.way import drive_for
from tactile_lab.scene.scene import Scene
from tactile_lab.scope import Stream
from tactile_lab.stimulus.force import ForceProtocol
from tactile_lab.store.certificate import Certificate, write_certificate
from tactile_lab.store.folder import RunFolder, Status
from tactile_lab.store.recorder import Recorder
from tactile_lab.store.remarks import add_note
from tactile_lab.trial import Trial
from tactile_lab.voltage_source import SETTLED

STATUS: dict[events.RunState, Status] = {
    events.RunState.COMPLETE: "complete",
    events.RunState.ABORTED: "aborted",
    events.RunState.FAULTED: "faulted",
}
"""What a run's folder calls the states a run can end in."""

LOOK = 0.05
"""Time between two looks whether a wait is over, s."""

LEFT_ON = (
    "A program before this one may have left its output on: switch the coil source off "
    "at the instrument."
)


class Execution(Task[Executed]):
    """A scene about to run. Making one validates, plans and makes the run's folder.

    Args:
        scene: what to run.
        out: folder that run folders are put into; made if missing.
        bench: instruments made elsewhere; those of the scene's bench unless given.
        realtime: pace a simulated bench by the wall clock.
        emit: told of everything that happens, from the deciding thread.
        others: are told, too, each for as long as it works.
        notes: kept with the run (operator, sample, ...).
        ask: asks a person to do something at a real bench and returns when it is done;
            called in a thread of its own.
        asked_field: has a person read the teslameter, where the bench says so.

    Attributes:
        plan: what the scene needs, leaves out and costs.
        folder: of the run; it exists from now on.

    Raises:
        SceneError, LimitError: the scene cannot be run on its bench, or how warm its
            coil is cannot be told.
        RecordingError: the folder cannot be written.
    """

    def __init__(
        self,
        scene: Scene,
        out: Path | str,
        *,
        bench: Bench | None = None,
        realtime: bool = False,
        emit: events.Emit = events.ignore,
        others: tuple[events.Emit, ...] = (),
        notes: Mapping[str, str] | None = None,
        ask: Ask | None = None,
        asked_field: AskedField | None = None,
    ) -> None:
        self.plan = plan(scene, preview=False)
        self.needs = self.plan.needs
        used = bench or open_bench(scene, self.needs, realtime=realtime)
        super().__init__(scene, used, emit)
        self.counted = not misses_spikes(scene, self.needs)
        self._others = others
        self._ask = ask
        self._asked_field = asked_field
        self._check_somebody_is_there()
        self._heat = CoilHeat.of(scene, used)
        if self._heat is not None:
            self._heat.check()
        self._search = SpikeSearch.of(scene, self.needs.detect_on)
        self._recorder: Recorder | None = None
        self._runner: Runner | None = None
        self.folder = RunFolder.create(
            Path(out),
            scene.name,
            origin(self.plan, self.bench, {**scene.conditions.notes, **(notes or {})}),
            needed=self.plan.estimate.disk,
        )

    @property
    def documented(self) -> dict[str, Any]:
        """What other programs are told as it begins (docs/json.md)."""
        return {
            "event": "begun",
            "run": str(self.folder.path),
            "scene": self.scene.name,
            "simulated": self.bench.simulated,
            "planned_s": self.plan.estimate.duration,
        }

    @property
    def coil_state(self) -> CoilState:
        """What is known of the coil now."""
        coil = self._runner.instruments.coil if self._runner else None
        return CoilState() if coil is None else coil.state

    @property
    def coil_left_safe(self) -> bool:
        """Whether the coil was verified off, or was never reached for."""
        coil = self._runner.instruments.coil if self._runner else None
        return coil is None or (coil.off is not None and coil.off.verified)

    def note(self, text: str, at: float | None) -> None:
        """Keep a note of the user, at `at` s of run time; what prevents it is told."""
        try:
            add_note(self.folder.path, text, at)
        except TactileLabError as error:
            self._emit(events.Message("error", f"The note was not kept: {error}"))

    def run(self) -> Executed:
        """Run to the end; the coil is safe and the folder closed when this returns.

        A record that could not be completed is a fault of the run: how it ended tells.

        Raises:
            RecordingError: the run could not be begun in its folder.
            LimitError: how warm the coil is cannot be told or kept.
        """
        keep_scene(self.folder, self.scene)
        prevented = self._let_cool()
        began = time.monotonic()
        self._runner = runner = Runner(
            self._program(),
            self.bench,
            self._begin_record,
            self.stop,
            self.live,
            self._emit,
            *self._others,
        )
        ending = prevented or self._driven(runner)
        took = time.monotonic() - began
        proof: Certificate | None = None
        try:
            proof = self._close(runner, ending, took)
        except Exception as failure:  # whatever it is, the coil's state is told
            ending = ending.faulted_by(failure)
        return Executed(
            **vars(ending),
            folder=self.folder.path,
            spikes=runner.intake.spikes if runner.intake.searched else None,
            loss={
                "samples": proof.samples if proof else None,
                "spikes": proof.spikes if proof else None,
            },
            duration=runner.duration,
            took=took,
        )

    def _let_cool(self) -> Ending | None:
        """Wait until a coil that was heated before is as cold as plans take it to be.

        Who asks to stop ends it. How the run ends where the coil may be on still, and
        cannot be switched off.
        """
        heat = self._heat
        if heat is None:
            return None
        before = ""
        try:
            if heat.lost and not self.stop.requested:
                self._switch_off()
                heat.seen_off()
                before = ", which died or could not switch it off; it is off now"
        except TactileLabError as error:
            off = OffReport(False, None, LEFT_ON)
            return Ending(events.RunState.FAULTED, off, str(error), error)
        if not (left := heat.left()):
            return None
        cold = steady() + left
        text = (
            f"The coil is still warm from a run before{before}. This one begins in "
            f"{left:.0f} s, when it counts as cold, as its plan takes it to be. "
            "Stop ends the waiting."
        )
        self._emit(events.Message("info", text))
        while cold > steady() and not self.stop.requested:
            time.sleep(LOOK)
        return None

    def _driven(self, runner: Runner) -> Ending:
        """Run, and keep for whoever comes next how warm the coil is left."""
        if self._heat is None or self.stop.requested:
            return runner.run()
        left = partial(self._left_warm, self._heat)
        return self._heat.kept_while(runner.run, left, self._emit)

    def _switch_off(self) -> None:
        """Switch off a coil that is not driven but may be on: it would stay warm.

        Raises:
            TactileLabError: it is not reached, or not verified off.
        """
        coil = self.bench.coil
        assert coil is not None
        with self.bench.clock.taking_part("coil before"):
            try:
                coil.open()  # makes it safe on the way
            finally:
                coil.close()

    def _left_warm(self, heat: CoilHeat, ending: Ending) -> float:
        """Time until the coil, off, counts as cold, s."""
        cost = self.plan.estimate
        if ending.state is events.RunState.COMPLETE:
            return cost.cool_down
        return heat.after(cost.heat)

    def _begin_record(self, stream: Stream | None) -> Recorder:
        """Start the record; codes can be scaled from now on."""
        assert self._runner is not None
        now = self.bench.clock.now()
        self.folder.begin(
            0.0 if stream is None else now - stream.started,
            **self._read_back(self._runner),
        )
        self._recorder = Recorder(
            self.folder,
            layout(self.plan, self.bench, self.folder, self._search, stream),
            when_full="wait" if self.bench.clock.simulated else "error",
        )
        return self._recorder

    def _read_back(self, runner: Runner) -> dict[str, Any]:
        """What the instruments said of themselves, and how warm the sensor was."""
        said = runner.instruments.settings
        return {"temperature": temperature(self.scene, said), "instruments": said}

    def _close(self, runner: Runner, ending: Ending, took: float) -> Certificate | None:
        """Complete the record and say in it how the run ended, which may fail, too."""
        status = STATUS[ending.state]
        instruments = runner.instruments
        entries = {
            "reason": ending.reason,
            "coil": ending.off.text,
            "coil_verified_off": ending.off.verified,
            "duration_s": runner.duration,
            "took_s": took,
            **self._read_back(runner),
            "instruments_after": instruments.settings_after,
            "instruments_changed": instruments.changes,
            "accuracy": self.bench.accuracy() if self.bench.accuracy else "",
            "voltages_left": {
                name: left.text for name, left in instruments.voltages_left.items()
            },
            "overrange": sorted(runner.intake.overrange),
            "samples_missing": runner.missing,
            "samples_surplus": runner.surplus,
        }
        if ending.failure and not isinstance(ending.failure, TactileLabError):
            told = "".join(traceback.format_exception(ending.failure))
            self.folder.write_text("traceback.txt", told)
        if self._recorder is None:
            self.folder.finish(status, **entries)
            return None
        try:
            # else how many the scope took is not known
            accounted = runner.missing is None and runner.surplus is None
            produced = runner.intake.produced if accounted else None
            self._recorder.close(status, produced, **entries)
        except Exception:
            with suppress(TactileLabError, OSError):  # what failed first is told
                write_certificate(self.folder.path)
            raise
        return write_certificate(self.folder.path)

    def _program(self) -> Program:
        scene, needed = self.scene, self.needs
        return Program(
            trials=scene.protocol.trials,
            fault=scene.protocol.fault,
            channels=needed.channels,
            interval=1.0 / scene.record.sample_rate,
            search=self._search,
            drive_for=self._drive_for,
            expected=self.plan.estimate.duration,
            doubts=self._doubts,
            voltages=needed.voltages,
            settling=SETTLED * scene.circuit.tau_L,
            coil_lag=scene.bench.magnet.coil_lag,
            drift=self._drift(),
            drive_check=self._drive_check(),
            heat=self._heat,
            ask=self._ask,
            asked_field=self._asked_field if needed.asked_field else None,
        )

    def _check_somebody_is_there(self) -> None:
        probed = any(s.trial.probes != "circuit" for s in self.plan.timeline.steps)
        if probed and self._ask is None and self.bench.place_probes is None:
            raise SceneError(
                f"{self.scene.name} needs a person who puts the probes on 0 V and V_S. "
                "Run it in the window or in a terminal, or set protocol.calibrate = "
                "false."
            )
        if self.needs.asked_field and self._asked_field is None:
            raise SceneError(
                f"{self.scene.name} has a person read the teslameter, and nobody is "
                "there to be asked. Run it in the window or in a terminal, or give the "
                "readings with --field FILE, one a line."
            )

    def _drift(self) -> Drift | None:
        scene = self.scene
        if not isinstance(scene.protocol, ForceProtocol) or scene.protocol.sets:
            return None  # the rest moves with what is set
        force_for = partial(scene.bench.magnet.force_for, beyond="hold")
        return Drift(scene.circuit, force_for, scene.protocol.drift_limit)

    def _drive_check(self) -> DriveCheck:
        magnet = self.scene.bench.magnet
        used = magnet.calibration

        def field(current: float) -> float:
            if used is not None:  # read back a little beyond its last point
                current = min(max(current, used.least), used.most)
            return float(magnet.field(current))

        return DriveCheck(field, calibrated=used is not None and used.unit == "T")

    def _doubts(self, settings: Mapping[str, Mapping[str, str]]) -> tuple[str, ...]:
        scope = settings.get("scope", {})
        found = tuple(one["moved"] for one in settings.values() if "moved" in one)
        if others := scope.get("others"):
            found += (
                f"Several oscilloscopes are attached and the bench file names none: "
                f"{scope.get('serial', scope['identity'])} was taken, not {others}. "
                'Write serial = "..." into [scope].',
            )
        if not self.plan.timeline.asks_force:
            return found
        return found + check_coil(self.scene, settings)

    def _drive_for(self, trial: Trial, update_interval: float, before: float) -> Drive:
        return drive_for(trial, self.scene, before, update_interval)
