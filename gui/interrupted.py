"""Keeps what is typed on, as a field goes away under it, from acting as single keys."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent, QMouseEvent
from PySide6.QtWidgets import (
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QLineEdit,
    QPlainTextEdit,
    QTextEdit,
    QWidget,
)

FIELDS = (QLineEdit, QPlainTextEdit, QTextEdit, QAbstractSpinBox, QComboBox)
"""What a person types into."""

ENDS = (Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Tab, Qt.Key.Key_Escape)
"""Keys with which one ends what one types."""

GONE = (
    "The field that was typed into has gone. So that no letter of it acts as a key, "
    "keys do nothing until Enter, Tab or a click."
)


class Interrupted(QObject):
    """A field went away while it had the keyboard; a person may not have seen it yet.

    Args:
        rest: what gets the keyboard then.
        say: tells why a key does nothing.
    """

    def __init__(self, rest: QWidget, say: Callable[[str], object]) -> None:
        super().__init__(rest)
        self._rest, self._say = rest, say
        self._on = self._told = False

    def mind(self) -> None:
        """Qt asks who gets the keyboard next: see whether a field has gone with it."""
        has = QApplication.focusWidget()
        gone = has is not None and not (has.isVisible() and has.isEnabled())
        application = QApplication.instance()
        if gone and isinstance(has, FIELDS) and application is not None:
            self._on = True
            application.installEventFilter(self)

    def takes(self, event: QKeyEvent) -> bool:
        """Whether a key was meant for the field that has gone, and is to do nothing."""
        if not self._on:
            return False
        if event.key() in ENDS:
            self.end()
        else:
            self._told = True
            self._say(GONE)
        return True

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """See a click, or the keyboard go elsewhere: what is typed next is meant so."""
        clicked = isinstance(event, QMouseEvent) and (
            event.type() == QEvent.Type.MouseButtonPress
        )
        if clicked or (watched is self._rest and event.type() == QEvent.Type.FocusOut):
            self.end()
        return False

    def end(self) -> None:
        """What is typed next is meant as keys."""
        if self._told:
            self._say("")
        self._on = self._told = False
        application = QApplication.instance()
        if application is not None:
            application.removeEventFilter(self)
