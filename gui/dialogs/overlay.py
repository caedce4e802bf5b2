"""A card above the dimmed window. The header and STOP stay uncovered and usable."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QEvent, QObject, QRect, Qt
from PySide6.QtGui import QColor, QHideEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import (
    QApplication,
    QFrame,
    QGraphicsDropShadowEffect,
    QLabel,
    QLayout,
    QScrollArea,
    QWidget,
)
from shiboken6 import isValid

from gui.parts import STRETCH, bar, lines, row
from gui.tab_order import in_reading_order

HEADER = 68

LEAST = 60
"""Height below which a page of a card is not made, px."""


class Overlay(QWidget):
    """Covers the window below the header and centres a card.

    Args:
        window: what is covered.
        width: of the card, px.
    """

    def __init__(self, window: QWidget, width: int) -> None:
        super().__init__(window)
        self._window = window
        self.card = QFrame(self)
        self.card.setProperty("role", "dialog")
        self._width = width
        self._before: QWidget | None = None
        self._page: tuple[QWidget, int] | None = None
        shadow = QGraphicsDropShadowEffect(self.card)
        shadow.setBlurRadius(40)
        shadow.setOffset(0, 10)
        shadow.setColor(QColor(0, 0, 0, 110))
        self.card.setGraphicsEffect(shadow)
        self.card.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        window.installEventFilter(self)
        self.hide()

    def ask_with(
        self,
        sign: QLabel,
        words: Sequence[QWidget | QLayout],
        answers: Sequence[QWidget],
    ) -> None:
        """Lay the card out as a question: a sign, words below each other, answers."""
        buttons = row(STRETCH, *answers)
        said = lines(*words, 8, buttons, spacing=8)
        whole = bar(self.card, (24, 22, 22, 20), 16)
        whole.addWidget(sign, 0, Qt.AlignmentFlag.AlignTop)
        whole.addLayout(said, 1)

    def give_room(self, page: QWidget, height: int) -> None:
        """Have a part of the card, which scrolls, be as high as there is room for.

        Args:
            page: the part.
            height: that it has where there is room enough, px.
        """
        self._page = page, height

    def open(self) -> None:
        """Show the card, and give it the keyboard unless it has it."""
        self._place()
        self.show()
        self.raise_()
        focus = QApplication.focusWidget()
        if focus is None or not self.isAncestorOf(focus):
            self._before = focus
            inside = in_reading_order(self.card)
            if inside:
                inside[0].setFocus()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Follow the window's size."""
        if event.type() == QEvent.Type.Resize and self.isVisible():
            self._place()
        return False

    def hideEvent(self, event: QHideEvent) -> None:
        """Give the keyboard back to what had it, or the window; Qt picks any button."""
        focus, before = QApplication.focusWidget(), self._before
        self._before = None
        page = self._window.findChild(QWidget, "page")
        if page is None or focus is None or not self.isAncestorOf(focus):
            return
        there = before is not None and isValid(before)
        if before is not None and there and before.isEnabled() and before.isVisible():
            before.setFocus()
        else:
            page.setFocus()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Dim what lies below, once where cards lie over each other."""
        cards = self._window.findChildren(Overlay)
        if next(card for card in cards if card.isVisible()) is self:
            QPainter(self).fillRect(self.rect(), QColor(8, 12, 20, 120))

    def _place(self) -> None:
        window = self._window
        self.setGeometry(0, HEADER, window.width(), window.height() - HEADER)
        width = min(self._width, self.width() - 24)
        self.card.setFixedWidth(width)
        self.card.ensurePolished()
        room = self.height() - 24
        if self._page is not None:
            page, most = self._page
            page.setFixedHeight(most)
            self._unwrap(width)
            over = max(self.card.sizeHint().height() - room, 0)
            page.setFixedHeight(max(most - over, LEAST))
        self._unwrap(width)
        height = min(self.card.sizeHint().height(), room)
        self.card.setGeometry(
            QRect(
                (self.width() - width) // 2,
                max((self.height() - height) // 2 - 20, 12),
                width,
                height,
            )
        )

    def _unwrap(self, width: int) -> None:
        """Give wrapped labels the height they need at this width."""
        layout = self.card.layout()
        wrapped = [x for x in self.card.findChildren(QLabel) if _wraps_alone(x)]
        for one in wrapped:
            one.setMinimumHeight(0)
        self.card.resize(width, max(self.card.height(), 400))
        for _ in range(2):
            if layout is not None:
                layout.invalidate()
                layout.activate()
            for one in wrapped:
                if one.isVisibleTo(self.card):
                    one.setMinimumHeight(max(one.heightForWidth(one.width()), 0))


def _wraps_alone(one: QLabel) -> bool:
    """Whether nobody else gives the label its height: scroll areas do for theirs."""
    parent: QWidget | None = one
    while one.wordWrap() and parent is not None:
        if isinstance(parent, QScrollArea):
            return False
        parent = parent.parentWidget()
    return one.wordWrap()
