"""What lies below the traces of all lanes: bands of holds, the future, time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import pyqtgraph as pg
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter

from gui.lanes import paint
from gui.lanes.expected import Stretch
from gui.lanes.paint import Frame
from gui.lanes.source import Source
from gui.lanes.view import TimeView
from gui.look.tokens import LIGHT, Tokens
from gui.plots.axis import guarded
from gui.plots.numbers import decimals, multiples, number, value_ticks
from tactile_lab.trace import Trace

AXIS = 52
"""Width of the value axis, px; the same in every lane so that time lines up."""

GUTTER = 56
"""Width right of the plot for the value tag, px."""

CLOSE = 3
"""Pixels for each hold below which they are painted as one."""

FLAG = 190
"""Longest text of a note in the lanes, px; the card about the run has all of it."""

LETTERS = 11
"""Height that a name in a row needs, px."""

BESIDE = 80
"""Pixels between the cursors from which on their times stand below their lines."""

LAST = 15
"""Pixels at the right end in which no number has room beside the name of the axis."""

TIME_AXIS = 22
"""Height of the time axis below the last lane, px."""


@dataclass
class LaneContext:
    """What all lanes have in common.

    Attributes:
        view: the visible time.
        source: what is shown.
        tokens: its colours.
        width, height: of all lanes together, px.
        lanes: (top, bottom) of each visible lane, px; the last has the time axis.
        twin: draw what the model expects, too.
        laws: of the rate, as they were fitted.
        zoom_box: drag a box to zoom to, instead of the view.
    """

    view: TimeView
    source: Source = field(default_factory=Source)
    tokens: Tokens = LIGHT
    width: float = 0.0
    height: float = 0.0
    lanes: list[tuple[float, float]] = field(default_factory=list)
    twin: bool = True
    laws: Sequence[Trace] = ()
    zoom_box: bool = False

    @property
    def right(self) -> float:
        """Right end of the plots, px."""
        return max(self.width - GUTTER, AXIS + 20.0)

    def frame(self, top: float, bottom: float) -> Frame:
        """The map from the visible time to pixels, between two heights."""
        view = self.view
        return Frame(AXIS, self.right, top, bottom, view.start, view.end, 0.0, 1.0)

    def whole(self) -> Frame:
        """That of all lanes together."""
        tops, bottoms = zip(*self.lanes or [(0.0, 1.0)], strict=True)
        return self.frame(min(tops), max(bottoms) - TIME_AXIS - 2)


class Layer(pg.GraphicsObject):  # type: ignore[misc] # pyqtgraph has no types
    """Something painted once over all lanes.

    Args:
        stage: what the lanes show, and how large they are.
        height: above or below the lanes' own items, as Qt's z.
    """

    def __init__(self, stage: LaneContext, height: int) -> None:
        super().__init__()
        self._stage = stage
        self.setZValue(height)

    def boundingRect(self) -> QRectF:
        """All lanes."""
        return QRectF(0, 0, self._stage.width, self._stage.height)


class Background(Layer):
    """What lies below all lanes."""

    def __init__(self, stage: LaneContext) -> None:
        super().__init__(stage, -300)

    @guarded
    def paint(self, painter: QPainter, *__: Any) -> None:
        """Bands of holds, the future, the grid of time, names, borders of lanes."""
        stage, tokens = self._stage, self._stage.tokens
        frame, source, plain = stage.whole(), stage.source, QColor(tokens.plot)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        for top, bottom in (0.0, frame.top), (frame.bottom, stage.height):
            painter.fillRect(QRectF(0, top, stage.width, bottom - top), plain)
        across = pairwise([*grounds(source, frame, tokens), (stage.width, "")])
        for (left, colour), (right, _) in across:
            # a pixel more, which the next one covers: rounding leaves none between them
            part = QRectF(left, frame.top, right - left + 1, frame.bottom - frame.top)
            painter.fillRect(part, QColor(colour))
        _time_grid(painter, frame, stage)
        _flags(painter, frame, source.notes, tokens)
        for _, bottom in stage.lanes:
            # above it as much is left free as between a lane and the next
            painter.fillRect(QRectF(0, bottom - 2, stage.width, 2), plain)
            border = QRectF(0, bottom, stage.width, 1)
            painter.fillRect(border, QColor(tokens.border))


def grounds(source: Source, frame: Frame, tokens: Tokens) -> list[tuple[float, str]]:
    """Colours below the plots, each from a place, px, on: no pixel is filled twice.

    On a fine screen one fill of all lanes costs a tenth of a frame.
    """
    found = [(0.0, tokens.plot)]
    for hold, left, right in _visible(source, frame):
        while found[-1][0] > left:  # of two that overlap, the later one is seen
            found.pop()
        colour = tokens.sunken if hold.pause else tokens.band
        found += [(left, colour), (right, tokens.plot)]
    if source.running and source.reach < frame.end:
        now = max(frame.x1(source.reach), frame.left)
        found = [one for one in found if one[0] < now] + [(now, tokens.ahead)]
    return [*(one for one in found if one[0] < frame.right), (frame.right, tokens.plot)]


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


def hold_names(painter: QPainter, stage: LaneContext) -> None:
    """Write the names of the holds at the top of the highest lane."""
    for hold, left, right in _visible(stage.source, stage.whole()):
        if right - left > 34:
            text = "recovery" if hold.pause else hold.label
            text = paint.shortened(text, right - left - 8)
            paint.write(painter, QPointF(left + 5, 10), text, stage.tokens.muted)


def note_texts(painter: QPainter, stage: LaneContext) -> None:
    """As much of the text of each note as there is room for, beside its flag.

    On a ground of its own: lines of the grid would strike it through.
    """
    frame, tokens = stage.whole(), stage.tokens
    notes = sorted(n for n in stage.source.notes if frame.start <= n[0] <= frame.end)
    places = [round(frame.x1(time)) + 0.5 for time, _ in notes]
    ends = pairwise([*places, frame.right])
    for (_, text), (x, after) in zip(notes, ends, strict=True):
        text = paint.shortened(text, min(after - x, FLAG) - 12)
        at = QPointF(x + 8, frame.top + 23)
        if text:
            paint.write_on(painter, at, text, tokens.accent, tokens.plot)


def _flags(
    painter: QPainter, frame: Frame, notes: list[tuple[float, str]], tokens: Tokens
) -> None:
    """A flag at the time of each note; `note_texts` writes what it says."""
    inside = sorted(note for note in notes if frame.start <= note[0] <= frame.end)
    places = [round(frame.x1(time)) + 0.5 for time, _ in inside]
    for x in places:
        painter.setPen(paint.pen(tokens.accent, Qt.PenStyle.DashLine))
        painter.drawLine(QLineF(x, frame.top, x, frame.bottom))
        painter.fillRect(QRectF(x, frame.top + 17, 4, 12), QColor(tokens.accent))


def time_words(view: TimeView, time: float) -> str:
    """A time as finely as the view tells it."""
    step = view.width / 2000
    return f"{number(time, min(6, max(2, decimals(step))))} s"


def cursor_times(view: TimeView, frame: Frame) -> list[tuple[float, str, float]]:
    """Place of each cursor, px, its time in words, and what part of them stands there.

    Where both are close, one stands left of its line and the other right.
    """
    across = [frame.x1(time) for time in view.cursors or ()]
    close = len(across) == 2 and abs(across[1] - across[0]) < BESIDE
    sides = [float(x == min(across)) if close else 0.5 for x in across]
    words = [time_words(view, time) for time in view.cursors or ()]
    return list(zip(across, words, sides, strict=True))


def round_times(view: TimeView, frame: Frame) -> list[tuple[float, str, bool]]:
    """Place of each round time, px, its number, and whether it has room below.

    It has none before the start, at the right end, and where a cursor's time stands.
    """
    taken = []
    for x, words, side in cursor_times(view, frame):
        wide = paint.width_of(words) + 6
        if frame.left <= x <= frame.right:
            taken.append((x - side * wide, x + (1 - side) * wide))
    room = frame.right - frame.left
    end = frame.start + view.width * (1 - LAST / room)
    # of those that are told, not of all: one alone says nothing of the scale
    step, _ = value_ticks(max(frame.start, 0.0), end, max(2, int(room / 90)))
    found = []
    for value in multiples(step, frame.start, frame.end):
        words = number(value, decimals(step))
        x, half = round(frame.x1(value)) + 0.5, paint.width_of(words) / 2
        free = all(x + half < left or x - half > right for left, right in taken)
        inside = value >= -1e-12 and x < frame.right - LAST + 1
        found.append((x, words, free and inside))
    return found


def _time_grid(painter: QPainter, frame: Frame, stage: LaneContext) -> None:
    tokens, found = stage.tokens, round_times(stage.view, frame)
    painter.setPen(paint.pen(tokens.grid))
    painter.drawLines([QLineF(x, frame.top, x, frame.bottom) for x, _, _ in found])
    for x, words, told in found:
        if told:
            at = QPointF(x, frame.bottom + 11)
            paint.write(painter, at, words, tokens.muted, align=0.5)
    painter.setPen(paint.pen(tokens.border_strong))
    y = frame.bottom + 0.5
    painter.drawLine(QPointF(frame.left, y), QPointF(frame.right, y))
    at = QPointF(frame.right + 4, frame.bottom + 11)
    paint.write(painter, at, "time / s", tokens.muted)


def row_names(
    painter: QPainter,
    frame: Frame,
    tokens: Tokens,
    names: Sequence[str],
    colours: Sequence[str] = (),
) -> None:
    """Write the names of the rows of a raster or a stack beside them.

    In a lane so low that they would lie over each other there are none.
    """
    if frame.bottom - frame.top < LETTERS * len(names):
        return
    for number_, (a, b) in enumerate(rows_of(frame, len(names))):
        colour = colours[number_] if colours else tokens.muted
        at = QPointF(frame.left - 8, (a + b) / 2)
        paint.write(painter, at, names[number_], colour, align=1.0)


def rows_of(frame: Frame, count: int) -> list[tuple[float, float]]:
    """Top and bottom of `count` rows of a raster or a stack, px."""
    each = (frame.bottom - frame.top) / count
    air = 0.2 * each if count == 1 else 2.5
    return [
        (frame.top + k * each + air, frame.top + (k + 1) * each - air)
        for k in range(count)
    ]
