"""What lies below the traces: bands of holds, the future, grids, axis numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QLineF, QPointF, QRectF
from PySide6.QtGui import QColor, QPainter

from gui.lanes import paint
from gui.lanes.axis import numbers
from gui.lanes.expected import Stretch
from gui.lanes.paint import Frame
from gui.lanes.source import Source
from gui.look.tokens import Tokens

AXIS = 52
"""Width of the value axis, px; the same in every lane so that time lines up."""

GUTTER = 56
"""Width right of the plot for the value tag, px."""

LINE = 13
"""Height that a number on the axis needs, px."""

CLOSE = 3
"""Pixels for each hold below which they are painted as one."""

TIME_AXIS = 22
"""Height of the time axis below the last lane, px."""


@dataclass(frozen=True)
class Place:
    """Where a lane stands: `top` names holds, `bottom` has the time axis.

    `values` is whether it has a value axis.
    """

    top: bool
    bottom: bool
    values: bool


def ground(
    painter: QPainter, frame: Frame, source: Source, tokens: Tokens, place: Place
) -> None:
    """Bands of holds, grid, axis numbers, hold names, the future."""
    holds = _visible(source, frame)
    for hold, left, right in holds:
        band = QRectF(left, 0, right - left, frame.bottom + 3)
        painter.fillRect(band, QColor(tokens.sunken if hold.pause else tokens.band))
    if source.running and source.reach < frame.end:
        x = max(frame.x1(source.reach), frame.left)
        painter.fillRect(
            QRectF(x, 0, frame.right - x, frame.bottom + 3), QColor(tokens.ahead)
        )
    _time_grid(painter, frame, tokens, place)
    if place.values:
        _value_grid(painter, frame, tokens)
    if place.top:
        _names(painter, holds, tokens)


def _visible(source: Source, frame: Frame) -> list[tuple[Stretch, float, float]]:
    """Holds in view with their left and right ends, px.

    Where they are too many to be told apart, one that spans them all.
    """
    holds = [h for h in source.holds if h.end > frame.start and h.start < frame.end]
    if len(holds) * CLOSE > frame.right - frame.left:
        holds = [Stretch(holds[0].start, holds[-1].end, "")]
    return [
        (
            hold,
            max(frame.x1(hold.start), frame.left),
            min(frame.x1(hold.end), frame.right),
        )
        for hold in holds
    ]


def _names(
    painter: QPainter, holds: list[tuple[Stretch, float, float]], tokens: Tokens
) -> None:
    """Names of the holds, over the grid."""
    for hold, left, right in holds:
        if right - left > 34:
            text = "recovery" if hold.pause else hold.label
            painter.save()
            painter.setClipRect(QRectF(left, 0, right - left - 3, 20))
            paint.write(painter, QPointF(left + 5, 10), text, tokens.muted)
            painter.restore()


def _value_grid(painter: QPainter, frame: Frame, tokens: Tokens) -> None:
    rows = max(2, int((frame.bottom - frame.top) / 21))
    found = numbers(frame.low, frame.high, rows)
    if len(found) < 2:  # one number alone says nothing of the scale
        found = numbers(frame.low, frame.high, 5)
    heights = [round(frame.y1(value)) + 0.5 for value, _ in found]
    if len(found) > 2 and abs(frame.y1(found[1][0]) - frame.y1(found[0][0])) < LINE:
        # told beside each other, they would overlap: both ends
        found, heights = [found[0], found[-1]], [heights[0], heights[-1]]
    painter.setPen(paint.pen(tokens.grid))
    painter.drawLines([QLineF(frame.left, y, frame.right, y) for y in heights])
    for (_, words), y in zip(found, heights, strict=True):
        if frame.top + 1 <= y <= frame.bottom + 1:
            paint.write(painter, QPointF(AXIS - 8, y), words, tokens.muted, align=1.0)
    painter.setPen(paint.pen(tokens.border_strong))
    painter.drawLine(
        QPointF(frame.left - 0.5, 4), QPointF(frame.left - 0.5, frame.bottom)
    )


def _time_grid(painter: QPainter, frame: Frame, tokens: Tokens, place: Place) -> None:
    most = max(2, int((frame.right - frame.left) / 90))
    found = numbers(frame.start, frame.end, most)
    across = [round(frame.x1(value)) + 0.5 for value, _ in found]
    painter.setPen(paint.pen(tokens.grid))
    painter.drawLines([QLineF(x, 0, x, frame.bottom + 3) for x in across])
    if place.bottom:
        for (value, words), x in zip(found, across, strict=True):
            if value >= -1e-12 and x < frame.right - 14:
                at = QPointF(x, frame.bottom + 13)
                paint.write(painter, at, words, tokens.muted, align=0.5)
        painter.setPen(paint.pen(tokens.border_strong))
        y = frame.bottom + 3.5
        painter.drawLine(QPointF(frame.left, y), QPointF(frame.right, y))
        at = QPointF(frame.right + 4, frame.bottom + 13)
        paint.write(painter, at, "time / s", tokens.muted)


def row_names(
    painter: QPainter,
    frame: Frame,
    tokens: Tokens,
    names: Sequence[str],
    colours: Sequence[str] = (),
) -> None:
    """Write the names of the rows of a raster or a stack beside them."""
    for number_, (a, b) in enumerate(rows_of(frame, len(names))):
        colour = colours[number_] if colours else tokens.muted
        at = QPointF(AXIS - 8, (a + b) / 2)
        paint.write(painter, at, names[number_], colour, align=1.0)


def rows_of(frame: Frame, count: int) -> list[tuple[float, float]]:
    """Top and bottom of `count` rows of a raster or a stack, px."""
    each = (frame.bottom - frame.top) / count
    air = 0.2 * each if count == 1 else 2.5
    return [
        (frame.top + k * each + air, frame.top + (k + 1) * each - air)
        for k in range(count)
    ]
