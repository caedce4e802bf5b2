"""Telling a key that is held down from one that is pressed again and again.

Its own file, for the keys of STOP and all others ask it.
"""

from __future__ import annotations

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent


class HeldKeys:
    """Has to be shown every press and release of the program, in their order.

    An X server repeats a held key by a release and a press of one and the same time. Qt
    says so only where it finds both at once in its queue; else it takes them for new.
    """

    def __init__(self) -> None:
        self._released: tuple[int, int] | None = None

    def is_held(self, event: QKeyEvent) -> bool:
        """Whether a press only says that its key is still down; False of a release."""
        key = int(Qt.Key(event.key()).value), event.timestamp()
        if event.type() == QEvent.Type.KeyRelease:
            self._released = key
            return False
        return event.isAutoRepeat() or (key == self._released and key[1] > 0)
