"""An axis with round numbers in the window's typeface, on pyqtgraph."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pyqtgraph as pg
from PySide6.QtCore import QRectF, Qt, QTimer
from PySide6.QtGui import QColor, QPen

from gui.look.fonts import sized
from gui.look.tokens import Tokens
from gui.plots.numbers import decimals, number, value_ticks
from tactile_lab.plot import with_room

# at exit it would look through every object there is; the window closes its own
pg.setConfigOption("exitCleanup", False)

NAME = 44.0
"""Least distance between two values that have a text, px."""
AIR = 15
"""Pixels by which a number may stand out at an end of an axis."""

Paint = Callable[..., None]


def guarded(paint: Paint) -> Paint:
    """Let an item's `paint` fail alone: two exceptions in a picture end the process.

    The exception is told once the picture is done, as one from any slot.
    """

    def safely(*given: Any) -> None:
        try:
            paint(*given)
        except Exception as error:
            told = error

            def tell() -> None:
                raise told

            QTimer.singleShot(0, tell)

    return safely


def stroke(
    colour: str, ratio: float = 1.0, style: Qt.PenStyle = Qt.PenStyle.SolidLine
) -> QPen:
    """A pen of a shown pixel on a screen with `ratio` device pixels in it."""
    pen = QPen(QColor(colour), max(1, round(ratio)), style)
    pen.setCosmetic(True)
    return pen


class GuardedLine(pg.InfiniteLine):  # type: ignore[misc]
    """A line across or upright that may fail alone."""

    paint = guarded(pg.InfiniteLine.paint)


RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def _power(value: float) -> str:
    """10 to the power of `value`, which is a digit and zeros, as people write it."""
    ten = math.floor(value + 1e-9)
    if -3 <= ten <= 3:
        return f"{10**value:.{max(0, -ten)}f}"
    digit, power = f"{10 ** (value - ten):.0f}", f"10{str(ten).translate(RAISED)}"
    return power if digit == "1" else f"{digit}·{power}"


class RoundAxis(pg.AxisItem):  # type: ignore[misc]
    """Numbers at 1-2-5 steps, so many that they can be read; a grid if asked for.

    Args:
        orientation: "left" or "bottom".
        apart: least distance between two numbers, px.
        whole: whether only whole numbers mean anything.

    Attributes:
        named: texts at values, ascending, in place of round ones; as many as have room.
    """

    def __init__(self, orientation: str, apart: float, *, whole: bool = False) -> None:
        self._apart, self._least = apart, 1.0 if whole else 0.0
        self.named: dict[float, str] = {}
        super().__init__(orientation, maxTickLength=0)
        self.enableAutoSIPrefix(False)
        self.setStyle(tickFont=sized(11), tickAlpha=255)

    def _updateLabel(self) -> None:
        """Lay the name out where there is one: pyqtgraph does it eleven times."""
        if self.labelText:
            super()._updateLabel()

    def tint(self, tokens: Tokens) -> None:
        """Take on a theme's colours."""
        self.setTextPen(tokens.muted)
        self.setPen(tokens.border_strong)
        self.setTickPen(tokens.grid)

    def tickValues(self, low: float, high: float, size: float) -> Any:
        """The step, and the round values in [low, high]; powers where logarithmic.

        Where less than three powers are in it, their multiples by 2 and 5, too, if
        there is room.
        """
        if self.named:
            inside = [value for value in self.named if low <= value <= high]
            place = size / (high - low)
            few = with_room([place * value for value in inside], NAME)
            return [(1.0, [inside[n] for n in few])]
        if self.logMode:
            tens = range(math.floor(low) - 1, math.ceil(high) + 1)
            roomy = math.log10(2) * size >= self._apart / 2 * (high - low)
            found: list[float] = []
            for among in ((1,), (1, 2, 5), range(1, 10)):
                if len(found) > (2 if roomy else 1):
                    break
                all_ = [ten + math.log10(k) for ten in tens for k in among]
                found = [v for v in all_ if low - 1e-9 <= v <= high + 1e-9]
            return [(1.0, found)]
        step, found = value_ticks(low, high, max(2, int(size / self._apart)))
        if step < self._least:
            step, found = 1.0, [*range(math.ceil(low), math.floor(high) + 1)]
        # one at the very end would be left out for an error of rounding
        air = 1e-9 * (high - low)
        return [(step, [min(max(value, low + air), high - air) for value in found])]

    def tickStrings(self, values: Any, scale: float, spacing: float) -> list[str]:
        """The numbers, with a true minus."""
        if self.named:
            return [self.named[value] for value in values]
        if self.logMode:
            return [_power(value) for value in values]
        return [number(value, decimals(spacing)) for value in values]

    def boundingRect(self) -> QRectF:
        """With room for a number that stands at an end."""
        inner: QRectF = super().boundingRect()
        return inner.adjusted(-AIR, -AIR, AIR, AIR)

    paint = guarded(pg.AxisItem.paint)
