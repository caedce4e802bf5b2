"""Runs that wait for the one in progress; they can be moved and taken out any time."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout, QSizePolicy, QWidget

from gui.look.theme import Theme
from gui.parts import IconButton, column, empty, label, panel, push, scrolling
from gui.session.session import Queued
from gui.setup.estimate import words_of
from gui.state import minutes

ROW = 50
MOST, LOW = 3, 800
"""Rows shown without scrolling; one less in windows lower than `LOW` px."""


class QueueView(QWidget):
    """The waiting runs, in order, each with its cost."""

    removed = Signal(int)
    moved = Signal(int, int)
    resumed = Signal()

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        whole = column(self, spacing=5)
        head = QHBoxLayout()
        head.addWidget(label("QUEUE", "section"))
        head.addStretch(1)
        self._sum = label("", "small")
        head.addWidget(self._sum)
        whole.addLayout(head)
        self.resume = push("Resume the queue")
        self.resume.setToolTip("It is held since the last STOP or fault")
        self.resume.clicked.connect(self.resumed)
        whole.addWidget(self.resume)
        inner = QWidget()
        self._rows = column(inner, spacing=5)
        self._area = scrolling(inner)
        whole.addWidget(self._area)
        self.show_queue([], held=False)

    def show_queue(self, queue: list[Queued], *, held: bool) -> None:
        """Show the waiting runs, and whether they wait to be resumed."""
        empty(self._rows)
        for number, item in enumerate(queue):
            self._rows.addWidget(self._row(number, len(queue), item))
        room = MOST if self.window().height() > LOW else MOST - 1
        self._area.setFixedHeight(ROW * min(len(queue), room))
        total = sum(
            item.expectation.estimate.duration for item in queue if item.expectation
        )
        word = "held" if held else "waiting"
        self._sum.setText(f"{len(queue)} {word} · {minutes(total)}" if queue else "")
        self.resume.setVisible(held)
        self.setVisible(bool(queue))

    def _row(self, number: int, count: int, item: Queued) -> QFrame:
        made = panel("card")
        made.setFixedHeight(ROW - 5)
        name = label(item.title)
        name.setToolTip(item.request.command())
        cost = label("computing its plan …", "small")
        if item.expectation is not None:
            time, samples, disk, heat = words_of(item.expectation.estimate)
            cost.setText(f"{time} · {samples} samples · {disk} · heat {heat}")
        for words_ in (name, cost):
            words_.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        made.setToolTip(f"{item.title}: {cost.text()}")
        made.setAccessibleName(f"{number + 1}: {item.title}, {cost.text()}")
        both = QWidget()
        words = column(both, spacing=0)
        words.addWidget(name)
        words.addWidget(cost)
        row = QHBoxLayout(made)
        row.setContentsMargins(10, 2, 2, 2)
        row.setSpacing(0)
        row.addWidget(both, 1)
        for icon, by, way in (("up", -1, "up"), ("down", 1, "down")):
            if 0 <= number + by < count:
                button = IconButton(self._theme, icon, f"Move {item.title} {way}")
                button.clicked.connect(
                    lambda _=False, by=by: self.moved.emit(number, by)
                )
                row.addWidget(button)
        out = IconButton(self._theme, "close", f"Take {item.title} out of the queue")
        out.clicked.connect(lambda: self.removed.emit(number))
        row.addWidget(out)
        return made
