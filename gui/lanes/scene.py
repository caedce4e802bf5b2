"""All lanes in one scene: what goes across them, and what the mouse does to time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import pyqtgraph as pg
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QFont,
    QGuiApplication,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QWheelEvent,
)

from gui.lanes import paint
from gui.lanes.box import LaneBox
from gui.lanes.floor import (
    AXIS,
    TIME_AXIS,
    Background,
    LaneContext,
    Layer,
    cursor_times,
    hold_names,
    note_texts,
    time_words,
)
from gui.lanes.paint import Frame
from gui.lanes.readings import values_at
from gui.look.fonts import sized
from gui.look.tokens import Tokens
from gui.plots.axis import guarded
from gui.plots.numbers import number

GRAB = 5
"""Pixels within which a cursor is grabbed."""

LEAST_BOX = 10
"""Height from which on a zoom box is meant for the values, too, px."""


Places = list[tuple[LaneBox, float, float]]
"""Visible lanes with top and bottom, px."""


class Marks(Layer):
    """What goes across all lanes: now, cursors, the chosen spike, ...

    Attributes:
        boxes: of the visible lanes, from the top.
        pointer: where the crosshair is, px; None where there is none.
        box: that is being drawn to zoom to, px.
    """

    def __init__(self, stage: LaneContext) -> None:
        super().__init__(stage, 100)
        self.boxes: list[LaneBox] = []
        self.pointer: QPointF | None = None
        self.box: QRectF | None = None

    @guarded
    def paint(self, painter: QPainter, *__: Any) -> None:
        """Lines from top to bottom, and what is written beside them."""
        stage, tokens = self._stage, self._stage.tokens
        frame, source = stage.whole(), stage.source
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        hold_names(painter, stage)
        note_texts(painter, stage)
        if source.running and frame.start <= source.reach <= frame.end:
            pen = paint.pen(tokens.border_strong)
            self._upright(painter, frame.x1(source.reach), pen)
        chosen = stage.view.spike
        if chosen is not None and frame.start <= chosen <= frame.end:
            pen = paint.pen(tokens.V_K, Qt.PenStyle.DotLine)
            self._upright(painter, frame.x1(chosen), pen)
        self._cursors(painter, frame)
        if self.pointer is not None and frame.left <= self.pointer.x() <= frame.right:
            self._cross(painter, self.pointer)
        if self.box is not None:
            soft = QColor(tokens.accent)
            soft.setAlpha(40)
            painter.setBrush(soft)
            painter.setPen(paint.pen(tokens.accent))
            painter.drawRect(self.box)

    def _upright(self, painter: QPainter, x: float, pen: QPen) -> None:
        frame, x = self._stage.whole(), round(x) + 0.5
        painter.setPen(pen)
        painter.drawLine(QPointF(x, frame.top), QPointF(x, frame.bottom))

    def _cursors(self, painter: QPainter, frame: Frame) -> None:
        """A and B, with their names above and their times below."""
        tokens = self._stage.tokens
        colours = tokens.accent, tokens.V_C1
        told = cursor_times(self._stage.view, frame)
        for name, (x, words, side), colour in zip("AB", told, colours, strict=False):
            if not frame.left <= x <= frame.right:
                continue
            self._upright(painter, x, paint.pen(colour, Qt.PenStyle.DashLine))
            foot = self.boxes[0].geometry().bottom() if self.boxes else frame.bottom
            box = QRectF(round(x) - 7.5, foot - 14, 16, 17)
            painter.fillRect(box, QColor(colour))
            painter.setPen(QColor(tokens.on_accent))
            painter.setFont(sized(11, QFont.Weight.Bold))
            painter.drawText(box, Qt.AlignmentFlag.AlignCenter, name)
            self._tell(painter, QPointF(x, frame.bottom + 11), words, side)

    def _cross(self, painter: QPainter, at: QPointF) -> None:
        """Time and value under the pointer, and every lane's value at that time."""
        stage, tokens = self._stage, self._stage.tokens
        view, frame = stage.view, stage.whole()
        time = view.start + (at.x() - AXIS) / (stage.right - AXIS) * view.width
        pen = paint.pen(tokens.faint, Qt.PenStyle.DotLine)
        self._upright(painter, at.x(), pen)
        foot = QPointF(at.x(), frame.bottom + 11)
        self._tell(painter, foot, time_words(view, time), 0.5)
        for box in self.boxes:
            place, lane = box.geometry(), box.lane
            inside = place.top() <= at.y() <= place.bottom()
            if inside and box.valued:
                painter.setPen(pen)
                painter.drawLine(QPointF(AXIS, at.y()), QPointF(stage.right, at.y()))
                here = number(box.value_at(at.y()), lane.places)
                self._tell(painter, QPointF(AXIS - 2, at.y()), here, 1.0)
            if not lane.raster:
                found = values_at(lane, stage.source, time, box.painted)
                told = ["—" if v is None else number(v, lane.places) for v in found]
                where = QPointF(at.x() + 6, place.top() + 9)
                self._tell(painter, where, f"{' · '.join(told)} {lane.unit}", 0.0)

    def _tell(self, painter: QPainter, at: QPointF, words: str, align: float) -> None:
        tokens = self._stage.tokens
        paint.write_on(painter, at, words, tokens.text, tokens.panel, align)


