"""A problem in words above what it is of."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QLabel, QSizePolicy

from gui.state import unmarked

LINES = 3
"""Of a long message, as of a file of another kind; more would leave lanes no room."""


class Notice(QLabel):
    """Wrapped; a word too long for a line, as a path, is shortened in its middle.

    So is a message of many lines at its end. The tool tip then has the whole.
    """

    def __init__(self) -> None:
        super().__init__()
        self.setProperty("role", "muted")
        self.setWordWrap(True)
        self.setContentsMargins(14, 6, 14, 6)
        policy = self.sizePolicy()
        policy.setHorizontalPolicy(QSizePolicy.Policy.Ignored)  # of a long word's width
        self.setSizePolicy(policy)
        self._whole = ""
        self.hide()

    def say(self, text: str) -> None:
        """Say something; "" takes it away."""
        self._whole = unmarked(text)
        self._shorten()
        self.setVisible(bool(text))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Shorten anew."""
        super().resizeEvent(event)
        self._shorten()

    def _shorten(self) -> None:
        metrics, room = self.fontMetrics(), self.contentsRect().width()
        middle = Qt.TextElideMode.ElideMiddle
        lines = self._whole.split("\n")
        if len(lines) > LINES:
            more = len(lines) - LINES + 1
            lines[LINES - 1 :] = [f"… {more} more lines in the log."]
        words = "\n".join(lines).split(" ")
        shown = " ".join(metrics.elidedText(word, middle, room) for word in words)
        self.setText(shown)
        self.setToolTip("" if shown == self._whole else self._whole)
