"""One panel of a plot that `tactile_lab.plot` describes, as pyqtgraph draws it."""

from __future__ import annotations

import html
import re
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import ArrayLike
from PySide6.QtCore import QPointF, QSizeF, Qt
from PySide6.QtGui import QColor

from gui.look.fonts import sized
from gui.look.tokens import Tokens
from gui.plots.axis import GuardedLine, RoundAxis, stroke
from gui.plots.cells import cell_at, item, levels, shades
from gui.plots.numbers import nice_range
from gui.plots.plot_box import Box
from tactile_lab.arrays import FloatArray
from tactile_lab.plot import Guide, Panel, Plot, Series, grid, y_scale, z_scale
from tactile_lab.report.near import from_near

LEFT, FOOT, LOW, HEAD = 48, 36, 20, 22
"""Width of an axis; heights of one with its name, without it, and of a heading, px."""
NEAR = 0.04
"""Share of the width within which a text at an edge stands inside of it."""
WIDEST = 1e4
"""Width of a heading where nothing limits it, px."""
SIZE = 7.6
"""Size of a point, px."""
BELOW = 1e-9
"""Part of a value to which the bar of an interval goes that reaches 0, which is nowhere
on a logarithmic axis."""
REACH = 10.0
"""Distance from a point within which a click is on it, px."""

POINTS = {
    "points": "o",
    "dots": "o",
    "open": "o",
    "joined": "o",
    "crosses": "x",
    "up": "t1",
    "down": "t",
}
STYLES = {"dashed": Qt.PenStyle.DashLine, "dotted": Qt.PenStyle.DotLine}
GLYPHS = {
    "points": "●", "dots": "•", "open": "○", "joined": "●", "up": "▲", "down": "▼",
    "crosses": "✕", "dashed": "╌", "dotted": "┈",
    "filled": "▬", "range": "▬", "band": "▬",
}  # fmt: skip
"""What stands for a mark in the legend; a dash where none does."""


class _Heading(pg.LabelItem):  # type: ignore[misc]
    """Text above a panel, in as many lines as it needs."""

    def __init__(self, text: str) -> None:
        super().__init__(text, size="11px", justify="left")

    def resizeEvent(self, event: Any) -> None:
        """Break the text where the width ends."""
        if self.width() > 50:  # before it has its place, every word is a line
            self.item.setTextWidth(self.width())
            self.setFixedHeight(self.item.boundingRect().height())
        super().resizeEvent(event)

    def updateMin(self) -> None:
        """Nothing: the layout asks for its size."""

    def sizeHint(self, which: Qt.SizeHint, constraint: QSizeF) -> QSizeF:
        """It takes what width there is."""
        most = which is Qt.SizeHint.MaximumSize
        return QSizeF(WIDEST if most else 0, WIDEST if most else HEAD)


