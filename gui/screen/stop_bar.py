"""The bar of a window beside the main one: what it shows, and a STOP of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtWidgets import QFrame

from gui.header.stop import StopButton
from gui.parts import Elided, bar

if TYPE_CHECKING:
    from gui.screen.panels import Panels


class StopBar(QFrame):
    """As high as the main window's header; its STOP has the same words.

    Args:
        panels: of the main window.
        title: of the window it stands in.

    Attributes:
        stop: one of the panels' until `leave`.
        title: can be set anew.
    """

    def __init__(self, panels: Panels, title: str = "") -> None:
        super().__init__()
        self.setProperty("role", "header")
        self.setFixedHeight(panels.header.height())
        self._panels = panels
        self.stop, self.title = StopButton(), Elided(title, "hidentity")
        self.stop.clicked.connect(lambda: panels.session.stop())
        panels.stops.append(self.stop)
        bar(self, (16, 0, 14, 0), 11, (self.title, 1), self.stop)

    def leave(self) -> None:
        """The window is closed: nobody sees this STOP any more."""
        self._panels.stops.remove(self.stop)
