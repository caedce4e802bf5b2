"""An instrument chip: lamp, name, limit, live value."""

from __future__ import annotations

from enum import IntEnum

from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QHBoxLayout, QLabel, QSizePolicy, QVBoxLayout, QWidget

from gui.header.lamp import LampWidget
from gui.look import tokens as look
from gui.look.tokens import DARK
from gui.parts import label
from gui.state import InstrumentView, Lamp


class Room(IntEnum):
    """How much of each chip is shown."""

    FULL = 0
    """Lamp, name, detail, value."""
    SHORT = 1
    """Lamp, short name, value."""
    BARE = 2
    """Lamp and value."""


class Chip(QWidget):
    """One instrument in the header.

    It grows with its value and does not shrink again: what stands beside it keeps its
    place while numbers change.
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFixedHeight(44)
        self.setSizePolicy(QSizePolicy.Policy.Maximum, QSizePolicy.Policy.Fixed)
        self._bad = False
        self._view = InstrumentView("", Lamp.ABSENT)
        self._lamp = LampWidget(self)
        self._name = label("", "hname")
        self._detail = label("", "hsub")
        self._value = label("—", "hvalue")
        words = QVBoxLayout()
        words.setSpacing(0)
        words.addWidget(self._name)
        words.addWidget(self._detail)
        row = QHBoxLayout(self)
        row.setContentsMargins(10, 4, 11, 4)
        row.setSpacing(9)
        row.addWidget(self._lamp)
        row.addLayout(words)
        row.addSpacing(6)
        row.addWidget(self._value)
        self._room = Room.FULL

    @property
    def lamp(self) -> Lamp:
        """State of the lamp."""
        return self._lamp.lamp

    @property
    def value(self) -> QLabel:
        """The label that holds the live value."""
        return self._value

    def show_room(self, room: Room) -> None:
        """Show as much as there is room for."""
        self._room = room
        self._arrange()

    def forget_width(self) -> None:
        """Let it shrink again."""
        self._value.setMinimumWidth(0)

    def show_instrument(self, view: InstrumentView) -> bool:
        """Show an instrument's state; whether the chip has become wider by it."""
        before = self._view
        if view == before:
            return False
        self._view = view
        self._lamp.show_state(view.lamp)
        if view.detail != before.detail:  # other values follow, such as a verdict
            self.forget_width()
        self._value.setText(view.value)
        self._arrange()
        told = " · ".join(text for text in (view.detail, view.value) if text)
        self.setToolTip(f"{view.name}: {told}")
        self.setAccessibleName(f"{view.name}, {view.detail}, {view.value}")
        bad = view.lamp is Lamp.BAD
        if bad is not self._bad:
            self._bad = bad
            self.update()
        needed = self._value.sizeHint().width()
        grown = needed > self._value.minimumWidth()
        if grown:
            self._value.setMinimumWidth(needed)
        return grown or view.name != before.name

    def _arrange(self) -> None:
        view, room = self._view, self._room
        self._name.setText(view.name if room is Room.FULL else view.short)
        self._name.setVisible(room is not Room.BARE)
        self._detail.setText(view.detail)
        self._detail.setVisible(bool(view.detail) and room is Room.FULL)
        layout = self.layout()
        assert layout is not None
        layout.invalidate()
        layout.activate()  # its size is asked for at once
        self.updateGeometry()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the chip's body."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        body = QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5)
        edge = look.LAMP_RED if self._bad else DARK.header_border
        painter.setPen(QPen(QColor(edge), 1))
        painter.setBrush(QColor("#3A1720" if self._bad else DARK.header_chip))
        painter.drawRoundedRect(body, 7, 7)
        if self._bad:
            painter.drawLine(QPointF(body.left() + 1, 8), QPointF(body.left() + 1, 36))