class PanelItem(pg.GraphicsLayout):  # type: ignore[misc]
    """One panel; values on its axes are those shown, or their logarithms.

    Attributes:
        panel: as it is drawn, perhaps less a round number.
    """

    def __init__(
        self, plot: Plot, panel: Panel, tokens: Tokens, ratio: float, foot: int
    ) -> None:
        super().__init__()
        self._plot, self.panel = plot, (panel := from_near(panel))
        self._tokens, self._ratio = tokens, ratio
        x_by, x_text = plot.x_scale()
        y_by, y_text = y_scale(panel)
        self._x, self._y = _shown(x_by, plot.x_log), _shown(y_by, panel.log)
        self._x_by, self._y_by = x_by, y_by
        self.setContentsMargins(0, 0, 0, 0)
        self.setSpacing(0)
        self.box = Box(self.at)
        left = RoundAxis("left", 26, whole=panel.whole)
        bottom = RoundAxis("bottom", 60, whole=plot.whole)
        if panel.label:
            self.addItem(_Heading(self._heading(y_text)), 0, 0, 1, 2)
        self.addItem(left, 1, 0)
        self.addItem(self.box, 1, 1)
        self.addItem(bottom, 2, 1)
        left.logMode, bottom.logMode = panel.log, plot.x_log
        for axis in (left, bottom):
            axis.tint(tokens)
            axis.setGrid(255)
            axis.setZValue(-200)  # below the box of the data
            axis.linkToView(self.box)
        left.setWidth(LEFT)
        bottom.setStyle(showValues=foot >= LOW)
        bottom.setHeight(foot)
        if foot >= FOOT:
            bottom.setLabel(_rich(x_text), color=tokens.muted, **{"font-size": "11px"})
        bottom.named = {float(self._x(x)): f"{x * x_by:.3g}" for x in plot.x_ticks}
        self.box.whole = [self._x_range(), self._y_range()]
        self.box.show_all()
        for guide in panel.guides:
            self._guide(guide)
        for series in panel.series:
            self._series(series)
        if panel.text.count("\n") > 1:  # of so many lines, they would lie over the data
            self.addItem(_Heading(_rich(panel.text, tokens.text)), 3, 0, 1, 2)
        elif panel.text:
            words = pg.LabelItem(_rich(panel.text), color=tokens.text, size="11px")
            words.setParentItem(self.box)
            at = (1, 0) if panel.corner == "upper" else (1, 1)
            words.anchor(itemPos=at, parentPos=at)

    def at(self, place: QPointF) -> int:
        """What the nearest point stands for, or else the cell below; -1 for nothing."""
        wide, high = self.box.viewPixelSize()
        nearest, found = REACH, -1
        for s in self.panel.series:
            if not s.of or s.mark == "cells":
                continue
            x, y = self._x(s.x) - place.x(), self._y(s.y) - place.y()
            far = np.nan_to_num(np.hypot(x / wide, y / high), nan=np.inf)
            if far.min() < nearest:
                nearest, found = float(far.min()), s.of[int(far.argmin())]
        maps = (s for s in self.panel.series if s.of and s.mark == "cells")
        for s in maps if found < 0 else ():
            found = cell_at(s, place.x() / self._x_by, place.y() / self._y_by)
        return found

    def _x_range(self) -> list[float]:
        plot = self._plot
        if plot.x_limits is not None:
            return [float(self._x(limit)) for limit in plot.x_limits]
        panels = (self.panel,) if plot.beside else plot.panels
        drawn = [s for p in panels for s in p.series]
        across = [self._x(v) for s in drawn for v in _along_x(s)]
        if any(s.mark == "cells" for s in drawn):  # no air about a map
            return [float(np.min(across[0])), float(np.max(across[0]))]
        upright = (g for p in panels for g in p.guides if g.along == "y")
        return _range(
            [*across, *(self._x(e) for g in upright for e in _ends(g))], plot.whole
        )

    def _y_range(self) -> list[float]:
        panel = self.panel
        for s in panel.series:
            if s.mark == "cells":
                edges = self._y(grid(s)[1])
                return [float(edges[0]), float(edges[-1])]
        shown = [
            self._y(v)
            for s in panel.series
            for v in (s.y, s.low, s.high, *_reached(s.y, s.y_error))
            if v is not None and s.mark != "ticks"
        ]
        across = (g for g in panel.guides if g.along == "x")
        # with the limits: air is a share of all that is in view
        least, most = (None if end is None else self._y(end) for end in panel.limits)
        ends = [end for end in (least, most) if end is not None]
        low, high = _range(
            [*shown, *(self._y(e) for g in across for e in _ends(g)), *ends], False
        )
        return [
            low if least is None else float(least),
            high if most is None else float(most),
        ]

    def _heading(self, text: str) -> str:
        """What is along y, mark and name of each series, and what the panel is of."""
        parts = [_rich(text, self._tokens.muted)]
        for s in self.panel.series:
            if s.mark == "cells":
                parts.append(self._colours(s))
            elif s.name:
                mark = _rich(GLYPHS.get(s.mark, "—"), self._colour(s.colour))
                parts.append(f"{mark}&nbsp;{_rich(s.name, self._tokens.text)}")
        if self.panel.note:
            parts.append(_rich(self.panel.note, self._tokens.muted))
        return " &nbsp; ".join(parts)

    def _colours(self, s: Series) -> str:
        """What a map's colours mean."""
        by, text = z_scale(s)
        low, high = (f"{end * by:.4g}" for end in levels(s))
        values = np.asarray(s.z, dtype=np.float64)
        known = np.unique(values[np.isfinite(values)])
        bar = "".join(_rich("■", shade) for shade in shades())
        key = f"{low} {bar} {high}"
        if known.size < 2:  # a scale would make up the values at its ends
            key = f"all {known[0] * by:.4g}" if known.size else "no value"
        return f"{_rich(text, self._tokens.text)} &nbsp;{key}"

    def _guide(self, guide: Guide) -> None:
        across = guide.along == "x"
        ends = [float((self._y if across else self._x)(e)) for e in _ends(guide)]
        if guide.to is not None:
            self.box.addItem(pg.LinearRegionItem(
                ends, "horizontal" if across else "vertical", movable=False,
                brush=QColor(self._tokens.band), pen=QColor(0, 0, 0, 0),
            ))  # fmt: skip
            return
        colour = self._colour(guide.colour)
        style = Qt.PenStyle.DashLine if guide.dashed else Qt.PenStyle.SolidLine
        pen = stroke(colour, self._ratio, style)
        self.box.addItem(GuardedLine(ends[0], 0 if across else 90, pen))
        if guide.text:
            (left, right), (_, top) = self.box.whole
            far = not across and ends[0] > left + 0.6 * (right - left)
            at = (left, ends[0]) if across else (ends[0], top)
            self._write(at, guide.text, colour, (float(far), float(guide.above)))

    def _write(
        self, at: Sequence[float], text: str, colour: str, anchor: tuple[float, float]
    ) -> None:
        """A text at a place; `anchor` is the part of it, from 0 to 1, that is there."""
        words = pg.TextItem(html=_rich(text), color=colour, anchor=anchor)
        words.setFont(sized(11))
        self.box.addItem(words, ignoreBounds=True)
        words.setPos(*at)

    def _series(self, s: Series) -> None:
        colour, x = self._colour(s.colour), self._x(s.x)
        if s.mark == "ticks":
            low, high = self.box.whole[1]
            ends = high - 0.14 * (high - low), high - 0.03 * (high - low)
            y = np.tile(ends, x.size)
            self._line(np.repeat(x, 2), y, colour, connect="pairs")
            return
        if s.mark == "cells":
            across, up, _ = grid(s)
            self.box.addItem(item(s, self._x(across), self._y(up)))
            return
        pale = QColor(colour)
        if s.low is not None and s.high is not None:
            below, above = self._y(s.low), self._y(s.high)
            if s.mark in POINTS:  # what lies between two of them is not known
                bars = np.column_stack([below, above]).ravel()
                self._line(np.repeat(x, 2), bars, self._tokens.muted, connect="pairs")
            else:
                pale.setAlphaF(1.0 if s.mark == "range" else 0.22)
                self._fill(x, below, above, pale)
        if s.mark in ("range", "band"):
            return
        y = self._y(s.y)
        ink = colour if s.mark == "text" else self._tokens.muted
        for place, text in zip(np.c_[x, y].tolist(), s.texts, strict=False):
            share = np.interp(place[0], self.box.whole[0], (0, 1))
            side = 0.5 + 0.5 * (float(share > 1 - NEAR) - float(share < NEAR))
            self._write(place, text, ink, (side, 1.0))
        if s.mark == "text" or not np.any(np.isfinite(y)):
            return
        if s.mark == "filled":
            pale.setAlphaF(0.14)
            self._fill(x, np.full(x.size, self._y(0.0)), y, pale)
        self._errors(s, colour)
        if s.mark == "steps":
            x, y = np.repeat(x, 2)[1:], np.repeat(y, 2)[:-1]
        if s.mark not in POINTS or s.mark == "joined":
            self._line(x, y, colour, mark=s.mark)
        if s.mark in POINTS:
            bare = s.mark == "open"
            points = pg.ScatterPlotItem(
                x, y, symbol=POINTS[s.mark],
                size=0.5 * SIZE if s.mark == "dots" else SIZE,
                brush=None if bare else QColor(colour),
                pen=stroke(colour) if bare else None,
            )  # fmt: skip
            points.setEnabled(False)  # clicks on its points are for the box
            self.box.addItem(points)

    def _line(
        self, x: FloatArray, y: FloatArray, colour: str, *, mark: str = "line",
        connect: str = "finite",
    ) -> None:  # fmt: skip
        pen = stroke(colour, self._ratio, STYLES.get(mark, Qt.PenStyle.SolidLine))
        self.box.addItem(pg.PlotCurveItem(x, y, pen=pen, connect=connect))

    def _fill(
        self, x: FloatArray, low: FloatArray, high: FloatArray, colour: QColor
    ) -> None:
        for part in _pieces(x, low + high):
            edges = [pg.PlotCurveItem(x[part], edge[part]) for edge in (low, high)]
            self.box.addItem(pg.FillBetweenItem(*edges, brush=colour))

    def _errors(self, s: Series, colour: str) -> None:
        """Bars of the 95 % intervals."""
        sides: dict[str, FloatArray] = {}
        for values, half, shown, log, ends in (
            (s.x, s.x_error, self._x, self._plot.x_log, ("left", "right")),
            (s.y, s.y_error, self._y, self.panel.log, ("bottom", "top")),
        ):
            # one that reaches 0 leaves a logarithmic panel, and is not left out
            least = BELOW * np.abs(values) if log else -np.inf
            for end, reach in zip(ends, _reached(values, half), strict=False):
                sides[end] = np.abs(shown(np.maximum(reach, least)) - shown(values))
        if sides:
            x, y = self._x(s.x), self._y(s.y)
            bars = pg.ErrorBarItem(x=x, y=y, pen=stroke(colour, self._ratio), **sides)
            self.box.addItem(bars)

    def _colour(self, name: str) -> str:
        tokens = self._tokens
        known = {"model": tokens.twin, "ink": tokens.text, "quiet": tokens.muted}
        return known.get(name) or tokens.trace(name)


