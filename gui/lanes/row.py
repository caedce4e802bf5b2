"""One lane on screen: its card with numbers, and its plot."""

from __future__ import annotations

from PySide6.QtCore import QPoint, Qt, Signal
from PySide6.QtGui import QMouseEvent, QPainter, QPaintEvent, QWheelEvent
from PySide6.QtWidgets import QFrame, QSizePolicy, QWidget

from gui.lanes.axis import number, signed
from gui.lanes.card import LaneCard
from gui.lanes.compare import MARKS
from gui.lanes.expected import starts
from gui.lanes.ground import AXIS, GUTTER
from gui.lanes.lane import Lane
from gui.lanes.plot import LanePainter, Options
from gui.lanes.readings import (
    count_between,
    interval_text,
    newest,
    values_at,
    view_text,
)
from gui.lanes.source import Source
from gui.lanes.view import TimeView
from gui.look.theme import Theme
from gui.parts import bar


class LanePlot(QWidget):
    """The painted plot; drags pan, the wheel zooms, cursors are grabbed."""

    box_zoomed = Signal(float, float)
    painted = Signal()

    def __init__(
        self, lane: Lane, view: TimeView, options: Options, theme: Theme
    ) -> None:
        super().__init__()
        self.painter = LanePainter(lane, view, options)
        self.source = Source()
        self._view, self._theme = view, theme
        self._from: tuple[QPoint, float] | None = None
        self._to: QPoint | None = None
        self._cursor: int | None = None
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMinimumHeight(34)
        self.setMouseTracking(True)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.setAccessibleName(f"{lane.plain} against time")

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the lane and the zoom box."""
        painter = QPainter(self)
        self.painter.paint(painter, self.size(), self.source, self._theme.tokens)
        if self._boxes and self._from is not None and self._to is not None:
            painter.setPen(Qt.GlobalColor.gray)
            a, b = self._from[0].x(), self._to.x()
            painter.drawRect(min(a, b), 1, abs(b - a), self.height() - 3)
        painter.end()
        self.painted.emit()

    @property
    def _boxes(self) -> bool:
        """Whether dragging draws a box to zoom to."""
        return self.painter.options.zoom_box

    def time_at(self, x: float) -> float:
        """Time under a pixel, s."""
        share = (x - AXIS) / max(1, self.width() - GUTTER - AXIS)
        return self._view.start + share * self._view.width

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom about the pointer; with Shift, pan."""
        turns = (event.angleDelta().y() or event.angleDelta().x()) / 120
        if event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
            self._view.pan(-0.1 * turns * self._view.width)
        else:
            self._view.zoom(1.25**turns, self.time_at(event.position().x()))
        event.accept()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Start to drag a cursor, the view or a zoom box."""
        if event.button() is not Qt.MouseButton.LeftButton:
            return
        at = event.position().toPoint()
        self._cursor = self._near_cursor(at.x())
        self._from = (at, self._view.start)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag on."""
        at = event.position().toPoint()
        if self._from is None:
            near = self._near_cursor(at.x()) is not None
            shape = Qt.CursorShape.SizeHorCursor if near else Qt.CursorShape.ArrowCursor
            self.setCursor(shape)
        elif self._cursor is not None:
            self._view.move_cursor(self._cursor, self.time_at(at.x()))
        elif self._boxes:
            self._to = at
            self.update()
        else:
            pixels = max(1, self.width() - GUTTER - AXIS)
            moved = (self._from[0].x() - at.x()) * self._view.width / pixels
            if abs(self._from[0].x() - at.x()) > 3:
                self._view.show_span(self._from[1] + moved, self._view.width)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End of the drag."""
        if self._boxes and self._from is not None and self._to is not None:
            a, b = self.time_at(self._from[0].x()), self.time_at(self._to.x())
            if abs(self._to.x() - self._from[0].x()) > 4:
                self.box_zoomed.emit(min(a, b), max(a, b))
        self._from = self._to = self._cursor = None
        self.update()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Show the whole run."""
        self._view.show_all()

    def _near_cursor(self, x: float) -> int | None:
        for number_, time in enumerate(self._view.cursors or ()):
            share = (time - self._view.start) / self._view.width
            at = AXIS + share * (self.width() - GUTTER - AXIS)
            if abs(at - x) <= 5:
                return number_
        return None


