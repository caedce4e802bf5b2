"""The waveform of the next run at a glance, with a play-head while it runs."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPixmap
from PySide6.QtWidgets import QWidget

from gui.lanes import paint
from gui.lanes.axis import numbers
from gui.lanes.expected import Preview
from gui.lanes.paint import Frame
from gui.look.fonts import sized
from gui.look.theme import Theme
from tactile_lab.trace import Trace

HEIGHT = 118
LEFT, RIGHT = 38, 8
"""Margins of the plot, px."""

APART, LONGEST = 6, 6
"""Least space between two levels' names, px, and characters of the longest shown."""


class WaveformPreview(QWidget):
    """Force against time as it will be played, in mN and s."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self._preview: Preview | None = None
        self._problem = ""
        self._head: float | None = None
        self._drawn = QPixmap()
        self._drawn_of: tuple[object, ...] = ()
        self.setFixedHeight(HEIGHT)
        self.setAccessibleName("Force of the next run against time")
        theme.changed.connect(self.update)

    def show_preview(self, preview: Preview | None, problem: str = "") -> None:
        """Show a plan, or why there is none."""
        self._preview, self._problem = preview, problem
        self.setAccessibleDescription(problem)
        self.update()

    def show_head(self, time: float | None) -> None:
        """Put the play-head at run time `time` s; None takes it away."""
        if time != self._head:
            self._head = time
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the plan, and the play-head on it."""
        of = (self._preview, self._problem, self.size(), self._theme.tokens)
        if of != self._drawn_of:
            self._drawn_of, self._drawn = of, paint.canvas(self)
            drawing = QPainter(self._drawn)
            self._draw_plan(drawing)
            drawing.end()
        painter = QPainter(self)
        painter.drawPixmap(0, 0, self._drawn)
        preview = self._preview
        if preview and self._head is not None and 0 <= self._head <= preview.length:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            left, right = LEFT, self.width() - RIGHT
            at = left + (right - left) * self._head / max(preview.length, 1e-9)
            x = round(at) + 0.5
            painter.setPen(QPen(QColor(self._theme.tokens.text), 1.5))
            painter.drawLine(QPointF(x, 6), QPointF(x, HEIGHT - 20))

    def _draw_plan(self, painter: QPainter) -> None:
        tokens = self._theme.tokens
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(tokens.sunken))
        painter.drawRoundedRect(QRectF(self.rect()), 6, 6)
        painter.setFont(sized(11))
        if self._preview is None or self._preview.length <= 0:
            painter.setPen(QColor(tokens.muted))
            painter.drawText(
                self.rect().adjusted(12, 6, -12, -6),
                Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap,
                "" if self._problem else "computing the plan …",
            )
            return
        self._draw(painter, self._preview)

    def _draw(self, painter: QPainter, preview: Preview) -> None:
        tokens = self._theme.tokens
        force = preview.force.value * 1e3
        low, high = min(0.0, float(force.min())), max(float(force.max()), 0.0)
        if high - low < 1e-9:
            high = low + 1.0
        span = high - low
        low -= 0.12 * span if low < 0 else 0.0
        frame = Frame(
            LEFT, self.width() - RIGHT, 18, HEIGHT - 20, 0.0, preview.length, low, high
        )
        for value, text in numbers(low, high, 3):
            y = round(frame.y1(value)) + 0.5
            painter.setPen(paint.pen(tokens.grid))
            painter.drawLine(QPointF(frame.left, y), QPointF(frame.right, y))
            painter.setPen(QColor(tokens.muted))
            side = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
            painter.drawText(QRectF(0, y - 8, 32, 16), side, text)
        for value, text in numbers(0.0, preview.length, 6):
            place = QRectF(frame.x1(value) - 30, frame.bottom + 3, 60, 14)
            painter.drawText(place, Qt.AlignmentFlag.AlignHCenter, text)
        count = max(50, self.width())
        drawn = Trace.line(preview.force.time, force).thin(count)
        soft = QColor(tokens.force)
        soft.setAlpha(50)
        paint.fill(painter, frame, drawn, soft)
        paint.trace(painter, frame, drawn, paint.pen(tokens.force))
        self._names(painter, frame, preview, force)

    def _names(
        self, painter: QPainter, frame: Frame, preview: Preview, force: np.ndarray
    ) -> None:
        """The level beyond each hold, where there is room."""
        painter.setPen(QColor(self._theme.tokens.text))
        taken = -1e9
        for hold in preview.holds:
            start, end = hold.held or (hold.start, hold.end)
            inside = (preview.force.time >= start) & (preview.force.time <= end)
            if hold.pause or not inside.any():
                continue
            here, times = force[inside], preview.force.time[inside]
            most = float(np.max(np.abs(here)))
            far = np.abs(here) >= most - 1e-9
            text = hold.label.replace(" mN", "")
            width = painter.fontMetrics().horizontalAdvance(text)
            left = frame.x1(float(times[far].mean())) - width / 2
            left = min(max(left, frame.left), frame.right - width)
            if left < taken + APART or most == 0 or len(text) > LONGEST:
                continue
            taken = left + width
            below = float(here[far][0]) < 0
            y = frame.y1(-most) + 1 if below else frame.y1(most) - 15
            painter.drawText(QRectF(left, y, width + 1, 14), text)
