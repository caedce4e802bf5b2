"""One execution of a scene: bench, run folder, loop, report. The scripting entry point.

from tactile_lab.acquisition.execution import Execution
from tactile_lab.scene.load import load

done = Execution(load("demo"), Path("runs")).run()
print(done.folder, done.spikes)
"""

from __future__ import annotations

import time
import traceback
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from tactile_lab.acquisition import events
from tactile_lab.acquisition.asked_field import AskedField
from tactile_lab.acquisition.drift import Drift
from tactile_lab.acquisition.ending import CoilState, Ending, Executed
from tactile_lab.acquisition.live import Live
from tactile_lab.acquisition.person import Ask
from tactile_lab.acquisition.provenance import (
    changed,
    keep_scene,
    origin,
    temperature,
)
from tactile_lab.acquisition.runner import Runner
from tactile_lab.acquisition.search import SpikeSearch
from tactile_lab.acquisition.stop import StopRequest
from tactile_lab.acquisition.task import Task
from tactile_lab.bench import Bench, Stream
from tactile_lab.errors import SceneError, TactileLabError
from tactile_lab.planning.calibrated import check_coil
from tactile_lab.planning.current import current_for
from tactile_lab.planning.plan import plan
from tactile_lab.plugins import open_bench
from tactile_lab.scene.scene import Scene
from tactile_lab.stimulus.force import ForceProtocol
from tactile_lab.store.certificate import Certificate, write_certificate
from tactile_lab.store.folder import RunFolder, Status
from tactile_lab.store.layout import Layout
from tactile_lab.store.recorder import Recorder
from tactile_lab.store.recorder_thread import RecorderThread
from tactile_lab.trial import Trial
from tactile_lab.waveform import Waveform

STATUS: dict[events.RunState, Status] = {
    events.RunState.COMPLETE: "complete",
    events.RunState.ABORTED: "aborted",
    events.RunState.FAULTED: "faulted",
}
"""What a run's folder calls the states a run can end in."""


