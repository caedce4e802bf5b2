"""The plot of one lane, painted directly: traces, now, cursors, value tag."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFont, QPainter, QPen

from gui.lanes import paint
from gui.lanes.axis import nice_range, number
from gui.lanes.compare import MARKS
from gui.lanes.ground import AXIS, GUTTER, TIME_AXIS, Place, ground, row_names, rows_of
from gui.lanes.lane import BAND, Lane
from gui.lanes.paint import Frame
from gui.lanes.readings import Painted, values_at
from gui.lanes.source import Source
from gui.lanes.view import TimeView
from gui.look.fonts import sized
from gui.look.tokens import Tokens
from tactile_lab.trace import Trace

DOTS = 160
"""Most rate markers drawn; more would be a smear and slow."""

APART = 5
"""Pixels from which on samples are marked one by one."""

NAMES = 14
"""Height at the top lane's top that is left free for the names of holds, px."""


@dataclass
class Options:
    """What all lanes have in common.

    Attributes:
        twin: draw what the model expects, too.
        zoom_box: drag a box to zoom to, instead of the view.
    """

    twin: bool = True
    zoom_box: bool = False


@dataclass(frozen=True)
class Drawing:
    """What is drawn on, where, of what, and in which colours."""

    painter: QPainter
    frame: Frame
    source: Source
    tokens: Tokens


class LanePainter:
    """Paints one lane onto anything that paints: a widget, a picture, an SVG."""

    def __init__(self, lane: Lane, view: TimeView, options: Options) -> None:
        self.lane = lane
        self.view = view
        self.options = options
        self.range = (0.0, 1.0)
        self.manual: tuple[float, float] | None = None
        self.bottom = False
        self.top = False
        self.painted = Painted()

    def forget(self) -> None:
        """Choose a new range."""
        self.range, self.manual = (0.0, 1.0), None

    def paint(
        self, painter: QPainter, size: QSize, source: Source, tokens: Tokens
    ) -> None:
        """Draw the lane at `size`."""
        below = TIME_AXIS if self.bottom else 0
        right = max(size.width() - GUTTER, AXIS + 20)
        bottom = max(size.height() - below - 5, 12)
        lane, view = self.lane, self.view
        count = max(50, int(right - AXIS))
        runs = source.shown(lane, view.start, view.end, count)
        twin = Trace.nothing()
        if self.options.twin:
            twin = source.twin(lane.key, view.start, view.end, count)
            twin = twin.scaled(lane.scale, lane.unit)
        self.painted = Painted(view.start, view.end, tuple(runs))
        room = min(NAMES / max(bottom - 5 - NAMES, NAMES), 1.0) if self.top else 0.0
        self._fit([*runs, twin], source, room)
        low, high = self.range
        frame = Frame(AXIS, right, 5, bottom, view.start, view.end, low, high)
        painter.fillRect(QRectF(0, 0, size.width(), size.height()), QColor(tokens.plot))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        rows = lane.raster or source.stacks(lane)
        ground(painter, frame, source, tokens, Place(self.top, self.bottom, not rows))
        on = Drawing(painter, frame, source, tokens)
        painter.save()
        painter.setClipRect(QRectF(frame.left, 0, right - frame.left, bottom + 4))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, True)
        if len(runs) > 1:
            self._runs(on, runs)
        else:
            self._traces(on, runs[0], twin)
        painter.restore()
        self._cursors(on)
        if len(runs) == 1:
            self._tag(on)

    def _fit(self, traces: list[Trace], source: Source, room: float) -> None:
        """Choose the value range: round, and steady while the data allows it.

        `room` is left free above the data, as a share of its range.
        """
        if self.manual is not None:
            self.range = self.manual
            return
        lane = self.lane
        least = 0.1 * lane.least if source.subtracts(lane) else lane.least
        extents = [one.extent for one in traces if one.extent is not None]
        if lane.key == "force":
            _, force = source.planned(self.view.start, self.view.end)
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
            self.range = (0.0, least)
            return
        wanted = nice_range(low, high, least)
        now = self.range
        roomy = (now[1] - now[0]) > 1.6 * (wanted[1] - wanted[0])
        if low < now[0] or high > now[1] or roomy or now == (0.0, 1.0):
            self.range = wanted

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

    def _traces(self, on: Drawing, measured: Trace, twin: Trace) -> None:
        painter, frame, source, tokens = on.painter, on.frame, on.source, on.tokens
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
        if source.running and frame.start <= source.reach <= frame.end:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
            at = round(frame.x1(source.reach)) + 0.5
            painter.setPen(paint.pen(tokens.border_strong))
            painter.drawLine(QPointF(at, 0), QPointF(at, frame.bottom + 3))

    def _dots(self, on: Drawing, measured: Trace, colour: str) -> None:
        """Mark rates, and samples where they lie apart: between them nobody looked."""
        frame = on.frame
        inside = (measured.time >= frame.start) & (measured.time <= frame.end)
        x, y = frame.x(measured.time[inside]), frame.y(measured.mean[inside])
        rates = self.lane.key == "rate" and x.size <= DOTS
        samples = bool(np.all((measured.low == measured.high)[inside]))
        if rates or (samples and x.size > 1 and np.diff(x).min() >= APART):
            paint.dots(on.painter, x, y, colour)

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
        two = self.options.twin and source.twin_spikes.size > 0
        names = ("meas.", "model") if two else ("meas.",)
        rows = rows_of(frame, len(names))
        painter.setClipping(False)
        row_names(painter, frame, tokens, names)
        both = (source.spikes, source.twin_spikes)
        colours = (tokens.spikes, tokens.twin)
        for span, times, colour in zip(rows, both, colours, strict=False):
            first, last = np.searchsorted(times, [frame.start, frame.end])
            paint.bars(painter, frame, times[first:last], span, paint.pen(colour))

    def _cursors(self, on: Drawing) -> None:
        if self.view.cursors is None:
            return
        painter, frame, tokens = on.painter, on.frame, on.tokens
        colours = tokens.accent, tokens.V_C1
        for name, time, colour in zip("AB", self.view.cursors, colours, strict=True):
            x = frame.x1(time)
            if not frame.left <= x <= frame.right:
                continue
            painter.setPen(QPen(QColor(colour), 1, Qt.PenStyle.DashLine))
            x = round(x) + 0.5
            painter.drawLine(QPointF(x, 0), QPointF(x, frame.bottom + 4))
            if self.top:
                box = QRectF(x - 8, frame.bottom - 14, 16, 17)
                painter.fillRect(box, QColor(colour))
                painter.setPen(QColor(tokens.on_accent))
                painter.setFont(sized(11, QFont.Weight.Bold))
                painter.drawText(box, Qt.AlignmentFlag.AlignCenter, name)

    def _tag(self, on: Drawing) -> None:
        """The value at the right edge of the data in view, beside where it is."""
        painter, frame, source, tokens = on.painter, on.frame, on.source, on.tokens
        if not self.lane.valued:
            return
        edge = source.right_edge(self.view)
        value = values_at(self.lane, source, edge, self.painted)[0]
        if value is None or edge < frame.start:
            return
        y = min(max(frame.y1(value), frame.top + 8), frame.bottom - 8)
        text = number(value, min(self.lane.places, 2))
        box = QRectF(frame.right + 4, y - 9, GUTTER - 9, 18)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, True)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(tokens.trace(self.lane.key)))
        painter.drawRoundedRect(box, 3, 3)
        painter.setPen(QColor(tokens.plot))
        painter.setFont(sized(11, QFont.Weight.DemiBold))
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)
