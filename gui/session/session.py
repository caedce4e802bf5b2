"""What is behind the window: puts its parts together and says what may follow what.

It decides nothing about instruments: the engine, a process of its own, does. The
window's timer calls `poll`, which hands over all that the engine told. Nothing blocks.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from gui.lanes.live import LiveSource
from gui.session.bench import ConnectedBench
from gui.session.chips import Chips
from gui.session.form_plan import FormPlan
from gui.session.live_manual import LiveManual
from gui.session.live_monitor import LiveMonitor
from gui.session.live_run import LiveRun
from gui.session.log import Log, Severity
from gui.session.queue import Queue, Queued
from gui.session.status import Status
from gui.state import CoilView, Snapshot, WindowState
from tactile_lab.engine.link import Link
from tactile_lab.engine.request import Request
from tactile_lab.errors import TactileLabError

if TYPE_CHECKING:
    from gui.session.expectation import Expectation

REST = 30.0
"""Time after which a desk of which nothing is asked ends, s; it takes 60 MB."""

MONITOR, BY_HAND = "Monitor", "By hand"
"""What is seen live and is no run."""


class Session(QObject):
    """The parts, and the rules between them.

    Args:
        out: folder for run folders.
        separate: benches are driven in a process of its own.
        realtime: a simulated bench is paced by the wall clock.

    Attributes:
        log: what happened.
        status: the one state, and the coil.
        link: to the engine, which drives instruments.
        desk: to a second one that fits and solves models and holds no instrument: its
            work delays no set-point, and as a thread of the window it would delay
            frames.
        bench: connected to.
        plan: of what the form asks for.
        queue: of runs.
        run, monitor, manual: what uses the bench, one at a time.
        opened: names of the runs from disk that are on screen, () while none is.
        source: what is seen live: the run in progress or the last one, or the monitor.
        unkept: what that is where it is no run, also after its end; "" for a run.
    """

    source_changed = Signal(object)
    stopped = Signal()
    """STOP was pressed: nothing that was asked for before it may begin."""

    def __init__(
        self, out: Path, *, separate: bool = True, realtime: bool = True
    ) -> None:
        super().__init__()
        self.out = out
        self.log = Log()
        self.status = Status(self.log)
        self.link = Link(separate=separate, realtime=realtime, lost=self._engine_lost)
        self.desk = Link(
            separate=separate, lost=self._desk_lost, rest=REST, behind=True
        )
        parts = self.link, self.status, self.log
        self.bench = ConnectedBench(
            *parts, lambda: self._free and not self.monitor.alive
        )
        self.plan = FormPlan(lambda: self._planner)
        self.run = LiveRun(*parts, out)
        self.monitor = LiveMonitor(*parts)
        self.manual = LiveManual(*parts)
        self.queue = Queue(
            lambda: self._planner,
            self.log,
            lambda: self.bench.choice,
            lambda: self._free,
            lambda: self.run.alive or self.state.in_run,
            self._let_go,
            lambda item: self.start(item.request, item.title, item.expectation),
        )
        self._chips = Chips(self.status, self.bench, self.run, self.monitor)
        self.opened: tuple[str, ...] = ()
        self.source: LiveSource | None = None
        self.unkept = ""
        self._after_monitor: tuple[Request, str, Expectation | None] | None = None
        self._refused = False
        self.status.changed.connect(self._forget_refusal)
        self.status.faulted.connect(self.queue.hold)
        self.bench.ready.connect(self.queue.next)
        self.run.completed.connect(self.queue.next)
        self.plan.arrived.connect(self.status.changed)
        self.run.begun.connect(lambda source: self._show_live(source, ""))
        self.run.ended.connect(self.bench.confirm)
        self.monitor.begun.connect(lambda source: self._show_live(source, MONITOR))
        self.manual.begun.connect(lambda source: self._show_live(source, BY_HAND))
        self.monitor.ended.connect(self._start_after_monitor)
        self.monitor.ended.connect(self.queue.next)

    # --- what the window asks for

    def connect_bench(self, choice: str) -> str:
        """Ask the instruments of a bench who they are; why not, "" if they are asked.

        Args:
            choice: "sim" or a bench file.
        """
        if self.state is WindowState.FAULT:
            return "Acknowledge the fault first."
        if self.busy or self.state is WindowState.CONNECTING:
            return "The connected bench is in use; connect this one once it is ready."
        self.monitor.stop("another bench is connected")
        self.bench.connect_to(choice)
        return ""

    def connect_again(self) -> None:
        """Ask the bench that did not answer, or whose file could not be used."""
        if self.bench.wanted is not None:
            self.connect_bench(self.bench.wanted)

    def disconnect_bench(self) -> None:
        """Let go of the bench."""
        if self._free:
            self.monitor.stop("the bench is disconnected")
            self.bench.let_go()
            self.status.enter(WindowState.DISCONNECTED)

    def set_inputs(self, channels: str) -> str:
        """Set the scope's inputs for all that follows; why not, "" if it went well.

        Args:
            channels: ``[[scope.channels]]`` of a bench file as one TOML list.
        """
        if self.state is not WindowState.READY:
            return "The scope's inputs are set between runs."
        return self.bench.set_inputs(channels)

    def keep_in(self, out: Path) -> None:
        """Keep the runs that follow in another folder."""
        self.out = self.run.out = out

    def read_field(self) -> None:
        """Read the field between runs, or while the coil is driven by hand."""
        if self.state is WindowState.READY:
            task = self.manual.task
            self.bench.read_field(0 if task is None else task.number)

    def start(
        self, request: Request, title: str, expectation: Expectation | None = None
    ) -> None:
        """Run `request` now, or as soon as the monitor has let go of the scope.

        Args:
            request: what to run.
            title: for people.
            expectation: its plan; None if nobody planned it.
        """
        if not self._free:
            return
        if not self._let_go():
            self._after_monitor = (request, title, expectation)
            return
        self.status.fault, self.source = None, None
        self.run.start(request, title, expectation)
        self.status.enter(WindowState.RUNNING)

    def enqueue_scene(self, scene: str, title: str) -> str:
        """Have a scene follow the runs before it; why not, "" if it does."""
        request = Request(scene, self.bench.overrides, self.bench.choice)
        try:
            request.load()
        except (TactileLabError, OSError) as error:
            return str(error)
        self.queue.add(Queued(title, request))
        return ""

    def start_queue(self) -> None:
        """Start the queue, or go on with it after a STOP or a fault.

        Where nothing could begin now it stays held: to connect a bench, to acknowledge
        a fault or to let go of the coil would else begin a run later, unasked.
        """
        reason = ""
        if self.state is WindowState.DISCONNECTED:
            reason = "Connect a bench first."
        elif self.state is WindowState.FAULT:
            reason = "Acknowledge the fault first."
        elif self.manual.alive:
            reason = "Let go of the coil that is driven by hand first."
        if not reason:
            self.queue.resume()
        elif self.queue.items:
            self.queue.hold()
            self.log.tell(Severity.WARNING, "queue", f"Nothing starts. {reason}")
            self._refused = True

    def _forget_refusal(self) -> None:
        """What kept the queue from starting is in its way no more."""
        if self._refused and self._free:
            self._refused = False
            self.log.told.emit("")

    def begin_manual(self) -> None:
        """Open the coil source to drive it by hand."""
        if self._free and self.bench.request and self.bench.spec:
            self.monitor.stop("manual control begins")
            gain = self.bench.spec.magnet.newtons_per_ampere
            self.manual.start(self.bench.request, gain)
            self.status.changed.emit()

    def show_monitor(self, on: bool) -> None:
        """Show the sensor live between runs, coil off; or stop that."""
        if not on:
            self.monitor.stop("monitor off")
        elif self._free and self.bench.choice and not self.monitor.alive:
            self.monitor.start(self.bench.choice, self.bench.overrides)

    def record(self) -> None:
        """Keep the last minute of what is watched as a run."""
        self.monitor.record(self.out, self.run.notes)

    def note(self, text: str) -> None:
        """A note of the user on the run in progress, or on the next one."""
        at = f" (at {self.run.elapsed:.1f} s)"
        self.log.add(
            Severity.NOTE,
            "note",
            text + (at if self.run.alive else " (kept for the next run)"),
            time=self.run.elapsed if self.run.alive else None,
        )
        self.run.note(text)

    def stop(self, reason: str = "STOP in the window") -> None:
        """Coil off, now. Reaches the coil's thread directly and never waits.

        Runs that wait in the queue are held until somebody resumes it.
        """
        if self._after_monitor is not None:
            title = self._after_monitor[1]
            self._log_stop(f"{title} was not begun", Severity.WARNING)
            self._after_monitor = None
        self.stopped.emit()
        if self.manual.alive:
            self.manual.stop(reason)
            self._log_stop(f"{reason}: coil off", Severity.WARNING)
        elif self.run.alive:
            self.run.stop(reason)
            if self.state is WindowState.RUNNING:
                self.status.enter(WindowState.ABORTING)
                self._log_stop(f"{reason}: coil off", Severity.WARNING)
        elif self.monitor.alive:
            self.monitor.stop("monitor off")
            self._log_stop("Monitor off; the coil was not in use")
        elif self.state is WindowState.READY and self.bench.request is not None:
            self._log_stop("Sending coil off again")
            self.bench.check()
        elif self.state in (WindowState.FAULT, WindowState.DISCONNECTED):
            if self.status.coil.limits is not None:
                self._log_stop("Sending coil off again", Severity.WARNING)
                self.bench.switch_off()
        self.queue.hold()

    def acknowledge(self) -> None:
        """The user has read the fault; who is still there, and the coil, is asked."""
        if self.state is WindowState.FAULT:
            self.status.fault = None
            if self.bench.found is not None:
                self.bench.check()
            else:
                self.status.enter(WindowState.DISCONNECTED)

    def take_as_off(self) -> None:
        """A person has seen to the coils of other benches that were left unknown."""
        coil = self.status.coil
        left, coil.left_unknown = coil.left_unknown, ()
        if left:
            words = f"The coil at {' and '.join(left)} is off, a person says"
            self.log.add(Severity.WARNING, "safety", words, safety=True)
            self.status.changed.emit()

    # --- what the window shows

    @property
    def state(self) -> WindowState:
        """Of the window."""
        return self.status.state

    @property
    def name(self) -> str:
        """Of what is on screen: opened from disk, else seen live; "" before any."""
        if len(self.opened) > 1:
            return f"{len(self.opened)} runs"
        return "".join(self.opened) or self.unkept or self.run.name

    @property
    def busy(self) -> bool:
        """Whether something has the coil, or is about to."""
        begins = self._after_monitor is not None
        return begins or self.run.alive or self.state.in_run or self.manual.alive

    @property
    def occupied(self) -> bool:
        """Whether the engine still has something to end: a run, a watch, a record."""
        return self.busy or self.monitor.alive or self.monitor.recording

    @property
    def plan_on_screen(self) -> Expectation | None:
        """The plan of the run in progress, else that of the form."""
        in_run = self.state.in_run
        return self.run.expectation if in_run else self.plan.expectation

    def coil_view(self) -> CoilView | None:
        """The coil as it is known now."""
        task = self.manual if self.manual.alive else self.run
        return self.status.coil.view(task.coil, task.heard)

    def snapshot(self) -> Snapshot:
        """Everything the header, banner and buttons are rendered from."""
        coil, spec = self.coil_view(), self.bench.spec
        seen = self.state is not WindowState.DISCONNECTED
        return Snapshot(
            state=self.state,
            bench="" if spec is None else spec.name,
            simulated=spec is not None and spec.simulated,
            title=self.name if seen else "",
            opened=len(self.opened) if seen else 0,
            coil=coil,
            left_unknown=self.status.coil.left_unknown,
            instruments=self._chips.views(self.plan_on_screen, coil),
            elapsed=self.run.elapsed,
            expected=self.run.expected,
            manual=self.manual.alive,
            known=self.bench.known,
            queued=tuple(item.title for item in self.queue.items),
            notes=tuple(self.run.waiting),
            fault=self.status.fault,
        )

    def poll(self) -> bool:
        """Take all that the engine told; whether it told anything."""
        told = self.link.poll()
        self.desk.poll()
        self.bench.watch()
        return told

    def close(self) -> None:
        """Let go of the engine; nothing drives a coil any more."""
        self.run.hasten()
        self.link.close()
        self.desk.close()

    # --- inside

    @property
    def _free(self) -> bool:
        """Whether something may begin to use the bench."""
        ready = self.state is WindowState.READY and not self.manual.alive
        return ready and self._after_monitor is None

    @property
    def _planner(self) -> Link:
        """Who plans: the engine, which is then warm, or the desk beside a run."""
        return self.desk if self.busy else self.link

    def _show_live(self, source: LiveSource, unkept: str) -> None:
        self.source, self.unkept = source, unkept
        self.source_changed.emit(source)

    def _let_go(self) -> bool:
        """Have the monitor let go of the bench; whether it has."""
        self.monitor.stop("a run begins")
        return not self.monitor.alive

    def _start_after_monitor(self) -> None:
        wanted, self._after_monitor = self._after_monitor, None
        if wanted is not None:
            self.start(*wanted)

    def _log_stop(self, text: str, level: Severity = Severity.INFO) -> None:
        self.log.add(level, "safety", text, safety=True)

    def _engine_lost(self, why: str) -> None:
        text = f"The process that drives the instruments has ended: {why}. "
        again = "Another is started when it is needed."
        self.log.add(Severity.ERROR, "engine", text + again)

    def _desk_lost(self, why: str) -> None:
        text = f"Fits and the model beside runs were interrupted: {why}"
        self.log.add(Severity.WARNING, "desk", text)
