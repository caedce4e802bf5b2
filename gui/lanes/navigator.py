"""The whole run at a glance, with the visible window to drag."""

from __future__ import annotations

from time import monotonic

import pyqtgraph as pg
from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import (
    QColor,
    QFocusEvent,
    QFont,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QResizeEvent,
    QWheelEvent,
)

from gui.lanes import paint
from gui.lanes.card import CARD
from gui.lanes.compare import MARKS
from gui.lanes.floor import AXIS, GUTTER
from gui.lanes.source import Source
from gui.lanes.view import TimeView
from gui.look.fonts import sized
from gui.look.theme import Theme
from gui.plots.axis import RoundAxis, stroke
from tactile_lab.trace import Trace

HEIGHT, FOOT = 62, 20
"""Of all, and of the numbers below, px."""

GROWS = 0.2
"""Seconds between pictures of a run in progress."""

RATES = 400
"""Columns of the rate."""


class Navigator(pg.GraphicsView):  # type: ignore[misc]
    """Force outline and spike rate of the whole run; drag the window, wheel zooms."""

    def __init__(self, view: TimeView, theme: Theme) -> None:
        super().__init__()
        self.source = Source()
        self._view, self._theme = view, theme
        self._run_of: tuple[object, ...] = ()
        self._run_until = 0.0
        self._shown: object = None
        self.setFixedHeight(HEIGHT)
        self.setCacheMode(pg.GraphicsView.CacheModeFlag.CacheNone)
        self.setAccessibleName("Whole run; arrow keys move the visible window")
        self._box = pg.ViewBox(enableMouse=False, enableMenu=False, defaultPadding=0)
        self._axis = RoundAxis("bottom", 80)
        self._axis.linkToView(self._box)
        self._plan, self._force = pg.PlotCurveItem(), pg.PlotCurveItem(fillLevel=0.0)
        self._others = [pg.PlotCurveItem() for _ in MARKS[1:]]
        self._rate = pg.ScatterPlotItem(size=3, symbol="s", pen=None)
        self.window_ = pg.LinearRegionItem()
        self.window_.sigRegionChanged.connect(self._dragged)
        traces = self._plan, self._force, *self._others
        for item in (*traces, self._rate, self.window_):
            self._box.addItem(item, ignoreBounds=True)
        title, hint = pg.TextItem("Whole run"), pg.TextItem("drag · wheel zooms")
        title.setFont(sized(13, QFont.Weight.DemiBold))
        hint.setFont(sized(11))
        title.setPos(8, 8)
        hint.setPos(8, 28)
        self._words = title, hint
        for item in (self._box, self._axis, title, hint):
            self.addItem(item)
        theme.changed.connect(self._tint)
        self._tint()

    def resizeEvent(self, event: QResizeEvent | None) -> None:
        """The run ends above the right end of the lanes."""
        super().resizeEvent(event)
        if event is not None:
            width = max(self.width() - GUTTER - CARD - AXIS, 20)
            self._box.setGeometry(QRectF(CARD + AXIS, 3, width, HEIGHT - FOOT - 3))
            self._axis.setGeometry(QRectF(CARD + AXIS, HEIGHT - FOOT, width, FOOT))
            self.refresh()

    def refresh(self) -> None:
        """Show the visible window, and the run anew where it has grown.

        A visible window that follows a run goes on as the run's picture grows.
        """
        source, view, now = self.source, self._view, monotonic()
        grown = None if source.running else (source.reach, source.spikes.size)
        shifts = tuple(run.shift for run in source.members)
        of = (source, grown, shifts, self.width())
        due = of != self._run_of or (source.running and now > self._run_until)
        if due:
            self._run_of, self._run_until = of, now + GROWS
            self._show_run()
        creeps = view.follow and source.running and source.reach > 0
        shown = view.width if creeps else (view.start, view.end)
        if due or shown != self._shown:
            self._shown = shown
            self.window_.blockSignals(True)
            self.window_.setRegion((view.start, view.end))
            self.window_.blockSignals(False)

    def _show_run(self) -> None:
        """Outline of the force, planned and measured, and the rate, each up to 1.

        Of several runs the force of each, in the colour of the run.
        """
        source, count = self.source, max(50, int(self._box.width()))
        runs = source.members
        forces = [
            one.source.trace("force", -one.shift, source.length - one.shift, count)
            for one in runs
        ]
        planned, force = source.planned(0.0, source.length)
        extents = [one.extent for one in forces if one.extent is not None]
        ends = [0.0, float(force.min(initial=0.0)), float(force.max(initial=0.0))]
        ends += [end for extent in extents for end in extent]
        peak = max(1e-12, *map(abs, ends))
        lowest = min(ends) / peak  # a pull is drawn below the push
        self._plan.setData(planned, force / peak)
        drawn = [
            one.scaled(1 / peak).shifted(run.shift)
            for one, run in zip(forces, runs, strict=True)
        ]
        for curve in self._others:
            curve.clear()
        for curve, one in zip((self._force, *self._others), drawn, strict=False):
            curve.setData(*paint.zigzag(one))
        rate = Trace.nothing()
        if len(runs) == 1:
            rate = source.trace("rate", 0.0, source.length, RATES)
        top = 1.1 * max(float(rate.high.max(initial=0.0)), 1e-9)
        self._rate.setData(rate.time, rate.high / top)
        self._box.setRange(
            xRange=(0.0, max(source.length, 1e-3)),
            yRange=(1.05 * lowest, 1.05),
            padding=0,
        )
        self._tint_force()

    def _tint_force(self) -> None:
        """Colour means the signal, or the run where there are several."""
        tokens, several = self._theme.tokens, len(self.source.members) > 1
        soft = QColor(tokens.force)
        soft.setAlpha(0 if several else 38)
        self._force.setBrush(soft)
        colours = tokens.runs if several else (tokens.force, *tokens.runs[1:])
        curves = (self._force, *self._others)
        for curve, colour in zip(curves, colours, strict=False):
            curve.setPen(stroke(colour))

    def _tint(self) -> None:
        tokens = self._theme.tokens
        self.setBackground(tokens.sunken)
        self._axis.tint(tokens)
        self._axis.setPen(tokens.sunken)
        self._plan.setPen(stroke(tokens.border_strong))
        self._tint_force()
        self._rate.setBrush(QColor(tokens.rate))
        inside = QColor(tokens.accent)
        inside.setAlpha(36)
        self.window_.setBrush(inside)
        self.window_.setHoverBrush(inside)
        for line in self.window_.lines:
            line.setPen(stroke(tokens.accent, 2))
            line.setHoverPen(stroke(tokens.accent, 3))
        for words, colour in zip(self._words, (tokens.text, tokens.muted), strict=True):
            words.setColor(colour)

    def _dragged(self) -> None:
        start, end = self.window_.getRegion()
        self._view.show_span(start, max(end - start, 1e-3))

    def drawForeground(self, painter: QPainter, rect: QRectF) -> None:
        """A frame while it has the keys."""
        if self.hasFocus():
            painter.setPen(stroke(self._theme.tokens.accent, 2))
            painter.drawRect(self.rect().adjusted(1, 1, -1, -1))

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Draw the frame."""
        super().focusInEvent(event)
        self.viewport().update()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Take the frame away."""
        super().focusOutEvent(event)
        self.viewport().update()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Keys are the window's."""
        event.ignore()

    def _time(self, x: float) -> float:
        share: float = (x - self._box.x()) / max(1.0, self._box.width())
        return share * max(self.source.length, 1e-3)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Grab an edge or the window; a click elsewhere moves the window there."""
        at, view = event.position().x(), self._view
        edges = (
            self._box.mapFromView(QPointF(t, 0)).x() for t in (view.start, view.end)
        )
        left, right = (self._box.x() + edge for edge in edges)
        if not left - 5 <= at <= right + 5:
            view.show_span(self._time(at) - view.width / 2, view.width)
        super().mousePressEvent(event)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom about the pointer."""
        turns = event.angleDelta().y() / 120
        self._view.zoom(1.25**turns, self._time(event.position().x()))
        event.accept()
