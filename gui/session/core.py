"""What the session knows, and the few moves all of it shares."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from gui.lanes.source import LiveSource
from gui.session.coil import CoilWatch
from gui.session.link import Link, RunAfar
from gui.session.messages import (
    Checked,
    Errand,
    Level,
    Line,
    Told,
)
from gui.session.monitor import Monitor
from gui.session.request import Request
from gui.state import CoilView, Fault, State
from tactile_lab.acquisition.by_hand import ManualCoil
from tactile_lab.scene.bench_file import BenchSpec
from tactile_lab.trial import Outcome

if TYPE_CHECKING:
    from gui.session.expect import Expectation
    from tactile_lab.acquisition.execution import CoilState

LEVELS = {"info": Level.INFO, "warning": Level.WARNING, "error": Level.ERROR}


@dataclass(frozen=True, eq=False)
class Queued:
    """A run that waits for the one before it."""

    title: str
    request: Request
    duration: float


class Core(QObject):
    """State, bench, run in progress, queue and log.

    Args:
        out: folder for run folders.
        separate: benches are driven in a process of its own.
        realtime: a simulated bench is paced by the wall clock.

    Attributes:
        bench_overrides: ``bench.key=value`` texts that change the connected bench.
    """

    changed = Signal()
    logged = Signal(object)
    planned = Signal(object)
    source_changed = Signal(object)
    trial_ended = Signal(object)
    run_ended = Signal(object)
    reported = Signal(object)
    twinned = Signal(object)
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
        self.queue: list[Queued] = []
        self.manual: ManualCoil | None = None
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
        self.monitor = Monitor(self.link)
        self.folder: Path | None = None
        self._run: RunAfar | None = None
        self._running: Expectation | None = None
        self._serial = 0
        self._after_monitor: tuple[Request, str] | None = None
        self._check_request: Request | None = None

    def start(self, request: Request, title: str) -> None:
        """Run `request` now, or as soon as the monitor has let go of the scope."""
        if self.state is not State.READY or self.manual is not None:
            return
        if self.monitor.alive:
            self.monitor.stop()
            self._after_monitor = (request, title)
            return
        self.fault, self.source, self.outcomes, self.trial = None, None, [], None
        self.elapsed, self.expected = 0.0, None
        self.run_name = title
        self._running = self.expectation
        self._run = self.link.run(
            request, self.out, self.inbox, self.notes, report=self.reports
        )
        self._enter(State.RUNNING)

    def enqueue(self, item: Queued) -> None:
        """Have a run follow those before it; it starts at once if none is running."""
        self.queue.append(item)
        self.queue_changed.emit()
        self._next_in_queue()

    def unqueue(self, number: int) -> None:
        """Take a waiting run out of the queue."""
        del self.queue[number]
        self.queue_changed.emit()

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
            return self.manual.state
        if self._run is not None and self._run.alive:
            return self._run.coil
        return None

    def _next_in_queue(self) -> None:
        if self.state is State.READY and self.queue and self.manual is None:
            item = self.queue.pop(0)
            self.queue_changed.emit()
            self.expectation = None
            self.start(item.request, item.title)

    def _stop_source(self) -> None:
        if self.source is not None:
            self.source.running = False

    def _set_fault(self, fault: Fault) -> None:
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
