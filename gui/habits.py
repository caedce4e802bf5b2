"""What the program does by itself because its user prefers it."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QObject, QTimer
from PySide6.QtWidgets import QApplication

from gui.lanes.stack import LaneStack
from gui.preferences import Preferences, from_anywhere
from gui.screen.screen import Screen
from gui.session.session import Session
from gui.state import CoilKnowledge, Snapshot, WindowState, stop_truth

APART = 400
"""Time between two of the sounds of a fault, ms."""


class Habits(QObject):
    """Sounds, watching the sensor, recent scenes, where runs are kept, the lanes."""

    def __init__(
        self,
        session: Session,
        preferences: Preferences,
        screen: Screen,
        lanes: LaneStack,
    ) -> None:
        super().__init__(screen)
        self._session, self._wishes, self._screen = session, preferences, screen
        self._rings, self._unknown = 0, False
        self._bell = QTimer(self, singleShot=True)
        self._bell.timeout.connect(self._ring)
        session.run.ended.connect(lambda done: self._sound(1))
        session.status.faulted.connect(lambda: self._sound(3))
        session.bench.ready.connect(self._watch)
        screen.scene_opened.connect(self._remember)
        preferences.changed.connect(self.follow)
        lanes.arrangement.restore(preferences.lanes)
        lanes.arranged.connect(lambda: preferences.keep(lanes=lanes.arrangement.text))

    def follow(self) -> None:
        """The preferences have changed."""
        run, wishes = self._session.run, self._wishes
        run.reports, run.publish = wishes.wants("reports"), wishes.wants("lsl")
        self._session.keep_in(self._wishes.folder)
        self._screen.list_runs()

    def mind_coil(self, snapshot: Snapshot) -> None:
        """Ring as at a fault where nobody knows the coil any more: a run ends later."""
        coil, left = snapshot.coil, snapshot.left_unknown
        said = stop_truth(snapshot.state, coil, left) is CoilKnowledge.UNKNOWN
        if said and not self._unknown and snapshot.state is not WindowState.FAULT:
            self._sound(3)
        self._unknown = said

    def _sound(self, times: int) -> None:
        """Ring in a turn of its own: a run that a fault ends is no end beside it."""
        if self._wishes.wants("sound"):
            self._rings = max(self._rings, times)
            if not self._bell.isActive():
                self._bell.start(0)

    def _ring(self) -> None:
        QApplication.beep()
        self._rings -= 1
        if self._rings:
            self._bell.start(APART)

    def _watch(self) -> None:
        last = self._session.bench.choice
        self._wishes.keep(last_bench=from_anywhere(last) if last else "")
        if self._wishes.wants("monitor") and not self._session.queue.going:
            self._session.show_monitor(True)

    def _remember(self, scene: str) -> None:
        if Path(scene).is_file():
            self._wishes.remember(scene)
