"""Manual control between runs: the coil held at a current."""

from __future__ import annotations

from PySide6.QtCore import Signal

from gui.lanes.live import LiveSource
from gui.session.live_task import LiveTask
from gui.session.log import Log, Severity
from gui.session.status import Status
from tactile_lab.acquisition.ending import Ending
from tactile_lab.acquisition.events import CoilCurrent, Message, RunState, StateChanged
from tactile_lab.engine.commands import begin_manual, hold, renew
from tactile_lab.engine.events import Begun, Samples, TaskEvent
from tactile_lab.engine.link import Link
from tactile_lab.engine.request import Request


class LiveManual(LiveTask):
    """The coil of one bench, driven by hand.

    Attributes:
        current: that it was asked to hold last, A.
        opened: the source has answered.
        source: what is seen of the coil since; nothing of it is kept.
    """

    begun = Signal(object)

    def __init__(self, link: Link, status: Status, log: Log) -> None:
        super().__init__(link, status, log)
        self.current = 0.0
        self.opened = False
        self.source: LiveSource | None = None
        self._zero: float | None = None

    def start(self, request: Request, newtons_per_ampere: float) -> None:
        """Open the coil source of a request's bench; the output stays off."""
        self.current, self.opened = 0.0, False
        self.source, self._zero = LiveSource(None, newtons_per_ampere), None
        self._begin(begin_manual, request)
        self._log.add(Severity.WARNING, "coil", "Manual control on", safety=True)

    def hold(self, current: float) -> None:
        """Go to `current`, A, as fast as the slew limit lets it, and stay."""
        if self.task is not None:
            self.current = current
            self.say(hold, current)

    def hear(self, event: TaskEvent) -> None:
        """Note what the coil does; each word is answered by renewing the lease."""
        if isinstance(event, Begun) and self.source is not None:
            self.source.simulated = event.simulated
        elif isinstance(event, StateChanged):
            self.opened = self.opened or event.state is RunState.READY
        elif isinstance(event, CoilCurrent):
            self._status.coil.sign_of_life()
            self._see(event)
        elif isinstance(event, Message):
            self._log.tell(Severity.WARNING, "coil", event.text)
        elif isinstance(event, Samples):
            self.say(renew)

    def _see(self, event: CoilCurrent) -> None:
        """Put a current into the lanes, which are shown with the first one."""
        source = self.source
        if source is None:
            return
        if self._zero is None:
            self._zero = event.time
            self.begun.emit(source)
        at = event.time - self._zero
        current = event.setpoint if event.measured is None else event.measured
        source.add_current(at, current)
        source.add_reading("coil_current", at, current)

    def has_ended(self, ending: Ending) -> None:
        """Tell how the coil was left."""
        status, off, reason = self._status, ending.off, ending.reason or ""
        self.current = 0.0
        if self.source is not None:
            self.source.running = False
        if ending.state is RunState.REFUSED:
            status.set_fault("The coil cannot be driven by hand.", reason)
            return
        if ending.state is RunState.LOST:
            status.lose_engine()
            return
        status.coil.left(off)
        if not off.verified:
            status.set_fault("The coil's state is unknown.", reason or off.text)
        elif ending.state is RunState.FAULTED:
            status.set_fault("Manual control ended.", reason)
        level = Severity.GOOD if off.verified else Severity.ERROR
        words = f"Manual control off. {off.text}"
        self._log.add(level, "safety", words, safety=True)
        status.changed.emit()
