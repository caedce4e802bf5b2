"""The one state of the window, and what is known about the coil."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal

from gui.session.coil import CoilWatch
from gui.session.log import Log, Severity
from gui.state import FaultNotice, WindowState, unmarked
from tactile_lab.bench import OffReport

UNKNOWN = OffReport(False, None, "not verified")


class Status(QObject):
    """Moved by whoever learns something; everything else follows it.

    Attributes:
        state: of the window.
        fault: that nobody has acknowledged.
        coil: what is known about it.
    """

    changed = Signal()
    faulted = Signal()

    def __init__(self, log: Log) -> None:
        super().__init__()
        self.state = WindowState.DISCONNECTED
        self.fault: FaultNotice | None = None
        self.coil = CoilWatch()
        self._log = log

    def enter(self, state: WindowState) -> None:
        """Enter a state."""
        self.state = state
        self.changed.emit()

    def set_fault(self, title: str, consequence: str) -> None:
        """Something went wrong; a person must read it before anything goes on."""
        self.faulted.emit()
        self.fault = FaultNotice(unmarked(title), unmarked(consequence))
        self._log.add(Severity.ERROR, "safety", f"{title} {consequence}", safety=True)
        self.enter(WindowState.FAULT)

    def lose_engine(self, *, kept: bool = False) -> None:
        """The engine died over the coil; a guard, where there is one, switches it off.

        Args:
            kept: there are data of a run.
        """
        self.coil.left(UNKNOWN)
        data = "Data up to then are kept (Recover, in Runs). " if kept else ""
        self.set_fault(
            "The process that drives the instruments has ended.",
            f"{data}Look at the source: its guard switches it off, a simulated one is "
            "gone.",
        )
