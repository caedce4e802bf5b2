"""One lane's plot: its traces, its value axis, and what the mouse does to its range."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QPainter, QPen

from gui.lanes import paint
from gui.lanes.across import Across, draw_across
from gui.lanes.compare import MARKS
from gui.lanes.floor import AXIS, GUTTER, LaneContext, row_names, rows_of
from gui.lanes.lane import BAND, Lane
from gui.lanes.paint import Frame
from gui.lanes.readings import COARSE, FINE, Painted, values_at
from gui.lanes.source import Source
from gui.look.tokens import Tokens
from gui.plots.axis import guarded
from gui.plots.numbers import decimals, nice_range, number, signed, value_ticks
from tactile_lab.trace import Trace

DOTS = 160
"""Most rate markers drawn; more would be a smear and slow."""

NEAR = 4
"""Pixels within which a line across is grabbed."""

APART = 5
"""Pixels from which on samples are marked one by one."""

NAMES = 14
"""Height at the top lane's top that is left free for the names of holds, px."""

LINE, CLOSE, HALF = 13, 11, 4
"""Height that a number on the axis needs, at least, and half of its figures', px."""

MOST = 12
"""Numbers on the axis of the highest lane."""


@dataclass(frozen=True)
class Drawing:
    """What is drawn on, where, of what, and in which colours."""

    painter: QPainter
    frame: Frame
    source: Source
    tokens: Tokens


@lru_cache(maxsize=64)
def heights_of(
    low: float, high: float, height: float
) -> list[tuple[str, float, float]]:
    """Numbers on an axis so high, px: each with the heights of its line and its words.

    At an end the words would stand half in the lane beside it, or be cut off there.
    """
    frame = Frame(0.0, 1.0, 0.0, height, 0.0, 1.0, low, high)
    step, values = value_ticks(low, high, min(max(2, int(height / 21)), MOST))
    lines = [round(frame.y1(value)) + 0.5 for value in values]
    if len(values) > 2 and lines[0] - lines[1] < LINE:
        # told beside each other, they would overlap: both ends
        values, lines = [values[0], values[-1]], [lines[0], lines[-1]]
    words = [min(max(y, HALF), height - HALF) for y in lines]
    for end, beside in ((0, 1), (-1, -2)):  # moved inwards, one may lie over the next
        if len(words) > 2 and abs(words[end] - words[beside]) < CLOSE:
            gone = beside if len(words) == 3 else end
            for each in (values, lines, words):
                del each[gone]
    apart = min(LINE, height - 2 * HALF)
    if len(words) == 2 and apart < CLOSE:  # there is room for one
        values, lines, words = values[1:], lines[1:], words[1:]
    elif len(words) == 2 and words[0] - words[1] < apart:
        # not quite beside their lines
        top = max(HALF, min((sum(words) - apart) / 2, height - HALF - apart))
        words = [top + apart, top]
    return [
        (number(value, decimals(step)), y, at)
        for value, y, at in zip(values, lines, words, strict=True)
    ]


class ValueAxis(pg.AxisItem):  # type: ignore[misc]
    """Numbers and grid of a lane; a drag moves its range, the wheel zooms it."""

    def __init__(self, stage: LaneContext, box: LaneBox) -> None:
        self._stage = stage
        # which it holds weakly: a circle would be left to Python's collector
        super().__init__("left", linkView=box)
        self.enableAutoSIPrefix(False)  # it would lay out a name that nobody sees
        self.setZValue(-200)

    @guarded
    def paint(self, painter: QPainter, *__: Any) -> None:
        """Grid, numbers and axis, from texts that are laid out once."""
        box = self.linkedView()
        if box is None or not box.valued:
            return
        tokens = self._stage.tokens
        width, height = box.width(), box.height()
        low, high = box.shown
        found = heights_of(low, high, height)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        painter.setPen(paint.pen(tokens.grid))
        painter.drawLines([QLineF(AXIS, y, AXIS + width, y) for _, y, _ in found])
        for words, _, y in found:
            at = QPointF(AXIS - 8, y)
            paint.write(painter, at, words, tokens.muted, align=1.0)
        painter.setPen(paint.pen(tokens.border_strong))
        painter.drawLine(QPointF(AXIS - 0.5, -1), QPointF(AXIS - 0.5, height))


