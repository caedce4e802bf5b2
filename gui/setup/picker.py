"""Choosing a protocol by name."""

from __future__ import annotations

import inspect

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtGui import QPaintEvent
from PySide6.QtWidgets import (
    QStyle,
    QStyleOptionComboBox,
    QStylePainter,
)

from gui.parts import Combo
from gui.state import unmarked
from tactile_lab.plugins import protocol_class, protocol_names, scene_names
from tactile_lab.trial import Protocol

TURN = 20
"""Milliseconds between two titles that are looked up."""


class Picker(Combo):
    """All protocols, and the one in the form where that is of the user's own."""

    picked = Signal(str)
    """The scene to open: the protocol's ready one, else the file that defines it."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Protocol")
        self.setMaxVisibleItems(20)
        self._untitled: list[str] = []
        self._idle = QTimer(self)
        self._idle.timeout.connect(self._title_next)
        self.activated.connect(
            lambda number: self.picked.emit(scene_of(str(self.itemData(number))))
        )

    def show_protocol(self, shown: type[Protocol]) -> None:
        """Show which protocol is in the form."""
        names = list(protocol_names())
        if shown.name not in names:
            names.append(shown.name)
        if [self.itemData(i) for i in range(self.count())] != names:
            self.clear()
            for name in names:
                self.addItem(name, name)
            self._untitled = [name for name in names if name != shown.name]
            self._idle.start(TURN)
        at = names.index(shown.name)
        self.setItemText(at, shown.title)
        self.setCurrentIndex(at)
        self.setToolTip(f"{shown.title}\n{about(shown)}")

    def showPopup(self) -> None:
        """Open the list, with all titles."""
        while self._untitled:
            self._title_next()
        super().showPopup()

    def _title_next(self) -> None:
        """Import one more protocol for its title: all at once would delay the start."""
        if not self._untitled:
            self._idle.stop()
            return
        name = self._untitled.pop(0)
        self.setItemText(self.findData(name), protocol_class(name).title)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the name, shortened to the room it has."""
        option = QStyleOptionComboBox()
        self.initStyleOption(option)
        style, field = self.style(), QStyle.SubControl.SC_ComboBoxEditField
        control = QStyle.ComplexControl.CC_ComboBox
        room = style.subControlRect(control, option, field, self).width()
        way = Qt.TextElideMode.ElideRight
        option.currentText = self.fontMetrics().elidedText(
            self.currentText(), way, room
        )
        painter = QStylePainter(self)
        painter.drawComplexControl(control, option)
        painter.drawControl(QStyle.ControlElement.CE_ComboBoxLabel, option)


def scene_of(protocol: str) -> str:
    """Name of a protocol's ready scene, else path of the file that defines it."""
    if protocol in scene_names():
        return protocol
    return inspect.getfile(protocol_class(protocol))


def about(kind: type[Protocol]) -> str:
    """The first paragraph of a protocol's description, in one line."""
    first = (kind.__doc__ or "").strip().split("\n\n")[0]
    return " ".join(unmarked(first).split())
