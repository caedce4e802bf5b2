"""An instrument chip: lamp, name, limit, live value."""

from __future__ import annotations

from enum import IntEnum

from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QLabel, QSizePolicy, QWidget

from gui.look import tokens as look
from gui.look.icons import pixmap
from gui.look.tokens import DARK
from gui.parts import bar, label, lines
from gui.state import InstrumentView, Lamp

LAMPS = {
    Lamp.ABSENT: ("lamp-absent", look.LAMP_GREY, "not present"),
    Lamp.WAITING: ("lamp-waiting", look.LAMP_AMBER, "waiting"),
    Lamp.GOOD: ("lamp-good", look.LAMP_GREEN, "good"),
    Lamp.ACTIVE: ("lamp-active", look.LAMP_BLUE, "active"),
    Lamp.WARNING: ("lamp-warning", look.LAMP_AMBER, "attention"),
    Lamp.BAD: ("lamp-bad", look.LAMP_RED, "fault"),
}
"""Icon, colour and words of each: it says its state by shape as well as by colour."""


class ChipDetail(IntEnum):
    """How much of each chip is shown."""

    FULL = 0
    """Lamp, name, detail, value."""
    SHORT = 1
    """Lamp, short name, value."""
    BARE = 2
    """Lamp and value."""
    LAMP = 3
    """The lamp alone; the tool tip has the rest."""


class Chip(QWidget):
    """One instrument in the header.

    It grows with its value and does not shrink again: what stands beside it keeps its
    place while numbers change.
    """

    def __init__(self) -> None:
        super().__init__()
        self.setFixedHeight(44)
        self.setSizePolicy(QSizePolicy.Policy.Maximum, QSizePolicy.Policy.Fixed)
        self._view = InstrumentView("", Lamp.ABSENT)
        self._lamp = QLabel()
        self._lamp.setFixedSize(18, 18)
        self._name = label("", "hname")
        self._detail = label("", "hsub")
        self.value = label("—", "hvalue")
        words = lines(self._name, self._detail, spacing=0)
        self._row = bar(self, (10, 4, 11, 4), 9, self._lamp, words, 6, self.value)
        self._show_lamp()
        self._room = ChipDetail.FULL

    @property
    def lamp(self) -> Lamp:
        """State of the lamp."""
        return self._view.lamp

    def show_room(self, room: ChipDetail) -> None:
        """Show as much as there is room for."""
        self._room = room
        self._arrange()

    def forget_width(self) -> None:
        """Let it shrink again."""
        self.value.setMinimumWidth(0)

    def show_instrument(self, view: InstrumentView) -> bool:
        """Show an instrument's state; whether the chip has become wider by it."""
        before = self._view
        if view == before:
            return False
        self._view = view
        self._show_lamp()
        if view.detail != before.detail:  # other values follow, such as a verdict
            self.forget_width()
        self.value.setText(view.value)
        self._arrange()
        told = " · ".join(text for text in (view.detail, view.value) if text)
        self.setToolTip(f"{view.name}: {told}")
        self.setAccessibleName(f"{view.name}, {view.detail}, {view.value}")
        self.update()
        needed = self.value.sizeHint().width()
        grown = needed > self.value.minimumWidth()
        if grown:
            self.value.setMinimumWidth(needed)
        return grown or view.name != before.name

    def _show_lamp(self) -> None:
        name, colour, words = LAMPS[self._view.lamp]
        self._lamp.setPixmap(pixmap(name, colour, 18))
        self._lamp.setAccessibleName(f"Lamp: {words}")

    def _arrange(self) -> None:
        view, room = self._view, self._room
        self._name.setText(view.name if room is ChipDetail.FULL else view.short)
        self._name.setVisible(room < ChipDetail.BARE)
        self.value.setVisible(room < ChipDetail.LAMP)
        self._detail.setText(view.detail)
        self._detail.setVisible(bool(view.detail) and room is ChipDetail.FULL)
        bare, layout = room >= ChipDetail.BARE, self._row
        layout.setContentsMargins(*((6, 4, 7, 4) if bare else (10, 4, 11, 4)))
        layout.setSpacing(2 if bare else 9)
        layout.invalidate()
        layout.activate()  # its size is asked for at once
        self.updateGeometry()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the chip's body."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        body = QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5)
        bad = self.lamp is Lamp.BAD
        edge = look.LAMP_RED if bad else DARK.header_border
        painter.setPen(QPen(QColor(edge), 1))
        painter.setBrush(QColor("#3A1720" if bad else DARK.header_chip))
        painter.drawRoundedRect(body, 7, 7)
        if bad:
            painter.drawLine(QPointF(body.left() + 1, 8), QPointF(body.left() + 1, 36))
