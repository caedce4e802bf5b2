"""Has the steps so far fitted away from the window's thread; the newest fit counts."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QObject, Signal

from gui.lanes.compare import Comparison
from gui.lanes.source import Source
from gui.review.finding import Finding
from gui.review.fit import Fit, beside, fit
from gui.session.threads import start


class Fitting(QObject):
    """One fit at a time is on its way to the results."""

    fitted = Signal(object)
    """The newest `Fit`; None where there is nothing to fit."""
    _done = Signal(int, object)

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._serial = 0
        self._done.connect(self._take)

    def ask(self, findings: Sequence[Finding], source: Source | None) -> None:
        """Fit `findings`, and compare `source` with the model beside it."""
        self._serial += 1
        if source is None or isinstance(source, Comparison):
            self.fitted.emit(None)
            return
        serial, steps, seen = self._serial, list(findings), beside(source)
        start(lambda: self._done.emit(serial, fit(steps, seen)), "fit")

    def forget(self) -> None:
        """A fit that is on its way no longer counts."""
        self._serial += 1

    def _take(self, serial: int, found: Fit) -> None:
        if serial == self._serial:
            self.fitted.emit(found)
