"""Peak and final rate of each step against its force, and the model's peak."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from gui.lanes import paint
from gui.lanes.axis import nice_range
from gui.lanes.paint import Frame
from gui.look.fonts import sized
from gui.look.theme import Theme
from gui.review.loop import axes


class RatePlot(QWidget):
    """Peak and final rate of each step against its force."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self._points: list[tuple[float, float, float]] = []
        self._model: tuple[tuple[float, float], ...] = ()
        self.setMinimumHeight(190)
        self.setMaximumHeight(300)
        self.setAccessibleName("Rate against force")
        theme.changed.connect(self.update)

    def show_points(self, points: list[tuple[float, float, float]]) -> None:
        """Show (force mN, peak rate Hz, final rate Hz) points."""
        if points != self._points:
            self._points, self._model = points, ()
            self.update()

    def show_model(self, model: tuple[tuple[float, float], ...]) -> None:
        """Show the model's (force N, peak rate Hz) beside them."""
        self._model = model
        self.update()

    @property
    def has_points(self) -> bool:
        """Whether there is anything to draw."""
        return bool(self._points)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw axes, both rates and their legend."""
        painter = QPainter(self)
        tokens = self._theme.tokens
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setFont(sized(11))
        silent = not any(peak or final for _, peak, final in self._points)
        if silent:
            painter.setPen(QColor(tokens.muted))
            text = (
                "No step has fired."
                if self._points
                else "No steps yet. Rate, onset, slope and adaptation\n"
                "are told here, step by step, as a run goes on."
            )
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, text)
            return
        rows = np.array(self._points)
        x_low, x_high = nice_range(min(0.0, rows[:, 0].min()), rows[:, 0].max(), 20.0)
        highest = max(float(rows[:, 1:].max()), *(rate for _, rate in self._model), 0.0)
        y_high = nice_range(0.0, highest, 2.0)[1]
        x_low = 0.0 if rows[:, 0].min() >= 0 else x_low
        frame = Frame(
            44, self.width() - 12, 24, self.height() - 36, x_low, x_high, 0.0, y_high
        )
        axes(painter, frame, tokens, "force / mN", "rate / Hz")
        if self._model:
            line = frame.x(np.array([1e3 * f for f, _ in sorted(self._model)]))
            high = frame.y(np.array([rate for _, rate in sorted(self._model)]))
            paint.polyline(painter, line, high, paint.pen(tokens.twin))
        order = np.argsort(rows[:, 0], kind="stable")
        x = frame.x(rows[order, 0])
        for column, mark, colour in ((1, _disc, tokens.rate), (2, _box, tokens.force)):
            y = frame.y(rows[order, column])
            paint.polyline(painter, x, y, paint.pen(colour))
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(colour))
            for a, b in zip(x.tolist(), y.tolist(), strict=True):
                mark(painter, a, b)
        self._legend(painter, frame.right)

    def _legend(self, painter: QPainter, right: float) -> None:
        """Marks and names above the plot, from its right edge."""
        tokens = self._theme.tokens
        entries: list[tuple[str, str, Mark]] = [
            ("peak", tokens.rate, _disc),
            ("final", tokens.force, _box),
        ]
        if self._model:
            entries.append(("model", tokens.twin, _dash))
        for name, colour, mark in reversed(entries):
            right -= painter.fontMetrics().horizontalAdvance(name)
            painter.setPen(QColor(tokens.text))
            painter.drawText(QRectF(right, 2, 80, 16), Qt.AlignmentFlag.AlignLeft, name)
            painter.setPen(paint.pen(colour))
            painter.setBrush(QColor(colour))
            right -= 13
            mark(painter, right, 10.0)
            right -= 17


Mark = Callable[[QPainter, float, float], None]


def _disc(painter: QPainter, x: float, y: float) -> None:
    painter.drawEllipse(QPointF(x, y), 3.8, 3.8)


def _box(painter: QPainter, x: float, y: float) -> None:
    painter.drawRect(QRectF(x - 3.3, y - 3.3, 6.6, 6.6))


def _dash(painter: QPainter, x: float, y: float) -> None:
    painter.drawLine(QPointF(x - 8, y), QPointF(x + 8, y))
