"""The run in progress, or the last one: what the window knows of it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import Signal

from gui.lanes.expected import Stretch
from gui.lanes.live import LiveSource
from gui.session.live_task import LiveTask
from gui.session.log import Log, Severity
from gui.session.status import Status
from gui.state import WindowState, milliamperes
from tactile_lab.acquisition import events
from tactile_lab.acquisition.ending import Ending, Executed
from tactile_lab.engine.commands import answer, begin_run, note
from tactile_lab.engine.engine import Reply
from tactile_lab.engine.events import (
    Begun,
    ModelPart,
    PersonAsked,
    Samples,
    TaskEvent,
)
from tactile_lab.engine.jobs import follow_run, write_report
from tactile_lab.engine.link import Link
from tactile_lab.engine.request import Request
from tactile_lab.quantity import looked_for, show
from tactile_lab.store.folder import DATA, REPORT

if TYPE_CHECKING:
    from gui.session.expectation import Expectation
    from gui.session.fit import Agreement

AGAIN = "Open it in Runs: Write report, in Results, makes one that is missing."
LEVELS = {"info": Severity.INFO, "warning": Severity.WARNING, "error": Severity.ERROR}


class LiveRun(LiveTask):
    """One run at a time.

    Attributes:
        source: what is seen of it; None before its first word.
        request, title, expectation: what it was asked to do, its name and its plan.
        name: for people: the title, then the folder.
        folder: of the last run; None before any.
        trial: number and label of the step in progress.
        voltages: what source meters were read back to hold, V.
        kelvin: temperature of the sensor as read last, K; None before.
        field: as read last, T; None before.
        probes: what the probes touch in this trial: the circuit, or something else.
        asked: what it waits for a person to do; None while nobody is asked.
        elapsed, expected: run time, s.
        agreement: how well the model follows the run on screen; None if nobody knows.
        notes: kept with each run.
        out: folder for run folders.
        waiting: notes that were typed before the next run; it will have them.
        reports: whether the report is written at its end.
        reporting: folders whose report is being written, which is that of the first, or
            waits for it: each takes up to a quarter of a GB, and most of a core.
        publish: whether the next runs are published by Lab Streaming Layer.
    """

    begun = Signal(object)
    trial_ended = Signal(object)
    ended = Signal(object)
    cut = Signal(str)
    """It ended without its usual end; a word for that."""
    completed = Signal()
    reported = Signal(object)

    def __init__(self, link: Link, status: Status, log: Log, out: Path) -> None:
        super().__init__(link, status, log)
        self.out = out
        self.source: LiveSource | None = None
        self.request: Request | None = None
        self.title = self.name = ""
        self.expectation: Expectation | None = None
        self.folder: Path | None = None
        self.trial: tuple[int, str] | None = None
        self.probes = "circuit"
        self.asked: PersonAsked | None = None
        self.voltages: dict[str, float] = {}
        self.kelvin: float | None = None
        self.field: float | None = None
        self.elapsed = 0.0
        self.expected: float | None = None
        self.agreement: Agreement | None = None
        self.notes: dict[str, str] = {}
        self.waiting: list[str] = []
        self._early: list[str] = []
        """Notes given to a run that has not begun, and may be refused."""
        self.reports = True
        self.reporting: dict[Path, Callable[[], None]] = {}
        """And what follows once it is there."""
        self._outdated: set[Path] = set()
        self.publish = False

    def start(
        self, request: Request, title: str, expectation: Expectation | None
    ) -> None:
        """Begin a run.

        Args:
            request: what to run.
            title: for people.
            expectation: its plan; None if nobody planned it.
        """
        self.source, self.trial, self.agreement = None, None, None
        self.elapsed, self.expected, self.asked = 0.0, None, None
        self.voltages, self.kelvin, self.field = {}, None, None
        self.request, self.expectation = request, expectation
        self.title = self.name = title
        notes = dict(self.notes)
        self._begin(begin_run, request, self.out, notes, publish=self.publish)
        self._early, self.waiting = self.waiting, []
        for text in self._early:
            self.say(note, text, None)

    def note(self, text: str) -> None:
        """Keep a note with the run, stamped with its time; or with the next."""
        if self.alive:
            self.say(note, text, self.elapsed)
            if self.source is None:
                self._early.append(text)
            else:
                self.source.notes.append((self.elapsed, text))
        else:
            self.waiting.append(text)

    def stop(self, reason: str) -> None:
        """Switch the coil off and end; nobody is asked any more."""
        self.asked = None
        super().stop(reason)

    def answer(self, text: str = "") -> None:
        """The person has done what the run waits for, and typed `text`."""
        if self.asked is None:
            return
        said = f"Done: {self.asked.text}"
        if self.asked.current is not None:
            at = show(self.asked.current, "A")
            said = f"Typed {text.replace('-', '−')} at {at}"
        self._log.add(Severity.INFO, "runner", said)
        self.asked = None
        self.say(answer, text)
        self._status.changed.emit()

    def hear(self, event: TaskEvent) -> None:
        """Note what the run tells."""
        source, coil = self.source, self._status.coil
        match event:
            case Begun():
                self._has_begun(event)
            case PersonAsked():
                self.asked = event
                words = f"{event.doubt} {event.text}".strip()
                self._log.add(Severity.WARNING, "runner", words)
                self._status.changed.emit()
            case events.StateChanged():
                self._run_state(event)
            case events.Message(level=level, text=text):
                self._log.add(LEVELS.get(level, Severity.INFO), "runner", text)
            case events.Progress(elapsed=elapsed, expected=expected):
                self.elapsed, self.expected = elapsed, expected
            case events.TrialEnded(outcome=outcome):
                self.trial_ended.emit(outcome)
            case _ if source is None:
                return  # nothing is measured before it has begun
            case Samples(bins=bins):
                source.add_bins(bins)
            case ModelPart():
                source.model.add(event)
            case events.SpikesSeen(times=times):
                source.add_spikes(times)
            case events.CoilCurrent(time=at, setpoint=sent, measured=read):
                coil.sign_of_life()
                source.add_current(at, sent if read is None else read)
            case events.FieldRead(time=at, field=field):
                self.field = field
                self._answers("meter")
                source.add_field(at, field)
            case events.TemperatureRead(time=at, kelvin=kelvin):
                self.kelvin = kelvin
                self._answers("thermometer")
                source.add_reading("temperature", at, kelvin)
            case events.VoltageRead(name=name, held=held):
                self.voltages[name] = held.voltage
                self._answers(name)
            case events.TrialStarted():
                self._trial_started(source, event)

    def has_ended(self, ending: Ending) -> None:
        """Tell how the coil was left and what was kept; the state follows."""
        status, off = self._status, ending.off
        self.asked = None
        if self.source is not None:
            self.source.running = False
        self.waiting += self._early
        self._early = []
        if ending.state is events.RunState.REFUSED:
            self.name = ""
            status.set_fault("The run was refused.", ending.reason or "")
        elif ending.state is events.RunState.LOST:
            status.lose_engine(kept=True)
            self.cut.emit("Cut short")
        elif isinstance(ending, Executed):
            status.coil.left(off)
            self._keep(ending)
        else:
            status.coil.left(off)
            status.set_fault("The run broke.", f"{ending.reason} {off.text}")
            self.cut.emit("Broke")

    def _keep(self, done: Executed) -> None:
        status, off, folder = self._status, done.off, done.folder
        self.elapsed = done.duration
        level = Severity.GOOD if off.verified else Severity.ERROR
        self._log.add(level, "safety", f"Coil: {off.text}", safety=True)
        words = f"{folder.name} {done.state}: {looked_for(done.spikes, 'spike')}"
        lost = done.loss.get("samples")
        if lost is not None and self.source is not None and self.source.sampled:
            words += f", {lost} samples lost"
        self._log.add(Severity.INFO, "store", words)
        self.report(folder, follow=True)
        self.ended.emit(done)
        if not off.verified:
            status.set_fault("The coil's state is unknown after the run.", off.text)
        elif done.state is events.RunState.FAULTED:
            kept = f"What was recorded in {done.duration:.1f} s is in {folder.name}. "
            if not (folder / DATA).exists():
                kept = f"Nothing of it is in {folder.name}. "
            left = f"Coil off, {milliamperes(off.current)} read back."
            status.set_fault(done.reason or "The run faulted.", kept + left)
        else:
            status.enter(WindowState.READY)
            if done.state is events.RunState.COMPLETE:
                self.completed.emit()

    def report(self, folder: Path, *, follow: bool = False) -> None:
        """Have the report of a run in `folder` written, where reports are wanted.

        Args:
            folder: of the run.
            follow: then do what the lab has follow each run.
        """
        then = partial(self._follow, folder) if follow else None
        if self.reports:
            self.write_report(folder, then)
        elif then is not None:
            then()

    def write_report(
        self, folder: Path, then: Callable[[], None] | None = None
    ) -> None:
        """Have a report written, as `reported` tells, and do what comes `then`."""

        def written() -> None:
            self.reported.emit(folder)
            if then is not None:
                then()

        self._write_report(folder, written)

    def renew_report(self, folder: Path) -> None:
        """Have a report that is there written again: more was said of its run.

        What it concludes is the same, and is not told again.
        """
        if folder in self.reporting:
            self._outdated.add(folder)
        elif (folder / REPORT).exists():
            self._write_report(folder, lambda: None)

    def hasten(self) -> None:
        """Have the reports that wait written all at once: the window goes."""
        for folder in [*self.reporting][1:]:
            self._link.ask(lambda reply: None, write_report, folder)

    def _write_report(self, folder: Path, then: Callable[[], None]) -> None:
        """Have a report written; again, if it was outdated meanwhile."""
        self.reporting[folder] = then
        if len(self.reporting) == 1:
            self._write_next()

    def _write_next(self) -> None:
        folder = next(iter(self.reporting), None)
        if folder is not None:
            told = partial(self._written, folder)
            self._link.ask(told, write_report, folder)

    def _written(self, folder: Path, reply: Reply[None]) -> None:
        then = self.reporting.pop(folder)
        self._write_next()
        if reply.problem:
            problem = reply.problem.removesuffix(".")
            words = f"No new report of {folder.name}: {problem}. {AGAIN}"
            self._log.add(Severity.WARNING, "report", words)
        else:
            self._log.add(Severity.GOOD, "report", f"Report in {folder / REPORT}")
        then()
        if folder in self._outdated:
            self._outdated.discard(folder)
            self.renew_report(folder)

    def _follow(self, folder: Path) -> None:
        """Have what the lab wants done after a run done."""

        def told(reply: Reply[str]) -> None:
            if problem := reply.problem or reply.value:
                self._log.add(Severity.WARNING, "lab", problem)

        self._link.ask(told, follow_run, folder)

    def _has_begun(self, event: Begun) -> None:
        plan, coil = self.expectation, self._status.coil
        self._early = []
        if event.folder is not None:
            self.folder, self.name = event.folder, event.folder.name
            self._log.add(Severity.INFO, "store", f"Recording to {event.folder}")
        self.expected = plan.estimate.duration if plan else None
        coil.limits = event.limits or coil.limits
        coil.sign_of_life()
        preview = plan.preview if plan else None
        self.source = LiveSource(preview, event.newtons_per_ampere, event.folder)
        self.source.simulated, self.source.counted = event.simulated, event.counted
        self.source.shortest_interval = event.shortest_interval
        for warning in plan.warnings if plan else ():
            self._log.add(Severity.WARNING, "plan", warning)
        self.begun.emit(self.source)
        self._status.changed.emit()

    def _trial_started(self, source: LiveSource, event: events.TrialStarted) -> None:
        trial, start = event.trial, event.start
        self.trial, self.probes = (event.index, trial.label), trial.probes
        source.begin_trial(event.index, Stretch.of(trial, start))
        what = "recovery" if trial.pause else trial.label
        words = f"Step {event.index + 1} · {what} started"
        self._log.add(Severity.INFO, "runner", words, time=start, run=self.folder)
        self._status.changed.emit()

    def _run_state(self, event: events.StateChanged) -> None:
        running = self._status.state is WindowState.RUNNING
        if event.state is events.RunState.STOPPING:
            self.asked = None
            if running:
                self._status.enter(WindowState.ABORTING)
        if event.state in (events.RunState.CONNECTING, events.RunState.RUNNING):
            self._log.add(Severity.INFO, "runner", event.text.capitalize())
