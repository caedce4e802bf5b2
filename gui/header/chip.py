"""An instrument chip: lamp, name, limit, live value."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QHBoxLayout, QLabel, QSizePolicy, QVBoxLayout, QWidget

from gui.header.lamp import LampWidget
from gui.look import tokens as look
from gui.look.tokens import DARK
from gui.parts import label
from gui.state import InstrumentView, Lamp


class Chip(QWidget):
    """One instrument in the header; wide with its limit, compact without."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFixedHeight(44)
        self.setSizePolicy(QSizePolicy.Policy.Maximum, QSizePolicy.Policy.Fixed)
        self._bad = False
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
        self._compact = False

    @property
    def lamp(self) -> Lamp:
        """State of the lamp."""
        return self._lamp.lamp

    @property
    def value(self) -> QLabel:
        """The label that holds the live value."""
        return self._value

    def set_compact(self, compact: bool, narrow: bool) -> None:
        """Show lamp, short name and value only; where it is narrow, no name."""
        self._compact = compact
        self._detail.setVisible(not compact)
        self._name.setVisible(not narrow)

    def show_instrument(self, view: InstrumentView) -> None:
        """Show an instrument's state."""
        self._lamp.show_state(view.lamp)
        for where, text in (
            (self._name, view.short if self._compact else view.name),
            (self._detail, view.detail),
            (self._value, view.value),
        ):
            if where.text() != text:
                where.setText(text)
        self._detail.setVisible(bool(view.detail) and not self._compact)
        told = " · ".join(text for text in (view.detail, view.value) if text)
        self.setToolTip(f"{view.name}: {told}")
        self.setAccessibleName(f"{view.name}, {view.detail}, {view.value}")
        bad = view.lamp is Lamp.BAD
        if bad is not self._bad:
            self._bad = bad
            self.update()

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
