"""What background threads tell the session, and how its state moves because of it."""

from __future__ import annotations

from queue import Empty
from typing import TYPE_CHECKING

from gui.lanes.expected import Hold
from gui.lanes.source import LiveSource
from gui.session import chips
from gui.session.core import Core
from gui.session.messages import (
    Begun,
    Broken,
    Checked,
    CoilByHand,
    Ended,
    Errand,
    FieldByHand,
    Fitted,
    HandOff,
    Level,
    Line,
    Lost,
    Planned,
    Refused,
    Reported,
    Samples,
    Told,
    Twinned,
    Twins,
    TwinSeen,
)
from gui.state import Fault, State, milliamperes
from tactile_lab.acquisition import events
from tactile_lab.bench import OffReport
from tactile_lab.trial import Outcome

if TYPE_CHECKING:
    from tactile_lab.acquisition.ending import Executed

LEVELS = {"info": Level.INFO, "warning": Level.WARNING, "error": Level.ERROR}


class Incoming(Core):
    """Takes everything from the one queue; nothing here blocks."""

    def poll(self) -> bool:
        """Take all that engine and threads told; whether samples came too."""
        self._mind_monitor()
        while True:
            try:
                told = self.inbox.get_nowait()
            except Empty:
                break
            self._take(told)
        self._mind_desk()
        return self.source is not None and self.source.take_new()

    def _mind_desk(self) -> None:
        """Take what the desk told: it holds no instrument."""
        while not self.desk_inbox.empty():
            match told := self.desk_inbox.get_nowait():
                case Fitted():
                    self.fitted.emit(told)
                case Twins():
                    self.twinned.emit(told)
                case TwinSeen():
                    self.twin_seen.emit(told)
                case Lost(why=why):
                    text = f"Fits and the model beside runs were interrupted: {why}"
                    self.log(Level.WARNING, "desk", text)
                    self.fitted.emit(Fitted(-1, None))

    def _take(self, told: Told) -> None:
        match told:
            case events.SpikesSeen(times=times):
                if self.source is not None:
                    self.source.add_spikes(times)
            case events.CoilCurrent():
                self._current(told)
            case events.FieldRead(time=at, field=field):
                self.readings["field"] = field
                if self.source is not None:
                    self.source.add_field(at, field)
            case events.Progress(elapsed=elapsed, expected=expected):
                self.elapsed, self.expected = elapsed, expected
            case events.TrialStarted():
                self._trial_started(told)
            case events.TrialEnded(outcome=outcome):
                self._trial_ended(outcome)
            case events.Message(level=level, text=text):
                self.log(LEVELS.get(level, Level.INFO), "runner", text)
            case events.StateChanged():
                self._run_state(told)
            case events.FolderMade(folder=folder):
                self.folder, self.run_name = folder, folder.name
                self.log(Level.INFO, "store", f"Recording to {folder}")
            case Begun():
                self._begun(told)
            case Samples(bins=bins):
                if self.source is not None:
                    self.source.add_bins(bins)
            case Ended(done=done):
                self._ended(done)
            case Broken(fault=fault, off=off):
                self.coil.left(off or OffReport(False, None, "not verified"))
                self._stop_source()
                self._set_fault(fault)
            case Refused(fault=fault):
                self._refused(fault)
            case Checked():
                self._checked(told)
            case Planned():
                self._planned(told)
            case Reported(folder=folder, problem=problem):
                if problem:
                    self.log(Level.WARNING, "report", problem)
                else:
                    self.log(
                        Level.GOOD, "report", f"Report in {folder / 'report.html'}"
                    )
                self.reported.emit(folder)
            case Twinned(part=part):
                if self.source is not None:
                    self.source.model.add(part)
            case Errand():
                self.errand = told
                self.log(Level.WARNING, "runner", f"{told.doubt} {told.text}".strip())
                self.changed.emit()
            case CoilByHand():
                self._by_hand(told)
            case HandOff():
                self._hand_off(told)
            case FieldByHand(mean=mean, text=text):
                self.reading_field = False
                if mean is not None:
                    self.readings["field"] = mean
                self.log(Level.INFO if mean is not None else Level.ERROR, "meter", text)
                self.changed.emit()
            case Lost():
                self._lost(told)
            case Line():
                self.lines.append(told)
                self.logged.emit(told)

    def _current(self, told: events.CoilCurrent) -> None:
        self.coil.sign_of_life(read_back=told.measured is not None)
        value = told.setpoint if told.measured is None else told.measured
        if self.source is not None:
            self.source.add_current(told.time, value)

    def _trial_started(self, told: events.TrialStarted) -> None:
        trial = told.trial
        self.trial, self.probes = (told.index, trial.label), trial.probes
        held = None
        if trial.hold is not None:
            held = told.start + trial.hold[0], told.start + trial.hold[1]
        end = told.start + trial.length
        hold = Hold(told.start, end, trial.label, trial.pause, held)
        if self.source is not None:
            self.source.begin_trial(told.index, hold)
        what = "recovery" if trial.pause else trial.label
        self.log(Level.INFO, "runner", f"Step {told.index + 1} · {what} started")
        self.changed.emit()

    def _trial_ended(self, outcome: Outcome) -> None:
        self.outcomes.append(outcome)
        self.trial_ended.emit(outcome)

    def _run_state(self, told: events.StateChanged) -> None:
        if told.state is events.RunState.STOPPING and self.state is State.RUNNING:
            self._enter(State.ABORTING)
        if told.state in (events.RunState.CONNECTING, events.RunState.RUNNING):
            self.log(Level.INFO, "runner", told.text.capitalize())

    def _begun(self, told: Begun) -> None:
        expectation = self.running
        self.expected = expectation.estimate.duration if expectation else None
        self.coil.limits = told.limits or self.coil.limits
        self.coil.sign_of_life(read_back=True)
        preview = expectation.preview if expectation else None
        self.source = LiveSource(preview, told.newtons_per_ampere)
        for warning in expectation.warnings if expectation else ():
            self.log(Level.WARNING, "plan", warning)
        self.source_changed.emit(self.source)
        self.changed.emit()

    def _lost(self, told: Lost) -> None:
        """The engine died. A guard, where the source has one, switches it off."""
        self._stop_source()
        self.log(Level.ERROR, "engine", f"The engine ended: {told.why}")
        kept = ""
        if self.manual is None:
            kept = "Data up to then are kept (`tactile-lab recover`). "
        self.manual, self.reading_field = None, False
        if told.driving or self.state is State.CONNECTING:
            self.coil.left(OffReport(False, None, "not verified"))
            self._set_fault(
                Fault(
                    "The process that drives the instruments has ended.",
                    f"{kept}Look at the source: its guard switches it off, a simulated "
                    "one is gone.",
                )
            )

    def _ended(self, done: Executed) -> None:
        ending = done
        self.coil.left(ending.off)
        self._stop_source()
        self.elapsed = done.duration
        good = ending.off.verified
        level = Level.GOOD if good else Level.ERROR
        self.log(level, "safety", f"Coil: {ending.off.text}", safety=True)
        words = f"{done.folder.name} {ending.state}: {done.spikes} spikes"
        lost = done.loss.get("samples")
        if lost is not None:
            words += f", {lost} samples lost"
        self.log(Level.INFO, "store", words)
        self.run_ended.emit(done)
        if not good:
            self._set_fault(
                Fault("The coil's state is unknown after the run.", ending.off.text)
            )
        elif ending.state is events.RunState.FAULTED:
            kept = f"{done.duration:.1f} s of data kept in {done.folder.name}. "
            self._set_fault(
                Fault(ending.reason or "The run faulted.", kept + _left(ending.off))
            )
        else:
            self._enter(State.READY)
            if ending.state is events.RunState.COMPLETE:
                self._next_in_queue()

    def _refused(self, fault: Fault) -> None:
        self._stop_source()
        self.run_name = ""
        self.log(Level.ERROR, "bench", f"{fault.title} {fault.consequence}")
        if self.bench is None:
            self.spec, self.bench_choice = None, None
        self._set_fault(fault)

    def _checked(self, told: Checked) -> None:
        broken = [one for one in told.found if one.problem]
        self.bench = None if broken else told
        coil = self.spec.coil if self.spec is not None else None
        has_coil = coil is not None and any(f.role == "coil" for f in told.found)
        self.coil.use(coil.limits if has_coil and coil is not None else None)
        self.coil.left(told.off)
        for one in told.found:
            if one.problem:
                self.log(Level.ERROR, one.role, one.problem)
            else:
                self.log(Level.GOOD, one.role, one.identity)
        if told.off is not None and not told.off.verified:
            self._set_fault(Fault("The coil's state is unknown.", told.off.text))
        elif broken:
            text = "; ".join(one.problem for one in broken)
            names = " and ".join(chips.NAMES[one.role].lower() for one in broken)
            self._set_fault(Fault(f"No answer from the {names}.", text))
        else:
            self._enter(State.READY)
            self._next_in_queue()

    def _planned(self, told: Planned) -> None:
        if told.serial in self._queue_plans:
            self._queue_planned(told)
        elif told.serial == self._serial:
            self.expectation, self.plan_problem = told.expectation, told.problem
            self.planned.emit(told)
            self.changed.emit()

    def _mind_monitor(self) -> None:
        begun = self.monitor.poll()
        if begun is not None:
            self.source = begun
            self.source_changed.emit(begun)
        if self.monitor.problem:
            self.log(Level.ERROR, "monitor", self.monitor.problem)
            self.monitor.problem = ""
        recorded, self.monitor.recorded = self.monitor.recorded, None
        if recorded is not None and recorded.folder is not None:
            self.log(Level.GOOD, "monitor", f"Recorded to {recorded.folder}")
            self.recorded.emit(recorded.folder)
        elif recorded is not None:
            self.log(Level.ERROR, "monitor", f"Not recorded: {recorded.problem}")
        if self._after_monitor is not None and not self.monitor.alive:
            wanted, self._after_monitor = self._after_monitor, None
            self.start(*wanted)

    def _by_hand(self, told: CoilByHand) -> None:
        """Note what the coil does; the engine hears that the window lives."""
        if told.acted:
            self.coil.sign_of_life(read_back=told.read_back)
        if self.manual is not None:
            self.manual.renew()

    def _hand_off(self, told: HandOff) -> None:
        self.manual = None
        if not told.opened:
            self._set_fault(Fault("The coil cannot be driven by hand.", told.problem))
            return
        off = told.off or OffReport(False, None, "not verified")
        self.coil.left(off)
        if not off.verified:
            self._set_fault(
                Fault("The coil's state is unknown.", told.problem or off.text)
            )
        elif told.problem:
            self._set_fault(Fault("Manual control ended.", told.problem))
        self.log(Level.GOOD, "safety", "Manual control off", safety=True)
        self.changed.emit()


def _left(off: OffReport) -> str:
    return f"Coil off, {milliamperes(off.current)} read back."