class Execution:
    """A scene about to run. Making one validates and plans; it opens nothing.

    Args:
        scene: what to run.
        out: folder that run folders are put into; made if missing.
        bench: instruments made elsewhere; those of the scene's bench unless given.
        realtime: pace a simulated bench by the wall clock.
        emit: told of everything that happens, from the deciding thread.
        notes: kept with the run (operator, sample, ...).
        ask: asks a person to do something at a real bench and returns when it is done;
            called in a thread of its own.
        asked_field: has a person read the teslameter, where the bench says so.

    Raises:
        SceneError, LimitError: the scene cannot be run on its bench.
        RecordingError: the folder cannot be written.
    """

    def __init__(
        self,
        scene: Scene,
        out: Path,
        *,
        bench: Bench | None = None,
        realtime: bool = False,
        emit: events.Emit = events.ignore,
        notes: Mapping[str, str] | None = None,
        ask: Ask | None = None,
        asked_field: AskedField | None = None,
    ) -> None:
        self.scene = scene
        self.plan = plan(scene, preview=False)
        self.needs = self.plan.needs
        self.bench = bench or open_bench(scene, self.needs, realtime=realtime)
        self._ask = ask
        self._asked_field = asked_field
        self._check_somebody_is_there()
        self.stop = StopRequest(self.bench.clock)
        self._emit = emit
        self._notes = {**scene.conditions.notes, **(notes or {})}
        self._live = Live()
        on = self.needs.detect_on
        self._search = SpikeSearch(scene, on) if on is not None else None
        self._journal: RecorderThread | None = None
        self.folder = RunFolder.create(
            out,
            scene.name,
            origin(self.plan, self.bench, self._notes),
            needed=self.plan.estimate.disk,
        )
        self._runner: Runner | None = None
        self._certificate: Certificate | None = None

    @property
    def live(self) -> Live:
        """The newest samples, decimated."""
        return self._live

    @property
    def coil_state(self) -> CoilState:
        """What is known of the coil now."""
        thread = self._runner.instruments.coil if self._runner else None
        if thread is None:
            return CoilState(False, None, None, None)
        last = thread.last
        return CoilState(
            thread.live,
            last.setpoint if last else None,
            thread.measured,
            thread.off,
        )

    def run(self) -> Executed:
        """Run to the end; the coil is safe and the folder closed when this returns.

        A record that could not be completed is a fault of the run: how it ended tells.

        Raises:
            RecordingError: the run could not be begun in its folder.
        """
        began = time.monotonic()
        self._emit(events.FolderMade(self.folder.path))
        keep_scene(self.folder, self.scene)
        runner = Runner(
            self._task(),
            self.bench,
            self._begin_record,
            self.stop,
            self._live,
            self._emit,
        )
        self._runner = runner
        ending = runner.run()
        took = time.monotonic() - began
        ending = self._close(runner, ending, took)
        proof = self._certificate
        return Executed(
            folder=self.folder.path,
            ending=ending,
            spikes=runner.intake.spikes,
            loss={
                "samples": proof.samples if proof else None,
                "spikes": proof.spikes if proof else None,
            },
            duration=runner.duration,
            took=took,
        )

    def _begin_record(self, stream: Stream | None) -> RecorderThread:
        """Start the record; codes can be scaled from now on."""
        magnet = self.scene.bench.magnet
        detection = None
        if self._search is not None and stream is not None:
            detection = self._search.detection(stream)
            self.folder.update(detection=self._search.describe(stream))
        layout = Layout(
            signals=self.needs.stored,
            detection=detection,
            simulated=self.bench.simulated,
            attributes={"newtons_per_ampere": magnet.newtons_per_ampere},
        )
        self._journal = RecorderThread(
            Recorder(self.folder, layout),
            when_full="wait" if self.bench.clock.simulated else "error",
        )
        return self._journal

    def _close(self, runner: Runner, ending: Ending, took: float) -> Ending:
        """Complete the record and say in it how the run ended, which may fail, too."""
        status = STATUS[ending.state]
        before = runner.instruments.settings
        after = runner.instruments.settings_after
        entries = {
            "reason": ending.reason,
            "coil": ending.off.text,
            "coil_verified_off": ending.off.verified,
            "duration_s": runner.duration,
            "took_s": took,
            "temperature": temperature(self.scene, before),
            "instruments": before,
            "instruments_after": after,
            "instruments_changed": list(changed(before, after)),
            "accuracy": self.bench.accuracy() if self.bench.accuracy else "",
            "overrange": sorted(runner.intake.overrange),
        }
        try:
            if ending.failure and not isinstance(ending.failure, TactileLabError):
                told = "".join(traceback.format_exception(ending.failure))
                self.folder.write_text("traceback.txt", told)
            if self._journal is None:
                self.folder.finish(status, **entries)
                return ending
            try:
                self._journal.close(status, runner.intake.produced, **entries)
            finally:
                self._certificate = write_certificate(self.folder.path)
        except TactileLabError as failure:
            return ending.faulted_by(failure)
        return ending

    def _task(self) -> Task:
        scene, needed = self.scene, self.needs
        return Task(
            trials=scene.protocol.trials,
            channels=needed.channels,
            interval=1.0 / scene.record.sample_rate,
            search=self._search,
            current_for=self._current_for,
            expected=self.plan.estimate.duration,
            doubts=self._doubts,
            drift=self._drift(),
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
        if not isinstance(scene.protocol, ForceProtocol):
            return None
        force_for = partial(scene.bench.magnet.force_for, beyond="hold")
        return Drift(scene.circuit, force_for, scene.protocol.drift_limit)

    def _doubts(self, settings: Mapping[str, Mapping[str, str]]) -> tuple[str, ...]:
        if not self.plan.timeline.asks_force:
            return ()
        return check_coil(self.scene, settings)

    def _current_for(
        self, trial: Trial, update_interval: float, before: float
    ) -> Waveform:
        coil = self.scene.bench.coil
        assert coil is not None
        magnet = self.scene.bench.magnet
        return current_for(trial, magnet, coil, before, update_interval)[0]