def _shown(by: float, log: bool) -> Callable[[ArrayLike], FloatArray]:
    """From SI to what an axis shows; where it is logarithmic, the logarithm of that."""

    def shown(values: ArrayLike) -> FloatArray:
        found = np.asarray(values, dtype=np.float64) * by
        return np.log10(np.where(found > 0, found, np.nan)) if log else found

    return shown


def _reached(values: ArrayLike, half: ArrayLike | None) -> tuple[FloatArray, ...]:
    """The lower and the upper ends of intervals; none where they have no width."""
    if half is None:
        return ()
    middle, width = np.asarray(values, np.float64), np.asarray(half, np.float64)
    return middle - width, middle + width


def _along_x(s: Series) -> tuple[ArrayLike, ...]:
    """What of a series is to be in view along x."""
    return (grid(s)[0],) if s.mark == "cells" else (s.x, *_reached(s.x, s.x_error))


def _ends(guide: Guide) -> tuple[float, ...]:
    return (guide.at,) if guide.to is None else (guide.at, guide.to)


def _range(values: list[FloatArray], whole: bool) -> list[float]:
    """A range with air around all finite values."""
    found = np.concatenate([np.atleast_1d(v) for v in values] or [np.empty(0)])
    found = found[np.isfinite(found)]
    if not found.size:
        return [0.0, 1.0]
    low, high = float(found.min()), float(found.max())
    if whole:
        return [low - 0.5, high + 0.5]
    # one value, but for rounding, stands in a range of a tenth of it; 0 has no tenth
    one = high - low <= 1e-6 * abs(high)
    least = (0.1 * abs(high) or 1.0) if one else 0.0
    return [*nice_range(low, high, max(1e-9, least))]


def _pieces(x: FloatArray, y: FloatArray) -> Iterator[slice]:
    """Stretches of finite points."""
    known = np.isfinite(x) & np.isfinite(y)
    edges = np.flatnonzero(np.diff(np.r_[False, known, False]))
    return (slice(a, b) for a, b in edges.reshape(-1, 2).tolist())


def _rich(text: str, colour: str = "") -> str:
    """Text with V_C1 as a symbol with its subscript, and ohms as Ω, as HTML."""
    named = re.sub(r"\b([A-Z])_([A-Z0-9]+)\b", r"\1<sub>\2</sub>", html.escape(text))
    named = re.sub(r"Ohm\b", "Ω", named.replace("\n", "<br>"))
    return f'<span style="color:{colour}">{named}</span>' if colour else named
