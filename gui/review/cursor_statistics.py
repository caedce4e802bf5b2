"""Has the samples between the cursors summed up for the lanes' cards."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QTimer

from gui.lanes.stack import LaneStack
from gui.session.session import Session
from tactile_lab.engine.engine import Reply
from tactile_lab.engine.jobs import statistics_of_run

if TYPE_CHECKING:
    from tactile_lab.store.statistics import SignalStatistics

STILL = 150
"""Milliseconds for which the cursors stand still before samples are read."""

Asked = tuple[object, float, float]


class CursorStatistics(QObject):
    """Asks the desk once the cursors stand still; what is late counts no more.

    Args:
        lanes: their cards show it.
        session: its desk reads samples, away from the window and from the bench.
    """

    def __init__(self, lanes: LaneStack, session: Session) -> None:
        super().__init__(lanes)
        self._lanes, self._session = lanes, session
        self._asked: Asked | None = None
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(STILL)
        self._timer.timeout.connect(self._ask)
        lanes.view.cursors_changed.connect(self._moved)
        lanes.source_changed.connect(self._moved)

    def _moved(self) -> None:
        self._asked = None
        self._lanes.show_statistics({})
        self._timer.start()

    def _ask(self) -> None:
        source, cursors = self._lanes.source, self._lanes.view.cursors
        if cursors is None or source.path is None or cursors[0] == cursors[1]:
            return
        start, end = sorted(cursors)
        self._asked = asked = (source, start, end)
        self._session.desk.ask(
            partial(self._arrived, asked), statistics_of_run, source.path, start, end
        )

    def _arrived(self, asked: Asked, reply: Reply[dict[str, SignalStatistics]]) -> None:
        if asked == self._asked and reply.value is not None:
            self._lanes.show_statistics(reply.value)
