"""One lane on screen: its card with numbers, and its plot."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPoint, QSize, Qt, Signal
from PySide6.QtGui import QMouseEvent, QPainter, QPaintEvent, QPixmap, QWheelEvent
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from gui.lanes.axis import number
from gui.lanes.compare import Comparison
from gui.lanes.decimate import Drawn, FloatArray
from gui.lanes.derive import rate_at
from gui.lanes.ground import AXIS, GUTTER
from gui.lanes.lane import Kind, Lane
from gui.lanes.plot import LanePainter, Options
from gui.lanes.source import Source
from gui.lanes.view import TimeView
from gui.look.theme import Theme
from gui.parts import label

CARD = 164


class LanePlot(QWidget):
    """The painted plot; drags pan, the wheel zooms, cursors are grabbed."""

    box_zoomed = Signal(float, float)

    def __init__(
        self, lane: Lane, view: TimeView, options: Options, theme: Theme
    ) -> None:
        super().__init__()
        self.painter = LanePainter(lane, view, options)
        self.source: Source | None = None
        self.zoom_box = False
        self._view, self._theme = view, theme
        self._from: tuple[QPoint, float] | None = None
        self._to: QPoint | None = None
        self._cursor: int | None = None
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMinimumHeight(34)
        self.setMouseTracking(True)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.setAccessibleName(f"{lane.plain} against time")

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the lane and the zoom box."""
        if self.source is None:
            return
        painter = QPainter(self)
        self.painter.paint(painter, self.size(), self.source, self._theme.tokens)
        if self.zoom_box and self._from is not None and self._to is not None:
            painter.setPen(Qt.GlobalColor.gray)
            a, b = self._from[0].x(), self._to.x()
            painter.drawRect(min(a, b), 1, abs(b - a), self.height() - 3)

    def time_at(self, x: float) -> float:
        """Time under a pixel, s."""
        share = (x - AXIS) / max(1, self.width() - GUTTER - AXIS)
        return self._view.start + share * self._view.width

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom about the pointer; with Shift, pan."""
        turns = (event.angleDelta().y() or event.angleDelta().x()) / 120
        if event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
            self._view.pan(-0.1 * turns * self._view.width)
        else:
            self._view.zoom(1.25**turns, self.time_at(event.position().x()))
        event.accept()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Start to drag a cursor, the view or a zoom box."""
        if event.button() is not Qt.MouseButton.LeftButton:
            return
        at = event.position().toPoint()
        self._cursor = self._near_cursor(at.x())
        self._from = (at, self._view.start)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag on."""
        at = event.position().toPoint()
        if self._from is None:
            near = self._near_cursor(at.x()) is not None
            shape = Qt.CursorShape.SizeHorCursor if near else Qt.CursorShape.ArrowCursor
            self.setCursor(shape)
        elif self._cursor is not None:
            self._view.move_cursor(self._cursor, self.time_at(at.x()))
        elif self.zoom_box:
            self._to = at
            self.update()
        else:
            pixels = max(1, self.width() - GUTTER - AXIS)
            moved = (self._from[0].x() - at.x()) * self._view.width / pixels
            if abs(self._from[0].x() - at.x()) > 3:
                self._view.show_span(self._from[1] + moved, self._view.width)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End of the drag."""
        if self.zoom_box and self._from is not None and self._to is not None:
            a, b = self.time_at(self._from[0].x()), self.time_at(self._to.x())
            if abs(self._to.x() - self._from[0].x()) > 4:
                self.box_zoomed.emit(min(a, b), max(a, b))
        self._from = self._to = self._cursor = None
        self.update()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Show the whole run."""
        self._view.show_all()

    def _near_cursor(self, x: float) -> int | None:
        for number_, time in enumerate(self._view.cursors or ()):
            share = (time - self._view.start) / self._view.width
            at = AXIS + share * (self.width() - GUTTER - AXIS)
            if abs(at - x) <= 5:
                return number_
        return None


class LaneRow(QFrame):
    """Card and plot side by side."""

    hidden = Signal(str)

    def __init__(
        self, lane: Lane, view: TimeView, options: Options, theme: Theme
    ) -> None:
        super().__init__()
        self.lane = lane
        self.plot = LanePlot(lane, view, options, theme)
        self._view, self._theme = view, theme
        card = QFrame()
        card.setProperty("role", "lanecard")
        card.setFixedWidth(CARD)
        self._swatch = QLabel()
        self._swatch.setFixedSize(QSize(10, 10))
        flat = lane.kind in (Kind.RESIDUAL, Kind.RASTER)
        self._value = label("—", "flatvalue" if flat else "value")
        self._unit = label(lane.unit, "muted")
        self._at_cursors = label("", "small")
        self._at_cursors.hide()
        title = QHBoxLayout()
        title.setSpacing(7)
        title.addWidget(self._swatch)
        title.addWidget(label(lane.title, "strong"))
        title.addStretch(1)
        value = QHBoxLayout()
        value.setSpacing(5)
        (title if flat else value).addWidget(self._value)
        (title if flat else value).addWidget(self._unit)
        if not flat:
            value.addStretch(1)
        words = QVBoxLayout(card)
        words.setContentsMargins(12, 6, 10, 4)
        words.setSpacing(1)
        words.addLayout(title)
        words.addLayout(value)
        words.addWidget(self._at_cursors)
        words.addStretch(1)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(0)
        row.addWidget(card)
        row.addWidget(self.plot, 1)
        theme.changed.connect(self.tint)
        self.tint()

    def show_value(self, source: Source) -> None:
        """Update the live value."""
        text = self._text_of(self.value_of(source))
        if self._value.text() != text:
            self._value.setText(text)
            self._value.setAccessibleName(f"{self.lane.plain} {text} {self.lane.unit}")
        if self.lane.kind is Kind.RASTER and self._view.cursors is None:
            words = interval_text(source.spikes, source.reach)
            self._at_cursors.setVisible(bool(words) and self.height() >= 44)
            if self._at_cursors.text() != words:
                self._at_cursors.setText(words)

    def value_of(self, source: Source) -> float | None:
        """The newest value in shown units; None without data."""
        lane = self.lane
        if lane.kind is Kind.RASTER:
            return float(source.spikes.size)
        if lane.kind is Kind.RATE:
            spikes = source.spikes
            if spikes.size < 2:
                return None if spikes.size == 0 else 0.0
            return float(1 / max(spikes[-1] - spikes[-2], 1e-9))
        if lane.kind is Kind.RESIDUAL:
            return self.plot.painter.last
        if source.reach <= 0:
            return None
        drawn = source.trace(lane.signal, source.reach - 0.05, source.reach, 50)
        return None if drawn.empty else float(drawn.mean[-1]) * lane.scale

    def show_cursors(self, source: Source) -> None:
        """Values at A and B and their difference, as text."""
        cursors = self._view.cursors
        if cursors is None or self.height() < 66:
            self._at_cursors.setVisible(self.lane.kind is Kind.RASTER)
            return
        tokens = self._theme.tokens
        if self.lane.kind is Kind.RASTER:
            low, high = sorted(cursors)
            between = int(np.diff(np.searchsorted(source.spikes, [low, high]))[0])
            self._at_cursors.setText(f"{between} between A and B")
            self._at_cursors.show()
            return
        a, b = (self.value_at(source, time) for time in cursors)
        change = None if a is None or b is None else b - a
        places = min(self.lane.places, 2)
        delta = "—" if change is None else f"{'+' if change >= 0 else ''}"
        delta = delta if change is None else delta + number(change, places)
        words = [
            f'<span style="color:{colour};font-weight:600">{name}</span> '
            f"{'—' if value is None else number(value, places)}"
            for name, value, colour in (
                ("A", a, tokens.accent),
                ("B", b, tokens.V_C1),
            )
        ]
        self._at_cursors.setText(f"{' &nbsp;'.join(words)} &nbsp;Δ {delta}")
        self._at_cursors.show()

    def value_at(self, source: Source, time: float) -> float | None:
        """Value at a time in shown units; None outside the data."""
        lane = self.lane
        if lane.kind is Kind.RATE:
            return rate_at(source.spikes, time) if time <= source.reach else None
        elif lane.kind is Kind.RESIDUAL:
            one = _at(source.trace(lane.signal, time - 0.02, time + 0.02, 100), time)
            two = _at(source.twin(lane.signal, time - 0.02, time + 0.02, 100), time)
            return None if one is None or two is None else (one - two) * lane.scale
        else:
            drawn = source.trace(lane.signal, time - 0.02, time + 0.02, 100)
        value = _at(drawn, time)
        return None if value is None else value * lane.scale

    def _text_of(self, value: float | None) -> str:
        if value is None:
            return "—"
        sign = "+" if self.lane.kind is Kind.RESIDUAL and value > 0.5 else ""
        return sign + number(value, self.lane.places)

    def tint(self) -> None:
        """Colour the swatch as theme and source want it."""
        kind = self.lane.kind
        name = "residual" if kind is Kind.RESIDUAL else self.lane.signal
        picture = QPixmap(20, 20)
        tokens = self._theme.tokens
        # in a comparison colour means run, so the lane's own colour steps back
        grey = isinstance(self.plot.source, Comparison)
        picture.fill(tokens.border_strong if grey else tokens.trace(name))
        picture.setDevicePixelRatio(2)
        self._swatch.setPixmap(picture)
        self.plot.update()


def interval_text(spikes: FloatArray, now: float) -> str:
    """The last interval and, where it has been silent for longer, since when."""
    if spikes.size < 2:
        return ""
    last = float(spikes[-1] - spikes[-2])
    words = f"ISI {number(1e3 * last, 1)} ms"
    silent = now - float(spikes[-1])
    return f"{words} · silent {silent:.1f} s" if silent > 2 * last else words


def _at(drawn: Drawn, time: float) -> float | None:
    if drawn.empty or not drawn.time[0] <= time <= drawn.time[-1] + 0.02:
        return None
    return float(np.interp(time, drawn.time, drawn.mean))
