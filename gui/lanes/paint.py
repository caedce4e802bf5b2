"""Numpy arrays onto a painter: the fast path of every trace.

Traces are stroked 1 device pixel wide, on fine screens several times side by side:
wider antialiased polylines cost tens of times more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import pairwise
from typing import Any

import numpy as np
import pyqtgraph as pg
import shiboken6
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import (
    QColor,
    QFont,
    QFontMetricsF,
    QPainter,
    QPen,
    QPolygonF,
    QStaticText,
    QTransform,
)

from gui.look.fonts import sized
from tactile_lab.arrays import FloatArray
from tactile_lab.trace import Trace, middle

FAR = 1e5
"""Pixels beyond which coordinates are clamped: Qt's rasteriser loses precision."""

FEW = 8
"""Gaps up to which strokes are drawn one by one, which costs less than one path."""


@dataclass(frozen=True)
class Frame:
    """The map from time and value to pixels.

    Attributes:
        left, right, top, bottom: of the plot, px.
        start, end: of the visible time, s.
        low, high: of the visible values.
    """

    left: float
    right: float
    top: float
    bottom: float
    start: float
    end: float
    low: float
    high: float

    def x(self, time: FloatArray) -> FloatArray:
        """Pixels of times."""
        per = (self.right - self.left) / (self.end - self.start)
        return _near(self.left + (time - self.start) * per)

    def y(self, value: FloatArray) -> FloatArray:
        """Pixels of values."""
        per = (self.bottom - self.top) / (self.high - self.low)
        return _near(self.bottom - (value - self.low) * per)

    def x1(self, time: float) -> float:
        """Pixel of one time."""
        per = (self.right - self.left) / (self.end - self.start)
        return min(max(self.left + (time - self.start) * per, -FAR), FAR)

    def y1(self, value: float) -> float:
        """Pixel of one value."""
        per = (self.bottom - self.top) / (self.high - self.low)
        return min(max(self.bottom - (value - self.low) * per, -FAR), FAR)


def _near(pixels: FloatArray) -> FloatArray:
    """Those beyond `FAR` as `FAR`; `np.clip` takes four times as long to say so."""
    return np.minimum(np.maximum(pixels, -FAR), FAR)


def polygon(x: FloatArray, y: FloatArray) -> QPolygonF:
    """A polygon filled straight from arrays, without a Python loop."""
    made = QPolygonF()
    made.resize(x.size)
    if x.size:
        # its stubs know nothing of memory
        whole: Any = shiboken6.VoidPtr
        pointer = whole(made.data(), 16 * x.size, True)
        memory = np.frombuffer(pointer, dtype=np.float64).reshape(-1, 2)
        memory[:, 0] = x
        memory[:, 1] = y
    return made


@contextmanager
def clipped(painter: QPainter, area: QRectF) -> Iterator[None]:
    """Draw within an area; afterwards the painter is as before, whatever was raised."""
    painter.save()
    try:
        painter.setClipRect(area)
        yield
    finally:
        painter.restore()


@lru_cache(maxsize=256)
def pen(colour: str, style: Qt.PenStyle = Qt.PenStyle.SolidLine) -> QPen:
    """A 1 px pen."""
    return QPen(QColor(colour), 1, style)


def zigzag(shown: Trace) -> tuple[FloatArray, FloatArray]:
    """One polyline through all columns: down to the low, up to the high, and on.

    The nearer extreme comes first, so that the line does not cross itself needlessly.
    """
    x = np.repeat(shown.time, 2)
    y = np.empty(x.size)
    y[0::2], y[1::2] = shown.low, shown.high
    if len(shown) > 1:
        centre = (shown.low + shown.high) / 2
        falling = np.empty(centre.size, np.bool_)
        falling[1:] = centre[1:] < centre[:-1]
        falling[0] = falling[1]
        y[0::2] = np.where(falling, shown.high, shown.low)
        y[1::2] = np.where(falling, shown.low, shown.high)
    return x, y


