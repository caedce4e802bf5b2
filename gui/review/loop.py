"""The field against the current: the loop of a calibration."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from gui.lanes import paint
from gui.lanes.axis import decimals, nice_range, number, step_of, ticks
from gui.lanes.paint import Frame
from gui.look.fonts import sized
from gui.look.theme import Theme
from gui.look.tokens import Tokens
from tactile_lab.trace import FloatArray


class LoopPlot(QWidget):
    """Both branches of B2(I), and what they differ from a straight line.

    The loop is a few percent of the field: only the difference shows its shape.
    """

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self._loop: FloatArray = np.empty((0, 2))
        self.setMinimumHeight(190)
        self.setMaximumHeight(380)
        self.setAccessibleName("Field against current, and its loop")
        theme.changed.connect(self.update)

    def show_loop(self, loop: FloatArray) -> None:
        """Show readings, shape (n, 2): A and T."""
        self._loop = loop
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the field and, beside or below it, the loop."""
        current, field = self._loop[:, 0], self._loop[:, 1]
        if current.size < 2 or np.ptp(current) == 0:
            return
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setFont(sized(11))
        whole = QRectF(self.rect())
        one, other = QRectF(whole), QRectF(whole)
        if whole.width() > 2 * whole.height():
            one.setRight(whole.width() / 2 - 8)
            other.setLeft(whole.width() / 2 + 8)
        else:
            one.setBottom(whole.height() / 2 - 4)
            other.setTop(whole.height() / 2 + 4)
        self._draw(painter, one, field * 1e3, "field / mT", 0.1)
        if current.size > 2:
            straight = np.polyval(np.polyfit(current, field, 1), current)
            rest = (field - straight) * 1e6
            self._draw(painter, other, rest, "field less a straight line / µT", 1.0)

    def _draw(
        self,
        painter: QPainter,
        place: QRectF,
        field: FloatArray,
        name: str,
        least: float,
    ) -> None:
        """One plot against the current, with its newest point."""
        tokens, current = self._theme.tokens, self._loop[:, 0] * 1e3
        left, right = nice_range(float(current.min()), float(current.max()), 10.0)
        low, high = nice_range(float(field.min()), float(field.max()), least)
        frame = Frame(
            int(place.left()) + 48, int(place.right()) - 12, int(place.top()) + 24,
            int(place.bottom()) - 36, left, right, low, high,
        )  # fmt: skip
        axes(painter, frame, tokens, "coil current / mA", name, place.left())
        x, y = frame.x(current), frame.y(field)
        paint.polyline(painter, x, y, paint.pen(tokens.force))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(tokens.V_C1))
        painter.drawEllipse(QPointF(float(x[-1]), float(y[-1])), 4, 4)


def axes(
    painter: QPainter,
    frame: Frame,
    tokens: Tokens,
    x_name: str,
    y_name: str,
    edge: float = 0.0,
) -> None:
    """Grid, numbers and names of a plot whose numbers begin at `edge`, px."""
    places = decimals(step_of(frame.high - frame.low, 5))
    for value in ticks(frame.low, frame.high, 5):
        y = round(frame.y1(value)) + 0.5
        painter.setPen(paint.pen(tokens.grid))
        painter.drawLine(QPointF(frame.left, y), QPointF(frame.right, y))
        painter.setPen(QColor(tokens.muted))
        painter.drawText(
            QRectF(edge, y - 8, frame.left - 6 - edge, 16),
            Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter,
            number(value, places),
        )
    for value in ticks(frame.start, frame.end, 5):
        x = round(frame.x1(value)) + 0.5
        painter.setPen(paint.pen(tokens.grid))
        painter.drawLine(QPointF(x, frame.top), QPointF(x, frame.bottom))
        painter.setPen(QColor(tokens.muted))
        painter.drawText(
            QRectF(x - 30, frame.bottom + 3, 60, 15),
            Qt.AlignmentFlag.AlignHCenter,
            number(value, 0),
        )
    painter.drawText(
        QRectF(frame.left, frame.bottom + 18, frame.right - frame.left, 16),
        Qt.AlignmentFlag.AlignHCenter,
        x_name,
    )
    painter.drawText(
        QRectF(edge, frame.top - 22, 240, 16),
        Qt.AlignmentFlag.AlignLeft,
        y_name,
    )
