"""The whole run at a glance, with the visible window to drag."""

from __future__ import annotations

import time

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import (
    QColor,
    QFont,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPixmap,
    QWheelEvent,
)
from PySide6.QtWidgets import QWidget

from gui.lanes import paint
from gui.lanes.axis import numbers
from gui.lanes.card import CARD
from gui.lanes.ground import AXIS, GUTTER
from gui.lanes.paint import Frame
from gui.lanes.source import Source
from gui.lanes.view import TimeView
from gui.look.fonts import sized
from gui.look.theme import Theme

HEIGHT = 62

GROWS = 0.2
"""Seconds between pictures of a run in progress."""


class Navigator(QWidget):
    """Force outline and spike rate of the whole run; drag the window, wheel zooms."""

    def __init__(self, view: TimeView, theme: Theme) -> None:
        super().__init__()
        self.source = Source()
        self._view, self._theme = view, theme
        self._grabbed: tuple[str, float, float, float] | None = None
        self._run = QPixmap()
        self._run_of: tuple[object, ...] = ()
        self._run_until = 0.0
        self.setFixedHeight(HEIGHT)
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName("Whole run; arrow keys move the visible window")

    def frame(self) -> Frame:
        """The map from run time to pixels; forces 0 to 1."""
        length = max(self.source.length, 1e-3)
        return Frame(
            CARD + AXIS, self.width() - GUTTER, 6, HEIGHT - 20, 0.0, length, 0.0, 1.0
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw outline, rate, window and time."""
        self._keep_run()
        painter = QPainter(self)
        painter.drawPixmap(0, 0, self._run)
        frame = self.frame()
        painter.save()
        painter.setClipRect(frame.area.adjusted(-1, -4, 1, 4))
        self._window(painter, frame)
        painter.restore()
        if self.hasFocus():
            painter.setPen(QPen(QColor(self._theme.tokens.accent), 2))
            painter.drawRect(self.rect().adjusted(1, 1, -1, -1))

    def _keep_run(self) -> None:
        """Draw the run anew where it differs from the picture; growing, not always."""
        source, now = self.source, time.monotonic()
        grown = None if source.running else (source.reach, source.spikes.size)
        of = (source, grown, self.size(), self.devicePixelRatio(), self._theme.tokens)
        if of == self._run_of and not (source.running and now > self._run_until):
            return
        self._run_of, self._run_until = of, now + GROWS
        self._run = paint.canvas(self)
        painter = QPainter(self._run)
        self._paint_run(painter, self.frame())
        painter.end()

    def _paint_run(self, painter: QPainter, frame: Frame) -> None:
        tokens = self._theme.tokens
        painter.fillRect(self.rect(), QColor(tokens.sunken))
        painter.setPen(QColor(tokens.text))
        painter.setFont(sized(13, QFont.Weight.DemiBold))
        painter.drawText(12, 24, "Whole run")
        painter.setPen(QColor(tokens.muted))
        painter.setFont(sized(11))
        painter.drawText(12, 41, "drag · wheel zooms")
        painter.save()
        painter.setClipRect(frame.area.adjusted(-1, -4, 1, 4))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        self._force(painter, frame)
        self._rate(painter, frame)
        painter.restore()
        most = max(2, int((frame.right - frame.left) / 80))
        for value, words in numbers(0.0, frame.end, most):
            at = QPointF(frame.x1(value), frame.bottom + 11)
            paint.write(painter, at, words, tokens.muted, align=0.5)

    def _force(self, painter: QPainter, frame: Frame) -> None:
        tokens, source = self._theme.tokens, self.source
        count = max(50, int(frame.right - frame.left))
        measured = source.trace("force", 0.0, source.length, count)
        planned, force = source.planned(0.0, source.length)
        peak = max(
            [1e-12, *np.abs(force[:1]), float(np.abs(force).max(initial=0.0))]
            + ([] if measured.empty else [abs(v) for v in measured.extent or ()])
        )
        if force.size > 1:
            y = frame.y(np.abs(force) / peak)
            line = paint.pen(tokens.border_strong)
            paint.polyline(painter, frame.x(planned), y, line)
        if measured.empty:
            return
        shown = measured.scaled(1 / peak)
        paint.outline(painter, frame, shown, tokens.force, tokens.sunken)

    def _rate(self, painter: QPainter, frame: Frame) -> None:
        source = self.source
        rate = source.trace("rate", 0.0, source.length, 400)
        if rate.empty:
            return
        top = max(float(rate.high.max()), 1e-9) * 1.1
        x, y = frame.x(rate.time), frame.y(rate.high / top)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(self._theme.tokens.rate))
        points = zip(x.tolist(), y.tolist(), strict=True)
        painter.drawRects([QRectF(a - 1.2, b - 1.2, 2.4, 2.4) for a, b in points])

    def _window(self, painter: QPainter, frame: Frame) -> None:
        left = max(frame.x1(self._view.start), frame.left)
        right = min(frame.x1(self._view.end), frame.right)
        accent = QColor(self._theme.tokens.accent)
        soft = QColor(accent)
        soft.setAlpha(36)
        box = QRectF(left, 2, max(right - left, 3), frame.bottom)
        painter.fillRect(box, soft)
        painter.fillRect(QRectF(box.left(), 2, 2, frame.bottom), accent)
        painter.fillRect(QRectF(box.right() - 2, 2, 2, frame.bottom), accent)

    def _time(self, x: float) -> float:
        frame = self.frame()
        share = (x - frame.left) / max(1.0, frame.right - frame.left)
        return share * frame.end

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Grab an edge or the window; a click elsewhere moves the window there."""
        at, frame = event.position().x(), self.frame()
        left, right = frame.x1(self._view.start), frame.x1(self._view.end)
        part = "middle"
        if abs(at - left) <= 5:
            part = "left"
        elif abs(at - right) <= 5:
            part = "right"
        elif not left < at < right:
            width = self._view.width
            self._view.show_span(self._time(at) - width / 2, width)
        self._grabbed = (part, self._time(at), self._view.start, self._view.end)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag on."""
        if self._grabbed is None:
            return
        part, begin, start, end = self._grabbed
        moved = self._time(event.position().x()) - begin
        if part == "left":
            self._view.show_span(
                min(start + moved, end - 1e-3), 0.0 + end - start - moved
            )
        elif part == "right":
            self._view.show_span(start, max(end + moved - start, 1e-3))
        else:
            self._view.show_span(start + moved, end - start)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End of the drag."""
        self._grabbed = None

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom about the pointer."""
        turns = event.angleDelta().y() / 120
        self._view.zoom(1.25**turns, self._time(event.position().x()))