def trace(painter: QPainter, frame: Frame, shown: Trace, line: QPen) -> None:
    """Draw a decimated trace, broken at gaps."""
    if shown.empty:
        return
    (starts,) = shown.gap.nonzero()
    if shown.flat:
        x, y = shown.time, shown.low
    else:
        (x, y), starts = zigzag(shown), 2 * starts
    polyline(painter, frame.x(x), frame.y(y), line, starts)


def polyline(
    painter: QPainter,
    x: FloatArray,
    y: FloatArray,
    line: QPen,
    starts: NDArray[np.intp] | None = None,
) -> None:
    """Draw a line through pixels; a new stroke begins at each index in `starts`."""
    painter.setBrush(Qt.BrushStyle.NoBrush)
    breaks = [] if starts is None else starts[1:].tolist()
    draw: list[Callable[[], None]]
    if len(breaks) <= FEW:
        ends = pairwise([0, *breaks, x.size])
        draw = [partial(painter.drawPolyline, polygon(x[a:b], y[a:b])) for a, b in ends]
    else:  # in one call: lines broken a hundred times cost as much as whole ones
        joined = np.ones(x.size, np.bool_)
        joined[np.array(breaks) - 1] = False
        path = pg.arrayToQPath(x, y, joined, finiteCheck=False)
        draw = [partial(painter.drawPath, path)]
    fine = painter.deviceTransform().m11()
    if fine <= 1:
        painter.setPen(line)
        for stroke in draw:
            stroke()
        return
    painter.setPen(_hairline(line.color().name(), line.style()))
    # jagged lines fill an area: they may leave no gaps between their columns
    smooth = painter.testRenderHint(QPainter.RenderHint.Antialiasing)
    count = round(fine) if smooth else math.ceil(fine)
    for number in range(count):
        by = (number - (count - 1) / 2) / fine
        painter.translate(by, by)
        for stroke in draw:
            stroke()
        painter.translate(-by, -by)


@lru_cache(maxsize=256)
def _hairline(colour: str, style: Qt.PenStyle) -> QPen:
    """A pen of 1 device pixel, however fine the screen."""
    made = QPen(QColor(colour), 1, style)
    made.setCosmetic(True)
    return made


def fill(painter: QPainter, frame: Frame, shown: Trace, colour: QColor) -> None:
    """Fill between a trace and the value 0; its line hides the jagged edge."""
    if shown.empty:
        return
    x, y = frame.x(shown.time), frame.y(shown.high)
    zero = frame.y1(min(max(0.0, frame.low), frame.high))
    x = np.concatenate([[x[0]], x, [x[-1]]])
    y = np.concatenate([[zero], y, [zero]])
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(colour)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
    painter.drawPolygon(polygon(x, y))
    painter.setRenderHint(QPainter.RenderHint.Antialiasing, True)


def envelope(painter: QPainter, frame: Frame, shown: Trace, colour: str) -> None:
    """Fill between least and largest, so that averaging hides nothing.

    A line up and down through every pixel column: Qt fills polygons of so many corners
    ten times more slowly.
    """
    if shown.flat:
        return
    painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
    trace(painter, frame, shown, pen(colour))
    painter.setRenderHint(QPainter.RenderHint.Antialiasing, True)


def outline(
    painter: QPainter, frame: Frame, shown: Trace, colour: str, ground: str
) -> None:
    """Fill a trace down to 0 and draw its line; a tint where columns hold many values.

    A line up and down through every column would be a solid block.
    """
    soft = QColor(colour)
    soft.setAlpha(38)
    fill(painter, frame, shown, soft)
    if np.count_nonzero(shown.low != shown.high) > shown.time.size // 2:
        envelope(painter, frame, shown, mixed(colour, ground, 0.45))
    else:
        trace(painter, frame, shown, pen(colour))


@lru_cache(maxsize=64)
def mixed(colour: str, ground: str, share: float) -> str:
    """`share` of a colour over a ground, opaque."""
    one, other = QColor(colour), QColor(ground)
    parts = [
        round(share * a + (1 - share) * b)
        for a, b in zip(one.getRgb()[:3], other.getRgb()[:3], strict=True)  # type: ignore[index]
    ]
    return QColor(*parts).name()


