"""Lines across a lane, each at a value, and the words that name them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QPainter

from gui.lanes import paint
from gui.lanes.paint import Frame

HIGH = 16
"""Height of words with their ground, px."""

NAMES = 18
"""Above this height, px, names of holds may stand: words go below their line."""

OVER = 4
"""So far above and below its values a lane is painted, too, px."""

APART = 8
"""Between words that stand side by side, px."""


@dataclass(frozen=True)
class Across:
    """A line across a lane.

    Attributes:
        value: in shown units.
        words: name it.
        colour: of both, as "#rrggbb".
        style: of the line.
        right: the words stand at its right end, not at its left.
    """

    value: float
    words: str
    colour: str
    style: Qt.PenStyle
    right: bool


def places(
    heights: Sequence[float], widths: Sequence[float], tall: float
) -> list[tuple[float, float]]:
    """Where words stand, px: how far from the side, and the middle of their height.

    Words stand above their line, or below it where there is no room. Two that would
    lie over each other stand side by side.

    Args:
        heights: of the lines in the lane, px.
        widths: of their words, px.
        tall: height of the lane, px.
    """
    found: list[tuple[float, float]] = []
    for y in heights:
        above = y > NAMES or y + HIGH > tall + OVER
        middle = max(y - HIGH / 2, HIGH / 2 - OVER) if above else y + HIGH / 2 + 1
        taken = [
            start + wide + APART
            for (start, other), wide in zip(found, widths, strict=False)
            if abs(other - middle) < HIGH
        ]
        found.append((max(taken, default=0.0), middle))
    return found


def draw_across(
    painter: QPainter, frame: Frame, lines: Sequence[Across], ground: str
) -> None:
    """Draw the lines across that are in the lane, and their words over all lines.

    Words have a ground of its own colour: traces would strike them through.
    """
    low, high = frame.top - OVER, frame.bottom + OVER
    lines = [one for one in lines if low <= frame.y1(one.value) <= high]
    for one in lines:
        y = round(frame.y1(one.value)) + 0.5
        painter.setPen(paint.pen(one.colour, one.style))
        painter.drawLine(QPointF(0, y), QPointF(frame.right, y))
    for right in (False, True):
        side = [one for one in lines if one.right is right]
        heights = [frame.y1(one.value) for one in side]
        widths = [paint.width_of(one.words) for one in side]
        found = places(heights, widths, frame.bottom - frame.top)
        for one, (start, middle) in zip(side, found, strict=True):
            at = QPointF(frame.right - 5 - start if right else 5 + start, middle)
            paint.write_on(painter, at, one.words, one.colour, ground, float(right))
