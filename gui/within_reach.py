"""Windows stay within reach where a screen goes, or becomes smaller."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QObject, QRect, QSize, Qt, QTimer
from PySide6.QtGui import QScreen
from PySide6.QtWidgets import QApplication, QWidget

SETTLE = 400
"""Time after a change of the screens until windows are looked at: the desktop moves
them first, ms."""

HIDDEN = 16
"""How much of a window's edge may lie outside: some desktops count its shadow, px."""

FRAME = QSize(8, 40)
"""Room for what the desktop draws around the window, px."""


class WithinReach(QObject):
    """Brings back every window of the program that the screens no longer hold.

    STOP is in a window's upper right corner: a screen that is unplugged must not take
    it along.
    """

    def __init__(self, application: QApplication) -> None:
        super().__init__(application)
        self._timer = QTimer(self, singleShot=True, interval=SETTLE)
        self._timer.timeout.connect(self._look)
        application.screenRemoved.connect(self._timer.start)
        application.screenAdded.connect(self._watch)
        for screen in application.screens():
            self._watch(screen)

    def _watch(self, screen: QScreen) -> None:
        screen.availableGeometryChanged.connect(self._timer.start)

    def _look(self) -> None:
        rooms = [screen.availableGeometry() for screen in QApplication.screens()]
        for window in QApplication.topLevelWidgets():
            if window.isVisible() and window.windowType() in (
                Qt.WindowType.Window,
                Qt.WindowType.Dialog,
            ):
                bring_back(window, rooms)


def fit(window: QWidget, available: QSize) -> None:
    """Make a window as small as the room on a screen, with its frame, needs it to be.

    Args:
        window: not yet shown.
        available: room on the screen, px as the window counts them.
    """
    window.resize(window.size().boundedTo(available - FRAME))


def bring_back(window: QWidget, rooms: Sequence[QRect]) -> None:
    """Move a window, and make it smaller, where a corner of it lies on no screen.

    Args:
        window: as it stands, with its frame.
        rooms: of the screens, the first is the main one.
    """
    frame = window.frameGeometry()
    seen = frame.adjusted(HIDDEN, HIDDEN, -HIDDEN, -HIDDEN)
    corners = seen.topLeft(), seen.topRight(), seen.bottomLeft(), seen.bottomRight()
    if not rooms or all(any(r.contains(c) for r in rooms) for c in corners):
        return
    room = max(rooms, key=lambda r: _area(r.intersected(frame)))
    state = window.windowState()
    if state & (Qt.WindowState.WindowMaximized | Qt.WindowState.WindowFullScreen):
        window.showNormal()
    around = frame.size() - window.size()
    window.resize(window.size().boundedTo(room.size() - around))
    frame.setSize(window.size() + around)
    left = min(max(frame.left(), room.left()), room.right() + 1 - frame.width())
    top = min(max(frame.top(), room.top()), room.bottom() + 1 - frame.height())
    window.move(max(left, room.left()), max(top, room.top()))
    window.setWindowState(state)


def framed(room: QRect, like: QWidget) -> QRect:
    """What a window fills in all of a room with a frame as that of another window."""
    whole, inner = like.frameGeometry(), like.geometry()
    return room.adjusted(
        inner.left() - whole.left(),
        inner.top() - whole.top(),
        inner.right() - whole.right(),
        inner.bottom() - whole.bottom(),
    )


def _area(rectangle: QRect) -> int:
    return max(rectangle.width(), 0) * max(rectangle.height(), 0)
