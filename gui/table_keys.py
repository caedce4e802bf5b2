"""Which keys a table of whole rows leaves to the window: Qt searches by each letter."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent

ACROSS = frozenset(
    (
        Qt.Key.Key_Left,
        Qt.Key.Key_Right,
        Qt.Key.Key_Home,
        Qt.Key.Key_End,
        Qt.Key.Key_Backspace,
    )
)
"""Would move from cell to cell of a row that is chosen as a whole, or search."""


def is_the_windows(event: QKeyEvent) -> bool:
    """Whether a key in a table is a shortcut; up, down, pages and Enter are not."""
    return event.key() in ACROSS or (bool(event.text()) and event.text().isprintable())
