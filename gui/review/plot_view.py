"""Paints the plots that `tactile_lab.plot` describes, live ones and protocols' own."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPolygonF, QStaticText
from PySide6.QtWidgets import QWidget

from gui.lanes import paint
from gui.lanes.axis import nice_range, numbers
from gui.lanes.paint import Frame
from gui.look.fonts import sized
from gui.look.theme import Theme
from gui.look.tokens import Tokens
from tactile_lab.plot import Guide, Panel, Plot, Series, y_scale

FloatArray = NDArray[np.float64]

PANEL, SMALL = 200, 130
"""Height of a panel, and of one that is low in the report, px."""
LEFT, RIGHT, TOP, FOOT = 48, 12, 24, 36
LINE, MARK = 16, 30
"""Height of a second line above a panel, and room of a mark in a legend, px."""
SIZE = 3.8
"""Half a point, px."""


class PlotView(QWidget):
    """One plot; its panels stand above one another.

    Attributes:
        plot: shown now, or None.
        nothing: what stands where there is none.
    """

    def __init__(self, theme: Theme, nothing: str = "") -> None:
        super().__init__()
        self._theme, self.nothing = theme, nothing
        self.plot: Plot | None = None
        self.setMinimumHeight(PANEL)
        theme.changed.connect(self.update)

    def show_plot(self, plot: Plot | None) -> None:
        """Show a plot, or nothing."""
        self.plot = plot
        if plot is not None:
            shown = plot.title or ", ".join(panel.label for panel in plot.panels)
            self.setAccessibleName(f"{shown} against {plot.x_label}")
            self.setToolTip(plot.caption)
            self.setMinimumHeight(sum(self._heights(plot)))
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw all panels, or say why there are none."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setFont(sized(11))
        if self.plot is None:
            painter.setPen(QColor(self._theme.tokens.muted))
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, self.nothing)
            return
        heights = self._heights(self.plot)
        room, top = self.height() / sum(heights), 0.0
        for panel, height in zip(self.plot.panels, heights, strict=True):
            last = panel is self.plot.panels[-1] or self.plot.beside
            place = QRectF(0, top, self.width(), room * height)
            _Drawing(painter, self._theme.tokens, self.plot, panel, place, last).draw()
            top += room * height

    @staticmethod
    def _heights(plot: Plot) -> list[int]:
        """Of the panels, px; those with numbers along x are higher."""
        high = [PANEL if panel.height > 1.7 else SMALL for panel in plot.panels]
        last = len(high) - 1
        return [h + FOOT * (plot.beside or i == last) for i, h in enumerate(high)]


class _Drawing:
    """One panel onto a painter."""

    def __init__(
        self,
        painter: QPainter,
        tokens: Tokens,
        plot: Plot,
        panel: Panel,
        place: QRectF,
        last: bool,
    ) -> None:
        self._painter, self._tokens, self._last = painter, tokens, last
        self._plot, self._panel = plot, panel
        self._x_by, self._x_text = plot.x_scale()
        self._y_by, self._y_text = y_scale(panel)
        panels = (panel,) if plot.beside else plot.panels
        across = [self._x(s.x) for p in panels for s in p.series]
        across += [self._x(e) for g in panel.guides if g.along == "y" for e in _ends(g)]
        if plot.x_limits is not None:
            across = [self._x(plot.x_limits)]
        start, end = _range(across, plot.whole)
        if plot.x_limits is not None:
            start, end = self._x(plot.x_limits).tolist()
        upright = [
            self._y(v)
            for s in panel.series
            for v in (s.y, s.low, s.high)
            if v is not None and s.mark != "ticks"
        ]
        guides = (g for g in panel.guides if g.along == "x")
        upright += [self._y(e) for g in guides for e in _ends(g)]
        low, high = _range(upright, False)
        for at, limit in enumerate(panel.limits):
            if limit is not None:
                edge = float(self._y(limit))
                low, high = (edge, high) if at == 0 else (low, edge)
        foot = FOOT if last else 8
        self._corner = place.topLeft() + QPointF(2, 2)
        self._named = [s for s in panel.series if s.name]
        legend = sum(_rich(s.name).size().width() + MARK for s in self._named)
        beside = _rich(self._y_text).size().width() + legend < place.width() - RIGHT
        self.frame = Frame(
            place.left() + LEFT, place.right() - RIGHT,
            place.top() + TOP + (0 if beside else LINE),
            place.bottom() - foot, float(start), float(end), float(low), float(high),
        )  # fmt: skip

    def draw(self) -> None:
        """Axes, guides, series, legend."""
        self._axes(self._last)
        area, painter = self.frame.area, self._painter
        painter.save()
        painter.setClipRect(area.adjusted(-SIZE, -SIZE, SIZE, SIZE))
        for guide in self._panel.guides:
            self._guide(guide)
        for series in self._panel.series:
            self._series(series)
        painter.restore()
        if self._panel.text:
            painter.setPen(QColor(self._tokens.text))
            side = Qt.AlignmentFlag.AlignRight
            up = self._panel.corner == "upper"
            side |= Qt.AlignmentFlag.AlignTop if up else Qt.AlignmentFlag.AlignBottom
            painter.drawText(area.adjusted(0, 2, -2, -2), side, self._panel.text)
        self._legend()

    def _x(self, values: ArrayLike) -> FloatArray:
        shown = np.asarray(values, dtype=np.float64) * self._x_by
        return np.log10(shown) if self._plot.x_log else shown

    def _y(self, values: ArrayLike) -> FloatArray:
        shown = np.asarray(values, dtype=np.float64) * self._y_by
        if not self._panel.log:
            return shown
        return np.log10(np.where(shown > 0, shown, np.nan))

    def _axes(self, last: bool) -> None:
        frame, tokens, painter = self.frame, self._tokens, self._painter
        for at, text in _numbers(frame.low, frame.high, self._panel.log):
            y = round(frame.y1(at)) + 0.5
            painter.setPen(paint.pen(tokens.grid))
            painter.drawLine(QPointF(frame.left, y), QPointF(frame.right, y))
            painter.setPen(QColor(tokens.muted))
            side = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
            left = frame.left - LEFT
            painter.drawText(QRectF(left, y - 8, LEFT - 6, 16), side, text)
        named = [
            (float(self._x(x)), f"{x * self._x_by:.3g}") for x in self._plot.x_ticks
        ]
        for at, text in named or _numbers(frame.start, frame.end, self._plot.x_log):
            x = round(frame.x1(at)) + 0.5
            painter.setPen(paint.pen(tokens.grid))
            painter.drawLine(QPointF(x, frame.top), QPointF(x, frame.bottom))
            if last:
                painter.setPen(QColor(tokens.muted))
                side = Qt.AlignmentFlag.AlignHCenter
                painter.drawText(QRectF(x - 30, frame.bottom + 3, 60, 15), side, text)
        painter.setPen(QColor(tokens.muted))
        if last:
            name = _rich(self._x_text)
            middle = (frame.left + frame.right - name.size().width()) / 2
            painter.drawStaticText(QPointF(middle, frame.bottom + 16), name)
        painter.drawStaticText(self._corner, _rich(self._y_text))

    def _guide(self, guide: Guide) -> None:
        frame, across = self.frame, guide.along == "x"
        where = frame.y1 if across else frame.x1
        scaled = self._y if across else self._x
        ends = [where(float(scaled(e))) for e in _ends(guide)]
        colour = self._colour(guide.colour)
        if guide.to is not None:
            wide = abs(ends[1] - ends[0])
            band = QRectF(min(ends), frame.top, wide, frame.bottom - frame.top)
            if across:
                band = QRectF(frame.left, min(ends), frame.right - frame.left, wide)
            self._painter.fillRect(band, QColor(self._tokens.band))
            return
        style = Qt.PenStyle.DashLine if guide.dashed else Qt.PenStyle.SolidLine
        self._painter.setPen(paint.pen(colour, style))
        at, line = ends[0], QLineF(ends[0], frame.top, ends[0], frame.bottom)
        self._painter.drawLine(
            QLineF(frame.left, at, frame.right, at) if across else line
        )
        if guide.text:
            text = _rich(guide.text)
            room = frame.right - text.size().width()
            x, y = (frame.left + 4, at + 1) if across else (at + 3, frame.top)
            self._painter.setPen(QColor(colour))
            self._painter.drawStaticText(QPointF(min(x, room), y), text)

    def _series(self, s: Series) -> None:
        frame, painter = self.frame, self._painter
        colour, x = QColor(self._colour(s.colour)), frame.x(self._x(s.x))
        if s.mark == "ticks":
            painter.setPen(paint.pen(colour.name()))
            high = frame.bottom - frame.top
            ends = frame.top + 0.03 * high, frame.top + 0.14 * high
            painter.drawLines([QLineF(a, ends[0], a, ends[1]) for a in x.tolist()])
            return
        if s.low is not None and s.high is not None:
            pale = QColor(colour)
            pale.setAlphaF(1.0 if s.mark == "range" else 0.22)
            self._fill(x, frame.y(self._y(s.low)), frame.y(self._y(s.high)), pale)
        if s.mark in ("range", "band"):
            return
        y = frame.y(self._y(s.y))
        painter.setPen(colour if s.mark == "text" else QColor(self._tokens.muted))
        for a, b, text in zip(x.tolist(), y.tolist(), s.texts, strict=False):
            box = QRectF(a - 40, b - 20, 80, 16)
            painter.drawText(box, Qt.AlignmentFlag.AlignHCenter, text)
        if s.mark == "text":
            return
        if s.mark == "filled":
            pale = QColor(colour)
            pale.setAlphaF(0.14)
            zero = np.full(x.size, frame.y1(float(self._y(0.0))))
            self._fill(x, y, zero, pale)
        self._errors(s, x, y, colour)
        if s.mark not in ("points", "dots", "open"):
            self._line(s, x, y, colour)
        if s.mark in _POINTS:
            _points(painter, s.mark, x, y, colour)

    def _line(self, s: Series, x: FloatArray, y: FloatArray, colour: QColor) -> None:
        style = {
            "dashed": Qt.PenStyle.DashLine,
            "dotted": Qt.PenStyle.DotLine,
        }.get(s.mark, Qt.PenStyle.SolidLine)
        if s.mark == "steps":
            x, y = np.repeat(x, 2)[1:], np.repeat(y, 2)[:-1]
        for piece in _pieces(x, y):
            pen = paint.pen(colour.name(), style)
            paint.polyline(self._painter, x[piece], y[piece], pen)

    def _fill(
        self, x: FloatArray, low: FloatArray, high: FloatArray, colour: QColor
    ) -> None:
        self._painter.setPen(Qt.PenStyle.NoPen)
        self._painter.setBrush(colour)
        for piece in _pieces(x, low + high):
            around = np.r_[x[piece], x[piece][::-1]]
            edge = np.r_[low[piece], high[piece][::-1]]
            self._painter.drawPolygon(paint.polygon(around, edge))

    def _errors(self, s: Series, x: FloatArray, y: FloatArray, colour: QColor) -> None:
        lines = []
        if s.x_error is not None:
            value, half = np.asarray(s.x), np.asarray(s.x_error)
            ends = (self.frame.x(self._x(v)) for v in (value - half, value + half))
            rows = zip(*ends, y, y, strict=True)
            lines += [QLineF(a, c, b, d) for a, b, c, d in rows]
        if s.y_error is not None:
            value, half = np.asarray(s.y), np.asarray(s.y_error)
            ends = (self.frame.y(self._y(v)) for v in (value - half, value + half))
            lines += [QLineF(a, b, a, c) for a, b, c in zip(x, *ends, strict=True)]
        if lines:
            self._painter.setPen(paint.pen(colour.name()))
            self._painter.drawLines(lines)

    def _legend(self) -> None:
        """Marks and names from the right edge, beside the heading or below it."""
        painter, right = self._painter, self.frame.right
        y = self.frame.top - TOP + 10.0
        for s in reversed(self._named):
            text, colour = _rich(s.name), QColor(self._colour(s.colour))
            right -= text.size().width()
            painter.setPen(QColor(self._tokens.text))
            painter.drawStaticText(QPointF(right, y - 8), text)
            at = np.array([right - 11.0])
            if s.mark in _POINTS:
                _points(painter, s.mark, at, np.array([y]), colour)
            else:
                ends = np.array([right - 18.0, right - 5.0])
                self._line(s, ends, np.array([y, y]), colour)
            right -= MARK

    def _colour(self, name: str) -> str:
        known = {
            "model": self._tokens.twin, "ink": self._tokens.text,
            "quiet": self._tokens.muted,
        }  # fmt: skip
        return known.get(name) or self._tokens.trace(name)


_POINTS = ("points", "dots", "open", "up", "down", "joined")


def _ends(guide: Guide) -> tuple[float, ...]:
    return (guide.at,) if guide.to is None else (guide.at, guide.to)


def _range(values: list[FloatArray], whole: bool) -> tuple[float, float]:
    """A range with air around all finite values."""
    found = np.concatenate([np.atleast_1d(v) for v in values] or [np.empty(0)])
    found = found[np.isfinite(found)]
    if not found.size:
        return 0.0, 1.0
    low, high = float(found.min()), float(found.max())
    if whole:
        return low - 0.5, high + 0.5
    return nice_range(low, high, max(1e-9, 1e-6 * abs(high)))


def _numbers(low: float, high: float, log: bool) -> list[tuple[float, str]]:
    """Where an axis has numbers, and these."""
    if log:
        powers = range(int(np.ceil(low)), int(np.floor(high)) + 1)
        return [(float(p), f"1e{p}".replace("-", "−")) for p in powers]
    return numbers(low, high, 5)


def _pieces(x: FloatArray, y: FloatArray) -> list[slice]:
    """Runs of finite points."""
    known = np.isfinite(x) & np.isfinite(y)
    edges = np.flatnonzero(np.diff(np.r_[False, known, False]))
    return [slice(a, b) for a, b in edges.reshape(-1, 2).tolist()]


def _points(
    painter: QPainter, mark: str, x: FloatArray, y: FloatArray, colour: QColor
) -> None:
    size = SIZE if mark != "dots" else 0.5 * SIZE
    painter.setPen(paint.pen(colour.name()) if mark == "open" else Qt.PenStyle.NoPen)
    painter.setBrush(Qt.BrushStyle.NoBrush if mark == "open" else colour)
    known = np.isfinite(x) & np.isfinite(y)
    for a, b in zip(x[known].tolist(), y[known].tolist(), strict=True):
        if mark in ("up", "down"):
            tip = -size if mark == "up" else size
            corners = [(a - size, b - tip), (a + size, b - tip), (a, b + tip)]
            painter.drawPolygon(QPolygonF([QPointF(*corner) for corner in corners]))
        else:
            painter.drawEllipse(QPointF(a, b), size, size)


def _rich(text: str) -> QStaticText:
    """Text with V_C1 as a symbol with its subscript."""
    escaped = text.replace("&", "&amp;").replace("<", "&lt;")
    named = re.sub(r"\b([A-Z])_([A-Z0-9]+)\b", r"\1<sub>\2</sub>", escaped)
    made = QStaticText(named.replace(" ", "&nbsp;"))
    made.setTextFormat(Qt.TextFormat.RichText)
    return made