def pulses(painter: QPainter, frame: Frame, shown: Trace, colour: str) -> None:
    """Draw columns that stand out of the noise from least to largest value."""
    if shown.empty:
        return
    reach = shown.high - shown.low
    stands = reach > 4 * middle(reach) + 1e-12
    x = frame.x(shown.time[stands]).tolist()
    low, high = (
        frame.y(shown.low[stands]).tolist(),
        frame.y(shown.high[stands]).tolist(),
    )
    painter.setPen(pen(colour))
    painter.drawLines(
        [QLineF(a, b, a, c) for a, b, c in zip(x, low, high, strict=True)]
    )


def bars(
    painter: QPainter,
    frame: Frame,
    times: FloatArray,
    span: tuple[float, float],
    line: QPen,
) -> None:
    """Draw a vertical bar at each time, from one pixel row to another.

    Bars in neighbouring columns are one rectangle: a dense raster costs no more.
    """
    left, right = round(frame.left), round(frame.right)
    x = np.round(frame.x(times)).astype(np.int64) - left
    x = x[(x >= 0) & (x <= right - left)]
    filled = np.zeros(right - left + 3, np.int8)
    filled[x + 1] = 1
    edges = filled[1:] - filled[:-1]
    (begins,), (ends,) = (edges > 0).nonzero(), (edges < 0).nonzero()
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(line.color())
    top, height = span[0], span[1] - span[0]
    painter.drawRects(
        [
            QRectF(left + a, top, b - a, height)
            for a, b in zip(begins.tolist(), ends.tolist(), strict=True)
        ]
    )


def dots(painter: QPainter, x: FloatArray, y: FloatArray, colour: str) -> None:
    """Draw small squares at pixels."""
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(colour))
    painter.drawRects(
        [
            QRectF(a - 2, b - 2, 4, 4)
            for a, b in zip(x.tolist(), y.tolist(), strict=True)
        ]
    )


@lru_cache(maxsize=2048)
def _laid_out(
    text: str, pixels: int, weight: QFont.Weight = QFont.Weight.Normal
) -> tuple[QStaticText, float, float]:
    """A short text laid out once: drawing it again costs a tenth."""
    made = QStaticText(text)
    made.setTextFormat(Qt.TextFormat.PlainText)
    made.prepare(QTransform(), sized(pixels, weight))
    size = made.size()
    return made, size.width(), size.height()


def write(
    painter: QPainter,
    at: QPointF,
    text: str,
    colour: str,
    *,
    align: float = 0.0,
    pixels: int = 11,
    weight: QFont.Weight = QFont.Weight.Normal,
) -> None:
    """Write a number or a name.

    Args:
        painter: its font is changed.
        at: the text's middle in height; in width its start, middle or end.
        text: in one line.
        colour: as "#rrggbb".
        align: 0 starts at the point, 0.5 is centred there, 1 ends there.
        pixels: size.
        weight: of its strokes.
    """
    laid_out, width, height = _laid_out(text, pixels, weight)
    painter.setFont(sized(pixels, weight))
    painter.setPen(pen(colour))
    where = QPointF(round(at.x() - align * width), round(at.y() - height / 2))
    painter.drawStaticText(where, laid_out)


def width_of(text: str) -> float:
    """Width of a text as `write` has it, px."""
    return _laid_out(text, 11)[1]


def shortened(text: str, room: float) -> str:
    """What of a text as `write` has it is shown in so many px; "" for nothing.

    A name that just ended at a border would read as another: 160 mN as 160 m.
    """
    if width_of(text) <= room:
        return text
    cut = QFontMetricsF(sized(11)).elidedText(text, Qt.TextElideMode.ElideRight, room)
    return cut if len(cut) > 1 else ""


def write_on(
    painter: QPainter,
    at: QPointF,
    text: str,
    colour: str,
    ground: str,
    align: float = 0.0,
) -> None:
    """Write as `write` does, on a ground of its own: to be read over anything."""
    wide = width_of(text)
    box = QRectF(at.x() - align * wide - 3, at.y() - 8, wide + 6, 16)
    painter.fillRect(box, QColor(ground))
    write(painter, at, text, colour, align=align)
