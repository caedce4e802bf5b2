"""What lies below the traces: bands of holds, the future, grids, axis numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QLineF, QPointF, QRectF
from PySide6.QtGui import QColor, QPainter

from gui.lanes import paint
from gui.lanes.axis import decimals, number, step_of, ticks
from gui.lanes.expected import Hold
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


def _visible(source: Source, frame: Frame) -> list[tuple[Hold, float, float]]:
    """Holds in view with their left and right ends, px.

    Where they are too many to be told apart, one that spans them all.
    """
    holds = [h for h in source.holds if h.end > frame.start and h.start < frame.end]
    if len(holds) * CLOSE > frame.right - frame.left:
        holds = [Hold(holds[0].start, holds[-1].end, "")]
    return [
        (
            hold,
            max(frame.x1(hold.start), frame.left),
            min(frame.x1(hold.end), frame.right),
        )
        for hold in holds
    ]


def _names(
    painter: QPainter, holds: list[tuple[Hold, float, float]], tokens: Tokens
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
    values = ticks(frame.low, frame.high, rows)
    if len(values) < 2:  # one number alone says nothing of the scale
        rows = 5
        values = ticks(frame.low, frame.high, rows)
    step = step_of(frame.high - frame.low, rows)
    places = decimals(step)
    values = _apart(values, abs(frame.y1(step) - frame.y1(0.0)))
    heights = [round(frame.y1(value)) + 0.5 for value in values]
    painter.setPen(paint.pen(tokens.grid))
    painter.drawLines([QLineF(frame.left, y, frame.right, y) for y in heights])
    for value, y in zip(values, heights, strict=True):
        if frame.top + 1 <= y <= frame.bottom + 1:
            words = number(value, places)
            paint.write(painter, QPointF(AXIS - 8, y), words, tokens.muted, align=1.0)
    painter.setPen(paint.pen(tokens.border_strong))
    painter.drawLine(
        QPointF(frame.left - 0.5, 4), QPointF(frame.left - 0.5, frame.bottom)
    )


def _apart(values: list[float], pixels: float) -> list[float]:
    """Of ticks `pixels` apart, those that can be told beside each other; both ends."""
    if pixels >= LINE or len(values) < 2:
        return values
    return [values[0], values[-1]]


def _time_grid(painter: QPainter, frame: Frame, tokens: Tokens, place: Place) -> None:
    most = max(2, int((frame.right - frame.left) / 90))
    step = step_of(frame.end - frame.start, most)
    places = decimals(step)
    values = ticks(frame.start, frame.end, most)
    across = [round(frame.x1(value)) + 0.5 for value in values]
    painter.setPen(paint.pen(tokens.grid))
    painter.drawLines([QLineF(x, 0, x, frame.bottom + 3) for x in across])
    if place.bottom:
        for value, x in zip(values, across, strict=True):
            if value >= -1e-12 and x < frame.right - 14:
                at, words = QPointF(x, frame.bottom + 13), number(value, places)
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
