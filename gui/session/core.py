"""What the session knows, and the few moves all of it shares."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from gui.lanes.source import LiveSource
from gui.session.agreement import Agreement
from gui.session.coil import CoilWatch
from gui.session.commands import MakePlan
from gui.session.link import HandAfar, Link, RunAfar
from gui.session.messages import (
    Checked,
    Errand,
    Level,
    Line,
    Planned,
    Told,
)
from gui.session.monitor import Monitor
from gui.session.request import Request
from gui.state import CoilView, Fault, State
from tactile_lab.scene.bench_file import BenchSpec
from tactile_lab.trial import Outcome

if TYPE_CHECKING:
    from gui.session.expectation import Expectation
    from tactile_lab.acquisition.ending import CoilState

LEVELS = {"info": Level.INFO, "warning": Level.WARNING, "error": Level.ERROR}


@dataclass(eq=False)
class Queued:
    """A run that waits for the one before it.

    Attributes:
        title: for people.
        request: what to run.
        expectation: its plan; None until it is computed.
        left: how it left the queue, in words; "" while it waits.
    """

    title: str
    request: Request
    expectation: Expectation | None = None
    left: str = ""


class Core(QObject):
    """State, bench, run in progress, queue and log.

    Args:
        out: folder for run folders.
        separate: benches are driven in a process of its own.
        realtime: a simulated bench is paced by the wall clock.

    Attributes:
        link: to the engine, which drives instruments.
        desk: to a second one that fits and solves models and holds no instrument: its
            work delays no set-point, and as a thread of the window it would delay
            frames.
        expectation: plan of what the form asks for; None until it is computed.
        running: plan of the run in progress or the last one; None without one.
        running_request, running_title: what that was asked to do, and its name.
        probes: what the probes touch in this trial: the circuit, or something else.
        agreement: how well the model follows the run on screen; None if nobody knows.
        queue_held: whether the queue waits to be resumed, as it does after a STOP.
        bench_overrides: ``bench.key=value`` texts that change the connected bench.
    """

    changed = Signal()
    logged = Signal(object)
    planned = Signal(object)
    source_changed = Signal(object)
    trial_ended = Signal(object)
    run_ended = Signal(object)
    reported = Signal(object)
    recorded = Signal(object)
    twinned = Signal(object)
    twin_seen = Signal(object)
    fitted = Signal(object)
    queue_changed = Signal()

    def __init__(
        self, out: Path, *, separate: bool = True, realtime: bool = True
    ) -> None:
        super().__init__()
        self.out = out
        self.state = State.DISCONNECTED
        self.bench: Checked | None = None
        self.bench_choice: str | None = None
        self.spec: BenchSpec | None = None
        self.fault: Fault | None = None
        self.expectation: Expectation | None = None
        self.plan_problem = ""
        self.source: LiveSource | None = None
        self.outcomes: list[Outcome] = []
        self.trial: tuple[int, str] | None = None
        self.probes = "circuit"
        self.queue: list[Queued] = []
        self.manual: HandAfar | None = None
        self.reading_field = False
        self.bench_overrides: tuple[str, ...] = ()
        self.errand: Errand | None = None
        self.readings: dict[str, float] = {}
        self.elapsed = 0.0
        self.expected: float | None = None
        self.run_name = ""
        self.notes: dict[str, str] = {}
        self.reports = True
        self.lines: list[Line] = []
        self.coil = CoilWatch()
        self.inbox: SimpleQueue[Told] = SimpleQueue()
        self.link = Link(self.inbox, separate=separate, realtime=realtime)
        self.desk_inbox: SimpleQueue[Told] = SimpleQueue()
        self.desk = Link(self.desk_inbox, separate=separate)
        self.monitor = Monitor(self.link)
        self.folder: Path | None = None
        self._run: RunAfar | None = None
        self.running: Expectation | None = None
        self.running_request: Request | None = None
        self.running_title = ""
        self.agreement: Agreement | None = None
        self.queue_held = False
        self._serial = 0
        self._queue_serial = 0
        self._queue_plans: dict[int, Queued] = {}
        self._after_monitor: tuple[Request, str, Expectation | None] | None = None
        self._check_request: Request | None = None

    @property
    def plan_on_screen(self) -> Expectation | None:
        """The plan of the run in progress, else that of the form."""
        busy = self.state in (State.RUNNING, State.ABORTING)
        return self.running if busy else self.expectation

    def start(
        self, request: Request, title: str, expectation: Expectation | None = None
    ) -> None:
        """Run `request` now, or as soon as the monitor has let go of the scope.

        Args:
            request: what to run.
            title: for people.
            expectation: its plan; None if nobody planned it.
        """
        if self.state is not State.READY or self.manual is not None:
            return
        if self.monitor.alive:
            self.monitor.stop()
            self._after_monitor = (request, title, expectation)
            return
        self.fault, self.source, self.outcomes, self.trial = None, None, [], None
        self.elapsed, self.expected = 0.0, None
        self.run_name = title
        self.running, self.running_request = expectation, request
        self.running_title, self.agreement = title, None
        self._run = self.link.run(
            request, self.out, self.inbox, self.notes, report=self.reports
        )
        self._enter(State.RUNNING)

    def enqueue(self, item: Queued) -> None:
        """Have a run follow those before it; it starts at once if none is running."""
        self.queue.append(item)
        if item.expectation is None:
            self._queue_serial -= 1
            self._queue_plans[self._queue_serial] = item
            self.link.ask(MakePlan(self._queue_serial, item.request))
        self.resume_queue()

    def resume_queue(self) -> None:
        """Let the queue go on after a STOP or a fault."""
        self.queue_held = False
        self.queue_changed.emit()
        self._next_in_queue()

    def unqueue(self, number: int) -> None:
        """Take a waiting run out of the queue."""
        self.queue.pop(number).left = "was taken out of the queue"
        self.queue_changed.emit()

    def replace_queued(
        self, item: Queued, request: Request, expectation: Expectation
    ) -> None:
        """Have a waiting run do something else, at its place in the queue."""
        item.request, item.expectation = request, expectation
        self.queue_changed.emit()
        self._next_in_queue()

    def move_queued(self, number: int, by: int) -> None:
        """Move a waiting run up (-1) or down (1)."""
        to = number + by
        if 0 <= to < len(self.queue):
            self.queue[number], self.queue[to] = self.queue[to], self.queue[number]
            self.queue_changed.emit()

    def log(
        self, level: Level, source: str, text: str, *, safety: bool = False
    ) -> None:
        """Put a line into the log."""
        line = Line(datetime.now(), level, source, text, safety)
        self.lines.append(line)
        del self.lines[:-5000]
        self.logged.emit(line)

    def coil_view(self) -> CoilView | None:
        """The coil as it is known now."""
        return self.coil.view(self._coil_state())

    def _coil_state(self) -> CoilState | None:
        if self.manual is not None:
            return self.manual.coil
        # until its end has been taken from the queue: there is no gap to guess in
        running = self.state in (State.RUNNING, State.ABORTING)
        return self._run.coil if running and self._run is not None else None

    def _next_in_queue(self) -> None:
        free = self.state is State.READY and self.manual is None
        if not free or self.queue_held or not self.queue:
            return
        if self.queue[0].expectation is None:
            return  # its plan is being computed
        item = self.queue.pop(0)
        item.left = "has started with the parameters it had"
        self.queue_changed.emit()
        self.start(item.request, item.title, item.expectation)

    def _queue_planned(self, told: Planned) -> None:
        """The plan of a waiting run is there; one that cannot run is taken out."""
        item = self._queue_plans.pop(told.serial)
        if item not in self.queue or item.request != told.request:
            return  # it has left, or does something else by now
        item.expectation = told.expectation
        if told.expectation is None:
            self.queue.remove(item)
            item.left = f"was taken out of the queue: {told.problem}"
            text = f"{item.title} was taken out of the queue: {told.problem}"
            self.log(Level.ERROR, "queue", text)
        self.queue_changed.emit()
        self._next_in_queue()

    def _hold_queue(self) -> None:
        if self.queue and not self.queue_held:
            self.queue_held = True
            self.queue_changed.emit()

    def _stop_source(self) -> None:
        if self.source is not None:
            self.source.running = False

    def _set_fault(self, fault: Fault) -> None:
        self._hold_queue()
        self.fault = fault
        self.log(
            Level.ERROR, "safety", f"{fault.title} {fault.consequence}", safety=True
        )
        self._enter(State.FAULT)

    def _enter(self, state: State) -> None:
        self.state = state
        if state is not State.RUNNING:
            self.errand = None
        self.changed.emit()