class LaneBox(pg.ViewBox):  # type: ignore[misc]
    """The plot of one lane. Its range is automatic until a hand changes or locks it.

    Attributes:
        painted: what is shown, as the numbers on the card want it.
        locked: whether the range stays as it is.
        levels: where lines across are, in shown units; two at most.
        wanted: threshold that a hand drags the run's to, V; None while nobody does.
        top: whether it is the highest, where the names of holds are.
    """

    def __init__(self, lane: Lane, stage: LaneContext) -> None:
        super().__init__(enableMenu=False, defaultPadding=0.0)
        self.setMouseEnabled(x=False, y=True)
        self.lane, self._stage = lane, stage
        self.painted, self._twin = Painted(), Trace.nothing()
        self.locked = self.top = False
        self.levels: list[float] = []
        self.wanted: float | None = None
        self.axis = ValueAxis(stage, self)
        self.forget()

    @property
    def shown(self) -> tuple[float, float]:
        """The range of values, in shown units."""
        low, high = self.viewRange()[1]
        return low, high

    @property
    def valued(self) -> bool:
        """Whether it has a value axis; rows of runs or spikes have none."""
        return not (self.lane.raster or self._stage.source.stacks(self.lane))

    def forget(self) -> None:
        """Choose a new range, and go on choosing."""
        self.locked, self.painted = False, Painted()
        self.setRange(xRange=(0, 1), yRange=(0, 1))

    def choose_range(self, *, locked: bool = True) -> None:
        """Before a hand changes the range: what is seen is kept for the way back."""
        self._stage.view.note()
        self.locked = locked

    def mouseDragEvent(self, ev: Any, axis: int | None = None) -> None:
        """A drag on the axis moves the range."""
        self.choose_range()
        super().mouseDragEvent(ev, axis)

    def place(self, top: float, bottom: float, right: float) -> None:
        """Take the plot's place in the scene, px."""
        self.setGeometry(QRectF(AXIS, top, right - AXIS, max(bottom - top, 7.0)))
        self.axis.setGeometry(QRectF(0, top, AXIS, max(bottom - top, 7.0)))

    def prepare(self) -> None:
        """Read what is to be shown, and choose the range."""
        stage, lane, view = self._stage, self.lane, self._stage.view
        count = max(50, int(self.width()))
        runs = stage.source.shown(lane, view.start, view.end, count)
        self._twin = Trace.nothing()
        if stage.twin:
            twin = stage.source.twin(lane.key, view.start, view.end, count)
            self._twin = twin.scaled(lane.scale, lane.unit)
        self.painted = Painted(view.start, view.end, tuple(runs))
        high = self.height()
        room = min(NAMES / max(high - NAMES, NAMES), 1.0) if self.top else 0.0
        if not self.locked:
            self._fit([*runs, self._twin], stage.source, room)

    def zoom(self, factor: float, y: float) -> None:
        """Zoom the values by `factor` (above 1: in) about a height in the scene, px."""
        low, high = self.shown
        about = self.value_at(y)
        self.choose_range()
        self.setYRange(
            about - (about - low) / factor, about + (high - about) / factor, padding=0
        )

    def move_by(self, part: float) -> None:
        """Look at higher values, by a part of the range; at lower ones below 0."""
        low, high = self.shown
        by = part * (high - low)
        self.choose_range()
        self.setYRange(low + by, high + by, padding=0)

    def show_between(self, low: float, high: float, *, locked: bool = True) -> None:
        """Show these values; unless `locked` until others come into view."""
        self.locked = locked
        self.setYRange(low, high, padding=0)

    def boundingRect(self) -> QRectF:
        """The plot with its axis and its tag."""
        inner: QRectF = self.rect()
        return inner.adjusted(-AXIS, -6, GUTTER, 6)

    @guarded
    def paint(self, painter: QPainter, *__: Any) -> None:
        """Draw the traces as they were prepared."""
        stage, runs = self._stage, list(self.painted.runs)
        if not runs:
            return
        wide, tall = self.width(), self.height()
        frame = self._frame(wide)
        on = Drawing(painter, frame, stage.source, stage.tokens)
        with paint.clipped(painter, QRectF(0, -5, wide, tall + 9)):
            painter.setRenderHint(QPainter.RenderHint.Antialiasing, True)
            across = [*self._levels(on.tokens)]
            if len(runs) > 1:
                self._runs(on, runs)
            else:
                self._beyond(on)
                self._traces(on, runs[0], self._twin)
                across += self._threshold(on.source.threshold, on.tokens)
            draw_across(painter, frame, across, on.tokens.plot)
        if len(runs) == 1:
            self._tag(on)

    def level_at(self, y: float) -> int | None:
        """Number of the line across at a height in the scene, px."""
        frame = self._frame(0.0)
        for number_, level in enumerate(self.levels):
            if abs(frame.y1(level) + self.y() - y) <= NEAR:
                return number_
        return None

    def threshold_at(self, y: float) -> bool:
        """Whether the threshold lies at a height in the scene, px."""
        level = self._stage.source.threshold
        if level is None or self.lane.key != "V_K":
            return False
        return bool(abs(self._frame(0.0).y1(level) + self.y() - y) <= NEAR)

    def value_at(self, y: float) -> float:
        """The value at a height in the scene, px, in shown units."""
        low, high = self.shown
        share: float = (self.geometry().bottom() - y) / max(self.height(), 1.0)
        return low + share * (high - low)

    def _frame(self, width: float) -> Frame:
        view, (low, high) = self._stage.view, self.shown
        return Frame(0.0, width, 0.0, self.height(), view.start, view.end, low, high)

    def _levels(self, tokens: Tokens) -> Iterator[Across]:
        """The lines across, with their values and what lies between the two."""
        low, high = self.shown
        places = max(self.lane.places, decimals((high - low) / 200))
        for number_, level in enumerate(self.levels):
            words = f"{number(level, places)} {self.lane.unit}"
            if number_:
                words += f"  Δ {signed(level - self.levels[0], places)}"
            yield Across(level, words, tokens.accent, Qt.PenStyle.DashLine, right=True)

    def _threshold(self, level: float | None, tokens: Tokens) -> Iterator[Across]:
        """The level at which spikes were counted, and where a hand drags it to."""
        if level is None or self.lane.key != "V_K":
            return
        dots = Qt.PenStyle.DotLine
        words = f"threshold {number(level, 2)} V"
        yield Across(level, words, tokens.muted, dots, right=False)
        if self.wanted is not None:
            words = f"next {number(self.wanted, 2)} V"
            yield Across(self.wanted, words, tokens.accent, dots, right=False)

    def _beyond(self, on: Drawing) -> None:
        """Shade where the input left its range: the trace is a limit there."""
        painter, frame, tokens = on.painter, on.frame, on.tokens
        named = False
        for start, end in on.source.beyond(self.lane.key).tolist():
            if end < frame.start or start > frame.end:
                continue
            left, right = max(frame.x1(start), 0.0), min(frame.x1(end), frame.right)
            part = QRectF(left, -5, max(right - left, 1.0), frame.bottom + 9)
            painter.fillRect(part, QColor(tokens.amber_soft))
            painter.fillRect(
                part.adjusted(0, 0, 0, 3 - part.height()), QColor(tokens.amber)
            )
            if not named:
                at = QPointF(left + 4, frame.bottom - 7)
                paint.write(painter, at, "beyond the input's range", tokens.amber)
                named = True

    def _fit(self, traces: list[Trace], source: Source, room: float) -> None:
        """Choose the value range: round, and steady while the data allows it.

        `room` is left free above the data, as a share of its range.
        """
        lane = self.lane
        least = 0.1 * lane.least if source.subtracts(lane) else lane.least
        extents = [one.extent for one in traces if one.extent is not None]
        if lane.key == "force":
            _, force = source.planned(self._stage.view.start, self._stage.view.end)
            if force.size:
                extents.append((float(force.min()) * 1e3, float(force.max()) * 1e3))
        if lane.zero:
            extents.append((0.0, 0.0))
        if lane.symmetric:
            reach = max([abs(v) for e in extents for v in e] + [least / 2])
            extents = [(-reach, reach)]
        if not extents:
            return
        low, high = min(e[0] for e in extents), max(e[1] for e in extents)
        high += room * (high - low)
        if low == high == 0.0:
            self.setYRange(0.0, least, padding=0)
            return
        wanted = nice_range(low, high, least)
        now = self.shown
        roomy = (now[1] - now[0]) > 1.6 * (wanted[1] - wanted[0])
        if low < now[0] or high > now[1] or roomy or now == (0.0, 1.0):
            self.setYRange(*wanted, padding=0)

    def _runs(self, on: Drawing, runs: list[Trace]) -> None:
        """Several runs, each in its colour; stacked ones in rows of their own."""
        painter, frame, source, tokens = on.painter, on.frame, on.source, on.tokens
        raster = self.lane.raster
        rows: list[tuple[float, float]] = []
        if raster or source.stacks(self.lane):
            rows = rows_of(frame, len(runs))
            painter.setClipping(False)
            row_names(painter, frame, tokens, MARKS[: len(runs)], tokens.runs)
            painter.setClipping(True)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, not raster)
        for number_, (member, run) in enumerate(zip(source.members, runs, strict=True)):
            line = paint.pen(tokens.runs[number_])
            if raster:
                paint.bars(painter, frame, member.spikes, rows[number_], line)
                continue
            own = frame
            if rows:
                top, bottom = rows[number_]
                own = replace(frame, top=top, bottom=bottom)
            shown = run if self.lane.key == "V_K" else run.means()
            paint.trace(painter, own, shown, line)
            if self.lane.key == "rate":  # one alone makes no line
                self._dots(on, run, tokens.runs[number_])

    def _traces(self, on: Drawing, measured: Trace, twin: Trace) -> None:
        painter, frame, tokens = on.painter, on.frame, on.tokens
        lane, force = self.lane, self.lane.key == "force"
        colour = tokens.trace(lane.key)
        if lane.raster:
            self._raster(on)
        elif lane.symmetric:
            self._tolerance(on)
        elif force:
            paint.outline(painter, frame, measured, colour, tokens.plot)
            self._plan(on)
            measured = Trace.nothing()
        if lane.averaged:
            spiky = lane.key == "V_K"
            if not spiky:
                tint = paint.mixed(tokens.twin, tokens.plot, 0.2)
                paint.envelope(painter, frame, twin, tint)
            tint = paint.mixed(colour, tokens.plot, 0.3)
            paint.envelope(painter, frame, measured, tint)
            shown = twin if spiky else twin.means()
            paint.trace(painter, frame, shown, paint.pen(tokens.twin))
            paint.trace(painter, frame, measured.means(), paint.pen(colour))
            if spiky:
                paint.pulses(painter, frame, measured, colour)
        else:
            paint.trace(painter, frame, twin, paint.pen(tokens.twin))
            paint.trace(painter, frame, measured, paint.pen(colour))
        if lane.valued and not force:
            self._dots(on, measured, colour)
        if lane.key == "rate":
            self._laws(on)

    def _dots(self, on: Drawing, measured: Trace, colour: str) -> None:
        """Mark rates, and samples where they lie apart: between them nobody looked."""
        frame = on.frame
        first = np.searchsorted(measured.time, frame.start)
        last = np.searchsorted(measured.time, frame.end, side="right")
        if last - first > max(DOTS, (frame.right - frame.left) / APART + 1):
            return  # they lie closer than is marked
        shown = measured[first:last]
        x, y = frame.x(shown.time), frame.y(shown.mean)
        rates = self.lane.key == "rate" and x.size <= DOTS
        if rates or (shown.flat and x.size > 1 and np.diff(x).min() >= APART):
            paint.dots(on.painter, x, y, colour)

    def _laws(self, on: Drawing) -> None:
        """The fitted rates, dashed, and what they are."""
        painter, frame, ink = on.painter, on.frame, on.tokens.text
        line = QPen(QColor(ink), 1, Qt.PenStyle.DashLine)
        laws = [
            one
            for one in self._stage.laws
            if one.time[-1] > frame.start and one.time[0] < frame.end
        ]
        for one in laws:
            paint.polyline(painter, frame.x(one.time), frame.y(one.mean), line)
        for step, why in on.source.unrated:
            if step.start < frame.end and frame.start < step.end:
                at = QPointF(max(frame.left, frame.x1(step.start)) + 5, 9)
                text = f"no rate: {why.partition(';')[0]}"
                text = paint.shortened(text, frame.right - at.x() - 3)
                paint.write_on(painter, at, text, ink, on.tokens.plot)
                break
        if laws:
            at = QPointF(frame.right - 5, 9)
            paint.write(painter, at, "dashed: fitted α exp(βt) + γ", ink, align=1.0)

    def _plan(self, on: Drawing) -> None:
        frame, source = on.frame, on.source
        time, force = source.planned(frame.start, frame.end)
        if not source.running or time.size < 2:
            return
        ahead = time > source.reach
        at = np.interp(source.reach, time, force)
        t = np.concatenate([[source.reach], time[ahead]])
        f = np.concatenate([[at], force[ahead]]) * self.lane.scale
        line = QPen(QColor(on.tokens.trace("force")), 1, Qt.PenStyle.DashLine)
        paint.polyline(on.painter, frame.x(t), frame.y(f), line)

    def _tolerance(self, on: Drawing) -> None:
        painter, frame, tokens = on.painter, on.frame, on.tokens
        half = BAND * self.lane.scale
        top, bottom = frame.y1(half), frame.y1(-half)
        painter.fillRect(
            QRectF(frame.left, top, frame.right - frame.left, bottom - top),
            QColor(tokens.green_soft),
        )
        painter.setPen(QPen(QColor(tokens.green), 1, Qt.PenStyle.DotLine))
        for y in (top, bottom):
            painter.drawLine(QPointF(frame.left, y), QPointF(frame.right, y))

    def _raster(self, on: Drawing) -> None:
        painter, frame, source, tokens = on.painter, on.frame, on.source, on.tokens
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        two = self._stage.twin and source.twin_spikes.size > 0
        names = ("meas.", "model") if two else ("meas.",)
        rows = rows_of(frame, len(names))
        painter.setClipping(False)
        row_names(painter, frame, tokens, names)
        both = (source.spikes, source.twin_spikes)
        colours = (tokens.spikes, tokens.twin)
        for span, times, colour in zip(rows, both, colours, strict=False):
            first, last = np.searchsorted(times, [frame.start, frame.end])
            paint.bars(painter, frame, times[first:last], span, paint.pen(colour))

    def _tag(self, on: Drawing) -> None:
        """The value at the right edge of the data in view, beside where it is."""
        painter, frame, source, tokens = on.painter, on.frame, on.source, on.tokens
        if not self.lane.valued:
            return
        edge = source.right_edge(self._stage.view, self.lane)
        widest = COARSE if source.running else FINE
        value = values_at(self.lane, source, edge, self.painted, widest)[0]
        if value is None or edge < frame.start:
            return
        y = min(max(frame.y1(value), frame.top + 8), frame.bottom - 8)
        text = number(value, min(self.lane.places, 2))
        box = QRectF(frame.right + 4, y - 9, GUTTER - 9, 18)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, True)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(tokens.trace(self.lane.key)))
        painter.drawRoundedRect(box, 3, 3)
        weight = QFont.Weight.DemiBold
        paint.write(painter, box.center(), text, tokens.plot, align=0.5, weight=weight)
