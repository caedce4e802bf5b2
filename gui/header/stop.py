"""STOP: always there, always enabled, and it says what the coil was read to do."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import (
    QBrush,
    QColor,
    QFont,
    QLinearGradient,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
)
from PySide6.QtWidgets import QAbstractButton, QSizePolicy, QWidget

from gui.look import tokens as look
from gui.look.fonts import sized
from gui.state import (
    CoilKnowledge,
    CoilView,
    StopText,
    WindowState,
    stop_text,
    stop_truth,
)

WIDTH, HEIGHT = 228, 52

ACTS = "Coil to 0 A, output off, verified by read-back (Esc, F12)"
OLD = "It was off then, and nobody has read it back since: STOP does."

UNDECIDED = (CoilKnowledge.ASKED, CoilKnowledge.FALLING, CoilKnowledge.WAS_OFF)
"""What it claims in amber: not at rest for sure, nor live for sure."""


class StopButton(QAbstractButton):
    """The biggest button of the window. It is never disabled and never moves."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFixedSize(QSize(WIDTH, HEIGHT))
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setToolTip(ACTS)
        self._truth = CoilKnowledge.NONE
        self._fault = False
        self._words = StopText("STOP", "no coil source")
        self.setAccessibleName(self._words.spoken)
        self.setAccessibleDescription("Switches the coil off. Keys: Escape, F12.")

    @property
    def truth(self) -> CoilKnowledge:
        """What the button claims about the coil."""
        return self._truth

    @property
    def words(self) -> StopText:
        """The two lines shown."""
        return self._words

    def show_coil(
        self,
        state: WindowState,
        coil: CoilView | None,
        left_unknown: tuple[str, ...] = (),
    ) -> None:
        """Render from the coil as read back, and those that were left unknown."""
        known = state, coil, left_unknown
        shown = stop_truth(*known), state is WindowState.FAULT, stop_text(*known)
        if shown != (self._truth, self._fault, self._words):
            self._truth, self._fault, self._words = shown
            self.setText(self._words.spoken)
            self.setAccessibleName(self._words.spoken)
            old = self._truth is CoilKnowledge.WAS_OFF
            self.setToolTip(f"{ACTS}. {OLD}" if old else ACTS)
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw body, octagon, words, key and focus ring."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        body = QRectF(self.rect()).adjusted(1, 1, -1, -1)
        ink = self._body(painter, body)
        self._octagon(painter, ink)
        painter.setPen(QColor(ink))
        title = self._words.title
        size = 15 if len(title) < 17 else 13
        painter.setFont(sized(size, QFont.Weight.Bold))
        text = QRectF(54, 8, WIDTH - 100, 20)
        if len(title) >= 17:
            text.setRight(WIDTH - 10)
        painter.drawText(text, Qt.AlignmentFlag.AlignVCenter, title)
        small = self._truth is CoilKnowledge.UNKNOWN
        painter.setFont(sized(11 if small else 12, QFont.Weight.DemiBold))
        painter.drawText(
            QRectF(54, 27, WIDTH - 60, 17),
            Qt.AlignmentFlag.AlignVCenter,
            self._words.detail,
        )
        room = WIDTH - 54 - 46
        if (
            len(title) < 17
            and painter.fontMetrics().horizontalAdvance(self._words.detail) < room
        ):
            self._key(painter, ink)
        if self.hasFocus():
            painter.setPen(QPen(QColor("#FFFFFF"), 2))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRoundedRect(body, 9, 9)

    def _body(self, painter: QPainter, body: QRectF) -> str:
        """Fill the button; the colour of its ink."""
        down = self.isDown()
        if self._truth is CoilKnowledge.UNKNOWN:
            painter.setPen(QPen(QColor(look.HAZARD_YELLOW), 2))
            painter.setBrush(QColor(look.HAZARD_YELLOW))
            painter.drawRoundedRect(body, 9, 9)
            self._stripes(painter, body)
            return look.HAZARD_BLACK
        if self._truth is CoilKnowledge.LIVE:
            fill = QLinearGradient(0, 0, 0, HEIGHT)
            fill.setColorAt(0, QColor(look.STOP_RED_PRESSED if down else "#DB2A3F"))
            fill.setColorAt(1, QColor(look.STOP_RED_PRESSED if down else look.STOP_RED))
            painter.setPen(QPen(QColor("#FF8A94"), 1))
            painter.setBrush(QBrush(fill))
            painter.drawRoundedRect(body, 9, 9)
            return "#FFFFFF"
        if self._truth in UNDECIDED:
            painter.setPen(QPen(QColor(look.LAMP_AMBER), 1.5))
            painter.setBrush(QColor("#3A2606"))
            painter.drawRoundedRect(body, 9, 9)
            painter.setBrush(QBrush(QColor("#6B4708"), Qt.BrushStyle.BDiagPattern))
            painter.drawRoundedRect(body, 9, 9)
            return "#FFD58A"
        if self._truth is CoilKnowledge.OFF and self._fault:
            painter.setPen(QPen(QColor(look.LAMP_RED), 1.5))
            painter.setBrush(QColor(look.STOP_DARK_RED))
            painter.drawRoundedRect(body, 9, 9)
            return "#FFFFFF"
        grey = self._truth is CoilKnowledge.NONE
        painter.setPen(QPen(QColor("#44546A" if grey else "#B44150"), 1.5))
        painter.setBrush(QColor("#2A1A22" if down else "#161F2B"))
        painter.drawRoundedRect(body, 9, 9)
        return "#A9B6C6" if grey else "#FF8F9A"

    def _stripes(self, painter: QPainter, body: QRectF) -> None:
        """Hazard stripes at both ends: worse than live, and not by colour alone."""
        painter.save()
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(look.HAZARD_BLACK))
        for edge in (body.top(), body.bottom() - 6):
            strip = QRectF(body.left() + 4, edge, body.width() - 8, 6)
            painter.setClipRect(strip)
            for x in range(int(strip.left()) - 12, int(strip.right()), 14):
                painter.drawPolygon(
                    QPolygonF(
                        [
                            QPointF(x, strip.bottom()),
                            QPointF(x + 7, strip.bottom()),
                            QPointF(x + 13, strip.top()),
                            QPointF(x + 6, strip.top()),
                        ]
                    )
                )
        painter.restore()

    def _octagon(self, painter: QPainter, ink: str) -> None:
        cx, cy, r, c = 31.0, HEIGHT / 2, 13.0, 5.4
        corners = [
            (-c, -r),
            (c, -r),
            (r, -c),
            (r, c),
            (c, r),
            (-c, r),
            (-r, c),
            (-r, -c),
        ]
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(ink))
        painter.drawPolygon(QPolygonF([QPointF(cx + x, cy + y) for x, y in corners]))
        hole = {
            CoilKnowledge.UNKNOWN: look.HAZARD_YELLOW,
            CoilKnowledge.LIVE: look.STOP_RED,
            **dict.fromkeys(UNDECIDED, "#3A2606"),
        }.get(self._truth, look.STOP_DARK_RED if self._fault else "#161F2B")
        painter.setBrush(QColor(hole))
        if self._truth is CoilKnowledge.UNKNOWN:
            painter.setPen(QColor(hole))
            painter.setFont(sized(19, QFont.Weight.Bold))
            painter.drawText(
                QRectF(cx - r, cy - r, 2 * r, 2 * r), Qt.AlignmentFlag.AlignCenter, "?"
            )
        else:
            painter.drawRoundedRect(QRectF(cx - 4.5, cy - 4.5, 9, 9), 1.5, 1.5)

    def _key(self, painter: QPainter, ink: str) -> None:
        box = QRectF(WIDTH - 42, 16, 29, 20)
        painter.setPen(QPen(QColor(ink), 1))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRoundedRect(box, 4, 4)
        painter.setFont(sized(11, QFont.Weight.DemiBold))
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, "Esc")
