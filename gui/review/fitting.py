"""Has the steps so far fitted beside the window; the newest fit counts."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QObject, Signal

from gui.lanes.source import Source
from gui.session.finding import Finding
from gui.session.fit import Fit, FitInput, fit_input, fit_steps
from gui.session.session import Session
from tactile_lab.engine.engine import Reply


class Fitting(QObject):
    """One fit at a time is on its way to the results.

    Args:
        session: has the fits made; in a thread of this process, they would take more
            from the frames than their own time.
        parent: owner.
    """

    fitted = Signal(object)
    """The newest `Fit`; None where there is nothing to fit."""

    def __init__(self, session: Session, parent: QObject) -> None:
        super().__init__(parent)
        self._session = session
        self._serial = 0
        self._busy = False
        self._next: tuple[tuple[Finding, ...], FitInput] | None = None

    def ask(self, findings: Sequence[Finding], source: Source | None) -> None:
        """Fit `findings`, and compare `source` with the model beside it."""
        self._serial += 1
        if source is None or len(source.members) > 1:
            self._next = None
            self.fitted.emit(None)
            return
        self._next = tuple(findings), fit_input(source)
        self._go_on()

    def forget(self) -> None:
        """A fit that is on its way no longer counts."""
        self._serial += 1
        self._next = None

    def _go_on(self) -> None:
        """Have the newest fit made, unless one is on its way."""
        if self._busy or self._next is None:
            return
        (steps, seen), self._next = self._next, None
        self._busy = True
        serial = self._serial
        self._session.desk.ask(
            lambda reply: self._take(serial, reply), fit_steps, steps, seen
        )

    def _take(self, serial: int, reply: Reply[Fit]) -> None:
        self._busy = False
        if serial == self._serial:
            self.fitted.emit(reply.value)
        self._go_on()
