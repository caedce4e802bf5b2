"""A lamp that says its state by shape as well as by colour."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QWidget

from gui.look import tokens as look
from gui.state import Lamp

_COLOURS = {
    Lamp.ABSENT: look.LAMP_GREY,
    Lamp.WAITING: look.LAMP_AMBER,
    Lamp.GOOD: look.LAMP_GREEN,
    Lamp.ACTIVE: look.LAMP_BLUE,
    Lamp.WARNING: look.LAMP_AMBER,
    Lamp.BAD: look.LAMP_RED,
}
_WORDS = {
    Lamp.ABSENT: "not present",
    Lamp.WAITING: "connecting",
    Lamp.GOOD: "good",
    Lamp.ACTIVE: "active",
    Lamp.WARNING: "attention",
    Lamp.BAD: "fault",
}


class LampWidget(QWidget):
    """Ring with slash, open arc, check, halo or triangle, 18 x 18 px."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._lamp = Lamp.ABSENT
        self.setFixedSize(QSize(18, 18))

    @property
    def lamp(self) -> Lamp:
        """The state shown."""
        return self._lamp

    def show_state(self, lamp: Lamp) -> None:
        """Show `lamp`."""
        if lamp is not self._lamp:
            self._lamp = lamp
            self.update()
        self.setAccessibleName(f"Lamp: {_WORDS[lamp]}")

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the lamp."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        colour = QColor(_COLOURS[self._lamp])
        pen = QPen(colour, 1.8)
        pen.setCapStyle(Qt.PenCapStyle.RoundCap)
        ring = QRectF(3, 3, 12, 12)
        painter.setPen(pen)
        if self._lamp is Lamp.ABSENT:
            painter.drawEllipse(ring)
            painter.drawLine(QPointF(5, 13), QPointF(13, 5))
        elif self._lamp is Lamp.WAITING:
            painter.drawArc(ring, 20 * 16, 270 * 16)
        elif self._lamp is Lamp.GOOD:
            painter.setBrush(colour)
            painter.drawEllipse(ring)
            painter.setPen(QPen(QColor(look.HAZARD_BLACK), 2))
            painter.drawPolyline(
                QPolygonF([QPointF(6, 9.2), QPointF(8.2, 11.4), QPointF(12, 6.8)])
            )
        elif self._lamp is Lamp.ACTIVE:
            halo = QColor(colour)
            halo.setAlpha(70)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(halo)
            painter.drawEllipse(QRectF(1, 1, 16, 16))
            painter.setBrush(colour)
            painter.drawEllipse(QRectF(5, 5, 8, 8))
        else:
            self._triangle(painter, colour)

    def _triangle(self, painter: QPainter, colour: QColor) -> None:
        if self._lamp is Lamp.BAD:
            painter.setBrush(colour)
        painter.drawPolygon(
            QPolygonF([QPointF(9, 2.5), QPointF(16, 15.5), QPointF(2, 15.5)])
        )
        ink = look.HAZARD_BLACK if self._lamp is Lamp.BAD else colour.name()
        painter.setPen(QPen(QColor(ink), 1.8))
        painter.drawLine(QPointF(9, 7), QPointF(9, 11))
        painter.drawPoint(QPointF(9, 13.4))
