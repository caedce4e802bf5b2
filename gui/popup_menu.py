"""A menu in which the keyboard is never at a line that cannot be seen."""

from __future__ import annotations

from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QMenu


class Menu(QMenu):
    """Where it is higher than the screen, it scrolls to the line that keys choose.

    Qt does not for the first Up, which chooses the last line: Enter would have pressed
    *Quit* unseen.
    """

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Have what was chosen in sight."""
        super().keyPressEvent(event)
        chosen = self.activeAction()
        if chosen is not None and not self.rect().contains(self.actionGeometry(chosen)):
            self.setActiveAction(chosen)
