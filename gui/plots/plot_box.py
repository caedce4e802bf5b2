"""What the hand does in a small plot: drag, zoom, click, and a menu."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QGuiApplication

from gui.popup_menu import Menu


class Box(pg.ViewBox):  # type: ignore[misc]
    """Drags pan, Ctrl and the wheel zoom, a double click shows all again.

    Args:
        at: what is drawn at a place, as `Series.of` has it; -1 for nothing.

    Attributes:
        whole: (x range, y range) in which all is in view.
    """

    def __init__(self, at: Callable[[QPointF], int]) -> None:
        super().__init__(enableMenu=False)
        # a circle would leave the plot's end to Python's collector, in whatever thread
        self._at = weakref.WeakMethod(at)
        self.whole: list[list[float]] = [[0.0, 1.0], [0.0, 1.0]]

    @property
    def moved(self) -> bool:
        """Whether the user looks at a part."""
        return not np.allclose(self.viewRange(), self.whole)

    def show_all(self) -> None:
        """Back to where all is in view."""
        self.setRange(xRange=self.whole[0], yRange=self.whole[1], padding=0)

    def hoverEvent(self, event: Any) -> None:
        """Say what lies below, where a click would open it."""
        number = -1 if event.isExit() else self._number(event)
        shape = Qt.CursorShape
        self.setCursor(shape.PointingHandCursor if number >= 0 else shape.ArrowCursor)
        self.setToolTip(self.getViewWidget().tell(number) if number >= 0 else "")

    def _number(self, event: Any) -> int:
        at = self._at()
        return -1 if at is None else at(self.mapSceneToView(event.scenePos()))

    def mouseClickEvent(self, event: Any) -> None:
        """A click opens what lies below, a double one shows all, right is a menu."""
        if event.double():
            self.show_all()
        elif event.button() is Qt.MouseButton.LeftButton:
            number = self._number(event)
            if number >= 0:
                self.getViewWidget().picked.emit(number)
        elif event.button() is Qt.MouseButton.RightButton:
            view = self.getViewWidget()
            menu = Menu(view)
            menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
            menu.addAction("Show all", self.show_all)
            copy = QGuiApplication.clipboard().setPixmap
            menu.addAction("Copy picture", lambda: copy(view.grab()))
            menu.popup(event.screenPos().toPoint())
        event.accept()