class LaneRow(QFrame):
    """Card and plot side by side."""

    def __init__(
        self, lane: Lane, view: TimeView, options: Options, theme: Theme
    ) -> None:
        super().__init__()
        self.lane = lane
        self.card = LaneCard(lane, theme)
        self.plot = LanePlot(lane, view, options, theme)
        self._view, self._theme = view, theme
        bar(self, (0, 0, 0, 0), 0, self.card, (self.plot, 1))
        self.plot.painted.connect(self._follow_picture)
        theme.changed.connect(self.tint)
        self.tint()

    def show_numbers(self, source: Source) -> None:
        """Update the card.

        It has the newest value while the run lasts; afterwards what is at the right
        edge of the view, as the tag has it, and of spikes how many are in view.
        """
        lane, card, view = self.lane, self.card, self._view
        edge = source.right_edge(view)
        if len(source.members) > 1:
            self._show_runs(source, edge)
        elif lane.raster:
            self._show_spikes(source, edge)
        else:
            known = None if source.running else self._values(source, edge)[0]
            card.show_value(newest(lane, source) if source.running else known)
            card.show_more(self._at_cursors(source))

    def _show_spikes(self, source: Source, edge: float) -> None:
        spikes, steps, view = source.spikes, starts(source.holds), self._view
        if source.running:
            words = interval_text(spikes, source.reach, steps)
            self.card.show_value(newest(self.lane, source))
        else:
            words = view_text(spikes, view.start, edge, steps)
            seen = count_between(spikes, view.start, edge)
            self.card.show_value(float(seen), "in view")
        if view.cursors is not None:
            words = f"{count_between(spikes, *sorted(view.cursors))} between A and B"
        self.card.show_more(words)

    def _show_runs(self, source: Source, edge: float) -> None:
        """One line per run."""
        cursors = self._view.cursors
        less = f"less {MARKS[0]}" if source.subtracts(self.lane) else ""
        if self.lane.raster:
            low, high = sorted(cursors or (self._view.start, self._view.end))
            counts = [float(count_between(m.spikes, low, high)) for m in source.members]
            self.card.show_runs(counts, None, "A to B" if cursors else "in view")
        elif cursors is None:
            self.card.show_runs(self._values(source, edge), None, less)
        else:
            a, b = (self._values(source, time) for time in cursors)
            changes = [_change(one, two) for one, two in zip(a, b, strict=True)]
            self.card.show_runs(a, changes, f"{less} at A".strip())

    def _at_cursors(self, source: Source) -> str:
        """Values at A and B and their difference; "" without cursors."""
        cursors, tokens = self._view.cursors, self._theme.tokens
        if cursors is None:
            return ""
        a, b = (self._values(source, time)[0] for time in cursors)
        change, places = _change(a, b), min(self.lane.places, 2)
        delta = "—" if change is None else signed(change, places)
        words = [
            f'<span style="color:{colour};font-weight:600">{name}</span> '
            f"{'—' if value is None else number(value, places)}"
            for name, value, colour in (("A", a, tokens.accent), ("B", b, tokens.V_C1))
        ]
        return f"{' &nbsp;'.join(words)} &nbsp;Δ {delta}"

    def _values(self, source: Source, time: float) -> tuple[float | None, ...]:
        return values_at(self.lane, source, time, self.plot.painter.painted)

    def _follow_picture(self) -> None:
        """What is at the right edge has moved with the picture."""
        if not self.plot.source.running:
            self.show_numbers(self.plot.source)

    def tint(self) -> None:
        """Colour the swatch as theme and source want it."""
        # in a comparison colour means run, so the lane's own colour steps back
        self.card.tint(grey=len(self.plot.source.members) > 1)
        self.plot.update()


def _change(a: float | None, b: float | None) -> float | None:
    return None if a is None or b is None else b - a