class LaneScene(pg.GraphicsView):  # type: ignore[misc]
    """The plots of all lanes; drags pan, the wheel zooms, cursors are grabbed."""

    box_zoomed = Signal(float, float)
    menu_asked = Signal(object, object, object)
    """The lane under the pointer, and where that is: in the scene, on the screen."""
    threshold_dragged = Signal(float)
    """To where, V."""
    drawn = Signal()

    def __init__(self, stage: LaneContext, places: Callable[[], Places]) -> None:
        super().__init__()
        self.stage = stage
        self._places = places
        self._placed: tuple[Places, QSize] = ([], QSize())
        self.boxes: list[LaneBox] = []
        self.crosshair = False
        self._cursor: int | None = None
        self._level: tuple[LaneBox, int] | None = None
        self._threshold: LaneBox | None = None
        self._pressed: QPointF | None = None
        self._from = 0.0
        self._marks = Marks(stage)
        self._floor = Background(stage)
        for item in (self._floor, self._marks):
            self.addItem(item)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setAccessibleName("Lanes against time")
        # its floor is opaque
        self.setBackground(None)
        self.setCacheMode(pg.GraphicsView.CacheModeFlag.CacheNone)
        opaque = Qt.WidgetAttribute.WA_OpaquePaintEvent
        self.viewport().setAttribute(opaque)
        # all of it moves with time: looking for what has changed costs and finds all
        update = pg.GraphicsView.ViewportUpdateMode.NoViewportUpdate
        self.setViewportUpdateMode(update)

    def show_boxes(self, boxes: Sequence[LaneBox]) -> None:
        """Have these lanes instead of those before."""
        for box in self.boxes:
            self.removeItem(box.axis)
            self.removeItem(box)
        self.boxes[:] = boxes
        self._placed = [], QSize()  # a new one that is hidden moves none, and is seen
        for box in boxes:
            self.addItem(box)
            self.addItem(box.axis)

    def _arrange(self) -> None:
        """Put visible lanes beside their cards, and leave the others out."""
        places, stage = self._places(), self.stage
        if (places, self.size()) == self._placed:
            return
        self._placed = places, self.size()
        stage.width, stage.height = float(self.width()), float(self.height())
        stage.lanes = [(top, bottom) for _, top, bottom in places]
        self._marks.boxes = shown = [box for box, *_ in places]
        for box in self.boxes:
            for item in (box, box.axis):
                item.setVisible(box in shown)
            box.top = bool(shown) and box is shown[0]
        for box, top, bottom in places:
            below = TIME_AXIS if box is shown[-1] else 0
            box.place(top + 5, bottom - below - 5, stage.right)
        for item in (self._floor, self._marks):
            item.prepareGeometryChange()

    def refresh(self) -> None:
        """Draw anew, soon."""
        self.viewport().update()

    def prepare(self) -> None:
        """Read what all visible lanes show."""
        self._arrange()
        for box in self.boxes:
            if box.isVisible():
                box.prepare()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Read what is to be shown, and draw it."""
        self.prepare()
        super().paintEvent(event)
        self.drawn.emit()

    def draw_onto(self, painter: QPainter, target: QRectF, tokens: Tokens) -> None:
        """Draw all lanes elsewhere, in the colours of another theme."""
        kept, pointer = self.stage.tokens, self._marks.pointer
        self.stage.tokens, self._marks.pointer = tokens, None
        self.prepare()
        self.scene().prepareForPaint()
        self.scene().render(painter, target, QRectF(self.rect()))
        self.stage.tokens, self._marks.pointer = kept, pointer

    def toggle_crosshair(self) -> None:
        """Show time and values under the pointer, or no longer."""
        self.crosshair = not self.crosshair
        self._marks.pointer = None
        self.refresh()

    def copy(self) -> None:
        """Put what is seen on the clipboard."""
        QGuiApplication.clipboard().setPixmap(self.grab())

    def time_at(self, x: float) -> float:
        """Time under a pixel, s."""
        share = (x - AXIS) / max(1.0, self.stage.right - AXIS)
        return self.stage.view.start + share * self.stage.view.width

    def lane_at(self, y: float) -> LaneBox | None:
        """The lane at a height."""
        shown = (box for box in self.boxes if box.isVisible())
        return next(
            (b for b in shown if b.y() - 5 <= y <= b.geometry().bottom() + 5), None
        )

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom about the pointer, pan with Shift; with Ctrl zoom the values."""
        view, at, held = self.stage.view, event.position(), event.modifiers()
        turns = (event.angleDelta().y() or event.angleDelta().x()) / 120
        box = self.lane_at(at.y())
        if at.x() < AXIS or held & Qt.KeyboardModifier.ControlModifier:
            if box is not None:
                box.zoom(1.25**turns, at.y())
                self.refresh()
        elif held & Qt.KeyboardModifier.ShiftModifier:
            view.pan(-0.1 * turns * view.width)
        else:
            view.zoom(1.25**turns, self.time_at(at.x()))
        event.accept()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Start to drag a cursor, the view, a zoom box or a lane's values."""
        at = event.position()
        if event.button() is Qt.MouseButton.RightButton:
            box = self.lane_at(at.y())
            if box is not None:
                screen = event.globalPosition().toPoint()
                self.menu_asked.emit(box, at, screen)
        elif at.x() < AXIS:
            super().mousePressEvent(event)
        elif event.button() is Qt.MouseButton.LeftButton:
            self._pressed, self._from = at, self.stage.view.start
            self._cursor = self._near_cursor(at.x())
            self._level = self._near_level(at) if self._cursor is None else None
            if self._cursor is None and self._level is None:
                self._threshold = self._near_threshold(at)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag on, or move the crosshair."""
        at, view, pressed = event.position(), self.stage.view, self._pressed
        if pressed is None:
            super().mouseMoveEvent(event)
            self._show_shape(at)
        elif self._cursor is not None:
            view.move_cursor(self._cursor, self.time_at(at.x()))
        elif self._level is not None:
            box, which = self._level
            box.levels[which] = box.value_at(at.y())
        elif self._threshold is not None:
            self._threshold.wanted = self._threshold.value_at(at.y())
        elif self.stage.zoom_box:
            self._marks.box = self._boxed(pressed, at)
        elif abs(pressed.x() - at.x()) > 3:
            pixels = max(1.0, self.stage.right - AXIS)
            moved = (pressed.x() - at.x()) * view.width / pixels
            view.show_span(self._from + moved, view.width)
        self._marks.pointer = at if self.crosshair else None
        if self.crosshair or event.buttons():
            self.refresh()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End of the drag."""
        box, pressed = self._marks.box, self._pressed
        self._pressed = self._cursor = self._level = self._marks.box = None
        dragged, self._threshold = self._threshold, None
        if dragged is not None and dragged.wanted is not None:
            if dragged.wanted > 0:
                self.threshold_dragged.emit(dragged.wanted)
            dragged.wanted = None
        if pressed is None:
            super().mouseReleaseEvent(event)
        elif box is not None and box.width() > 4:
            lane, whole = self.lane_at(pressed.y()), self.stage.whole().bottom
            a, b = self.time_at(box.left()), self.time_at(box.right())
            if lane is None or box.height() >= whole:
                self.box_zoomed.emit(a, b)
            else:
                low, high = lane.value_at(box.bottom()), lane.value_at(box.top())
                self.box_zoomed.emit(a, b)  # which notes the range of before
                lane.show_between(low, high)
        self.refresh()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Show the whole run; on an axis, choose the range again."""
        at = event.position()
        box = self.lane_at(at.y())
        if at.x() >= AXIS:
            self.stage.view.show_all()
        elif box is not None:
            box.choose_range(locked=False)
        self.refresh()

    def leaveEvent(self, event: QEvent) -> None:
        """The crosshair goes with the pointer."""
        super().leaveEvent(event)
        self._marks.pointer = None
        self.refresh()

    def _boxed(self, a: QPointF, b: QPointF) -> QRectF:
        """The box from a to b, within a lane; through all of them where it is flat."""
        lane = self.lane_at(a.y())
        box = QRectF(a, b).normalized()
        if lane is not None and lane.valued and box.height() >= LEAST_BOX:
            return box.intersected(lane.geometry())
        return QRectF(box.left(), 0, box.width(), self.stage.whole().bottom)

    def _show_shape(self, at: QPointF) -> None:
        shape = Qt.CursorShape.ArrowCursor
        if self._near_cursor(at.x()) is not None:
            shape = Qt.CursorShape.SizeHorCursor
        elif (
            self._near_level(at)
            or self._near_threshold(at)
            or (at.x() < AXIS and self.lane_at(at.y()))
        ):
            shape = Qt.CursorShape.SizeVerCursor
        self.viewport().setCursor(shape)

    def _near_level(self, at: QPointF) -> tuple[LaneBox, int] | None:
        """The line across at a place: its lane and its number."""
        box = self.lane_at(at.y())
        which = None if box is None else box.level_at(at.y())
        return None if box is None or which is None else (box, which)

    def _near_threshold(self, at: QPointF) -> LaneBox | None:
        """The lane whose threshold is at a place."""
        box = self.lane_at(at.y())
        return box if box is not None and box.threshold_at(at.y()) else None

    def _near_cursor(self, x: float) -> int | None:
        frame = self.stage.whole()
        for which, time in enumerate(self.stage.view.cursors or ()):
            if abs(frame.x1(time) - x) <= GRAB:
                return which
        return None
