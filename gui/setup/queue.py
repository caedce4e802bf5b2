"""Runs that wait for the one in progress; they can be edited, moved and taken out."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent, QMouseEvent
from PySide6.QtWidgets import QApplication, QFrame, QWidget

from gui.look.theme import Theme
from gui.parts import (
    STRETCH,
    Elided,
    IconButton,
    column,
    empty,
    label,
    push,
    row,
    scrolling,
)
from gui.session.queue import Queued
from gui.setup.estimate import words_of
from gui.state import minutes
from gui.tab_order import reach

BUTTON = 30
ROW, LINE = 59, 39
"""Height of a waiting run with the space below it, px: whole, and without its cost."""

MOST, MOST_LOW = 3, 2
"""Waiting runs that are seen without scrolling, in a high panel and in a low one."""


class QueueCard(QFrame):
    """One waiting run: what it costs, and what can be done with it."""

    edited = Signal(object)
    removed = Signal(object)
    moved = Signal(object, int)

    def __init__(
        self, theme: Theme, item: Queued, place: tuple[int, int], *, editing: bool
    ) -> None:
        super().__init__()
        self.item, self.editing = item, editing
        number, count = place
        self.setProperty("role", "card-edited" if editing else "card")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        cost = "computing its plan …"
        if item.expectation is not None:
            time, samples, disk, heat = words_of(item.expectation.estimate)
            cost = f"{time} · {samples} samples · {disk} · heat {heat}"
        state = ", being edited" if editing else ""
        self.setAccessibleName(f"{number + 1}: {item.title}, {cost}{state}")
        self.setAccessibleDescription("Enter edits it, Delete takes it out")
        self.setToolTip(f"{item.title}: {cost}\nClick or Enter edits it")
        self.buttons: dict[str, QWidget] = {}
        self._whole = column(self, spacing=0)
        top = row((Elided(item.title), 1), spacing=0)
        if editing:
            top.addWidget(label("editing", "pill"))
        low, name = number < count - 1, item.title
        for icon, words, wanted, told in (
            ("edit", f"Edit {name}", not editing, lambda: self.edited.emit(item)),
            ("up", f"Move {name} up", number > 0, lambda: self.moved.emit(item, -1)),
            ("down", f"Move {name} down", low, lambda: self.moved.emit(item, 1)),
            ("close", f"Take {name} out of the queue", True, self._take_out),
        ):
            if wanted:
                button = IconButton(theme, icon, words)
                button.clicked.connect(told)
                self.buttons[icon] = button
                top.addWidget(button)
            elif icon != "edit" and count > 1:  # they stay below each other
                top.addSpacing(BUTTON)
        self._cost = Elided(cost, "small")
        self._whole.addLayout(top)
        self._whole.addWidget(self._cost)

    def show_room(self, *, low: bool) -> None:
        """Leave the cost to the tool tip where there is little room."""
        self._cost.setVisible(not low)
        self._whole.setContentsMargins(10, 2, 2, 2 if low else 5)
        self.setFixedHeight((LINE if low else ROW) - 5)

    def _take_out(self) -> None:
        self.removed.emit(self.item)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Edit the run."""
        if event.button() is Qt.MouseButton.LeftButton:
            self.edited.emit(self.item)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Edit with Enter, where no button has it; take out with Delete."""
        enter = event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter)
        if enter and QApplication.focusWidget() not in self.buttons.values():
            self.edited.emit(self.item)
        elif event.key() == Qt.Key.Key_Delete:
            self._take_out()
        else:
            super().keyPressEvent(event)


class QueueView(QWidget):
    """The waiting runs, in order, each with its cost."""

    edited = Signal(object)
    removed = Signal(object)
    moved = Signal(object, int)
    resumed = Signal()

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self.cards: list[QueueCard] = []
        self._low, self._all = True, False
        self._sum = label("", "small")
        head = row(label("QUEUE", "section"), STRETCH, self._sum)
        tip = "Run one after the other (Ctrl+Shift+Return)"
        self.resume = push("Start the queue", tip=tip)
        self.resume.clicked.connect(self.resumed)
        inner = QWidget()
        self._rows = column(inner, spacing=5)
        self._area = scrolling(inner)
        column(self, head, self.resume, self._area, spacing=5)
        self.show_queue([], held=False)

    def show_queue(
        self, queue: list[Queued], *, held: bool, edited: Queued | None = None
    ) -> None:
        """Show the waiting runs.

        Args:
            queue: in order.
            held: whether they wait to be resumed.
            edited: the one whose parameters stand in the form.
        """
        focus = self._focus()
        empty(self._rows)
        self.cards = []
        for number, item in enumerate(queue):
            place = (number, len(queue))
            card = QueueCard(self._theme, item, place, editing=item is edited)
            card.edited.connect(self.edited)
            card.removed.connect(self.removed)
            card.moved.connect(self.moved)
            self.cards.append(card)
            if item is edited:
                self._reveal(card)
            self._rows.addWidget(card)
        self._fit()
        total = sum(
            item.expectation.estimate.duration for item in queue if item.expectation
        )
        word = "held" if held else "waiting"
        self._sum.setText(f"{len(queue)} {word} · {minutes(total)}" if queue else "")
        self.resume.setVisible(held)
        self.setVisible(bool(queue))
        if focus is not None and self.cards:
            self._give_focus(*focus)

    def show_room(self, *, low: bool, scrolls: bool = False) -> None:
        """Show less of each run where there is little room.

        Args:
            low: without its cost, and few of them.
            scrolls: all of them: what it stands in scrolls.
        """
        if (low, scrolls) != (self._low, self._all):
            self._low, self._all = low, scrolls
            self._fit()
            for card in self.cards:
                if card.editing:
                    self._reveal(card)

    def _fit(self) -> None:
        for card in self.cards:
            card.show_room(low=self._low)
        height, most = (LINE, MOST_LOW) if self._low else (ROW, MOST)
        count = len(self.cards)
        self._area.setFixedHeight(height * (count if self._all else min(count, most)))

    def focus_on(self, item: Queued) -> None:
        """Give a waiting run the keyboard."""
        for card in self.cards:
            if card.item is item:
                card.setFocus()
                QTimer.singleShot(0, card, partial(reach, card))  # has its place then

    def _reveal(self, card: QueueCard) -> None:
        """Scroll to a row, once it has its place."""
        QTimer.singleShot(0, card, lambda: self._area.ensureWidgetVisible(card, 0, 0))

    def _focus(self) -> tuple[int, Queued, str] | None:
        """Which part of which row has the keyboard."""
        has = QApplication.focusWidget()
        for number, card in enumerate(self.cards):
            for name, part in (("card", card), *card.buttons.items()):
                if part is has:
                    return number, card.item, name
        return None

    def _give_focus(self, number: int, item: Queued, name: str) -> None:
        """The keyboard follows its run; where that has gone, the next takes it."""
        there = [card for card in self.cards if card.item is item]
        card = there[0] if there else self.cards[min(number, len(self.cards) - 1)]
        card.buttons.get(name, card).setFocus()
