"""Tool tips that are as wide as they can be read; Qt puts plain ones on one line."""

from __future__ import annotations

from html import escape

from PySide6.QtCore import QEvent, QObject, QRect
from PySide6.QtGui import QHelpEvent
from PySide6.QtWidgets import QApplication, QToolTip, QWidget

from gui.state import unmarked

LONGEST = 60
"""Characters of a line that is shown as it is."""


class ToolTips(QObject):
    """Shows the long ones of the whole program as paragraphs."""

    def __init__(self, application: QApplication) -> None:
        super().__init__(application)
        application.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Show a long plain text in lines of its own; whether that was done."""
        if not isinstance(event, QHelpEvent) or not isinstance(watched, QWidget):
            return False  # classes first: this sees every event there is
        text = unmarked(watched.toolTip())
        if event.type() != QEvent.Type.ToolTip or "<" in text:
            return False
        if all(len(line) <= LONGEST for line in text.splitlines()):
            return False
        QToolTip.showText(event.globalPos(), wrapped(text), watched, QRect())
        return True


def wrapped(text: str) -> str:
    """Plain text as paragraphs, which Qt breaks into lines."""
    return "".join(f"<p>{escape(line)}</p>" for line in text.splitlines() if line)
