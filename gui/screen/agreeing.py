"""Keeps the session told how well the model follows the run on screen."""

from __future__ import annotations

from PySide6.QtCore import QObject, QTimer

from gui.review.gathering import Gathering
from gui.session.agreement import Agreement
from gui.session.session import Session
from gui.state import State

EVERY = 2000
"""Milliseconds after which a run in progress is compared with the model anew."""


class Agreeing(QObject):
    """Has the results compare the run in progress also between two steps."""

    def __init__(self, session: Session, gathering: Gathering) -> None:
        super().__init__(gathering)
        self._session, self._gathering = session, gathering
        gathering.agreed.connect(self._take)
        timer = QTimer(self)
        timer.timeout.connect(self.compare)
        timer.start(EVERY)

    def compare(self) -> None:
        """Compare the run in progress, while the probes are on the circuit."""
        session = self._session
        live = session.state is State.RUNNING and session.source is not None
        if live and session.run.probes == "circuit":
            assert session.source is not None
            self._gathering.compare_with_model(session.source)

    def _take(self, agreement: Agreement | None) -> None:
        self._session.run.agreement = agreement
