"""STOP from anywhere: its buttons and its keys act whatever else is open.

It sees every key first, so it also keeps those that are held down from acting again.
"""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import (
    QDragEnterEvent,
    QGuiApplication,
    QKeyEvent,
    QKeySequence,
    QMouseEvent,
)
from PySide6.QtWidgets import (
    QAbstractItemView,
    QApplication,
    QDialog,
    QLineEdit,
    QWidget,
)

from gui.dialogs.closing import Closing
from gui.dialogs.overlay import Overlay
from gui.header.stop import StopButton
from gui.held_keys import HeldKeys
from gui.session.session import Session

STOP_KEYS = (Qt.Key.Key_F12, Qt.Key.Key_Escape)


class StopAnywhere(QObject):
    """Sees every key and click of the program before what is open takes it.

    - F12 is STOP.
    - Esc is STOP while anything drives the coil. In the question asked on closing it
      keeps running. Else it closes what is open, the uppermost first, or lets go of
      what is dragged; where nothing is open, it is STOP.
    - A key that acts once acts once, however long it is held down.
    - A press on a button STOP acts, also where it would only close a menu.
    - No dialog is modal, whoever opens it: Qt keeps from a covered window every click,
      and does so with its own questions within a file dialog, too.

    Args:
        window: the main one; cards cover it, menus and dialogs are its own.
        stops: every such button there is now; a window with one is not "open".
        closing: the question in which Esc is not STOP.
        session: is stopped.
        once: keys, as `QKeySequence` writes them, that act once while they are down.

    Attributes:
        keys: tells which are held down.
    """

    def __init__(
        self,
        window: QWidget,
        stops: Sequence[StopButton],
        closing: Closing,
        session: Session,
        once: frozenset[str],
    ) -> None:
        super().__init__(window)
        self.keys, self._once = HeldKeys(), once
        self._window, self._stops = window, stops
        self._closing, self._session = closing, session
        self._drags = False
        self._see_first()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Act, and keep the event from what is open; whether that was done."""
        # classes first: this sees every event there is, and a type costs more to ask
        if isinstance(watched, QDialog) and event.type() == QEvent.Type.Polish:
            watched.setWindowModality(Qt.WindowModality.NonModal)
            return False
        if isinstance(event, QKeyEvent):
            return self._take_key(watched, event)
        if isinstance(event, QMouseEvent):
            self._drags &= event.type() == QEvent.Type.MouseMove
            if self._meant_for_stop(event):
                return self._act("STOP in the window")
        elif isinstance(event, QDragEnterEvent):
            self._see_first()
        return False

    def _see_first(self) -> None:
        """Come before the filter with which Qt takes all keys while one drags."""
        self._drags = QGuiApplication.mouseButtons() != Qt.MouseButton.NoButton
        application = QApplication.instance()
        if application is not None:
            application.installEventFilter(self)

    def _take_key(self, watched: QObject, event: QKeyEvent) -> bool:
        held, stops = self.keys.is_held(event), event.key() in STOP_KEYS
        if held and (stops or _written(event) in self._once):
            event.accept()  # and so it is not asked for as a shortcut either
            return True  # what it first meant was done
        if event.type() == QEvent.Type.ShortcutOverride and self._is_ours(event):
            event.ignore()
            return True  # a field on X11 takes Ctrl+E, and means the end of its line
        if not stops or event.type() != QEvent.Type.KeyPress:
            return False
        if event.key() == Qt.Key.Key_F12:
            return self._act("STOP by F12")
        return self._escape(watched)

    def _is_ours(self, event: QKeyEvent) -> bool:
        """Whether a key with Ctrl is the window's, wherever the keyboard is."""
        held = event.modifiers() & Qt.KeyboardModifier.ControlModifier
        return bool(held) and _written(event) in self._once

    def _act(self, reason: str) -> bool:
        self._session.stop(reason)
        while (menu := QApplication.activePopupWidget()) is not None and menu.close():
            pass
        return True

    def _escape(self, watched: QObject) -> bool:
        if self._closing.isVisible():
            self._closing.keep.click()
            return True
        if not self._session.busy:
            window = _window_of(watched)
            mains = [stop.window() for stop in self._stops]
            if self._drags or QApplication.activePopupWidget() or window not in mains:
                return False  # Qt lets go of what is dragged, and closes what has keys
            if _edits_cell():
                return False  # which Qt ends; what else was typed in the card stays
            if left := self._open():
                left[-1].close()
                return True
        return self._act("STOP by Esc")

    def _open(self) -> list[QWidget]:
        """Cards and dialogs that need not have the keyboard, the uppermost last."""
        cards = self._window.findChildren(Overlay)
        beside = [w for w in QApplication.topLevelWidgets() if isinstance(w, QDialog)]
        return [one for one in (*cards, *beside) if one.isVisible()]

    def _meant_for_stop(self, event: QMouseEvent) -> bool:
        """Whether it presses STOP while a menu would take the press."""
        if event.type() != QEvent.Type.MouseButtonPress:
            return False
        left = event.button() == Qt.MouseButton.LeftButton
        if not left or QApplication.activePopupWidget() is None:
            return False
        at = event.globalPosition().toPoint()
        return any(s.rect().contains(s.mapFromGlobal(at)) for s in self._stops)


def _written(event: QKeyEvent) -> str:
    return QKeySequence(event.keyCombination()).toString()


def _window_of(watched: QObject) -> QWidget | None:
    """The window that a key is sent to: Qt sends it to that first, then to a widget.

    The active window need not be it: Qt lets that be while a menu is open, and does
    not make up for it after.
    """
    if isinstance(watched, QWidget):
        return watched.window()
    windows = QApplication.topLevelWidgets()
    return next((one for one in windows if one.windowHandle() == watched), None)


def _edits_cell() -> bool:
    """Whether the keyboard is in a cell of a table that is being typed into."""
    focus = QApplication.focusWidget()
    inside = focus.parentWidget() if isinstance(focus, QLineEdit) else None
    return inside is not None and isinstance(inside.parentWidget(), QAbstractItemView)
