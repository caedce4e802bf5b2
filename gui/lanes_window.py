"""The lanes in a window of their own, such as on a second screen."""

from __future__ import annotations

from PySide6.QtCore import QByteArray, Qt, Signal
from PySide6.QtGui import (
    QCloseEvent,
    QDragEnterEvent,
    QDropEvent,
    QGuiApplication,
    QKeyEvent,
)
from PySide6.QtWidgets import QWidget

from gui.actions import Actions
from gui.parts import column
from gui.screen.panels import Panels
from gui.screen.stop_bar import StopBar
from gui.tab_order import move_on
from gui.within_reach import framed

LEAST = 640, 420
"""Width and height, px: STOP and a few lanes."""


class LanesWindow(QWidget):
    """The lanes, and a STOP of its own; closing it puts the lanes back.

    They are the same widgets with the same view, cursors and ranges, and all keys of
    the main window act here, too.

    Args:
        window: the main window, whose lanes they are.
        panels: of it.
        actions: its keys.
        geometry: as `saveGeometry` gave it; None for the other screen, if there is one.
    """

    closed = Signal()

    def __init__(
        self,
        window: QWidget,
        panels: Panels,
        actions: Actions,
        geometry: QByteArray | None = None,
    ) -> None:
        super().__init__()
        self._window, self._panels, self._actions = window, panels, actions
        self.setMinimumSize(*LEAST)
        self.setAcceptDrops(True)
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        panels.theme.dress(self)
        self._head = StopBar(panels)
        self.stop, centre = self._head.stop, panels.centre
        self._splitter = centre.splitter.saveState()
        column(self, self._head, (centre.lanes, 1), spacing=0)
        actions.bind(self)
        window.windowTitleChanged.connect(self._name)
        self._name(window.windowTitle())
        self._place(geometry)
        self.setFocus()  # not STOP, which Space would press

    def _place(self, geometry: QByteArray | None) -> None:
        """Where it was; else all of another screen; else over the main window."""
        self.resize(self._window.size() * 0.8)
        if geometry is not None and self.restoreGeometry(geometry):
            return
        here = self._window.screen()
        others = [one for one in QGuiApplication.screens() if one is not here]
        if others:
            self.setGeometry(framed(others[0].availableGeometry(), self._window))

    def _name(self, title: str) -> None:
        self.setWindowTitle(f"Lanes · {title}")
        self._head.title.set_whole(self.windowTitle())

    def closeEvent(self, event: QCloseEvent) -> None:
        """Put the lanes back where they were."""
        panels = self._panels
        self._head.leave()
        panels.centre.splitter.insertWidget(0, panels.centre.lanes)
        panels.centre.splitter.restoreState(self._splitter)
        self.closed.emit()
        event.accept()

    def focusNextPrevChild(self, forward: bool) -> bool:
        """Tab goes as one reads."""
        return move_on([self], self, forward=forward)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Take the single-key shortcuts."""
        if not self._actions.take_key(event):
            super().keyPressEvent(event)

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """Take scenes and runs."""
        self._window.dragEnterEvent(event)

    def dropEvent(self, event: QDropEvent) -> None:
        """Open what was dropped."""
        self._window.dropEvent(event)
