"""Runs that wait for the one in progress; they can be moved and taken out any time."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout, QWidget

from gui.look.theme import Theme
from gui.parts import IconButton, column, empty, label, panel
from gui.session.session import Queued
from gui.state import minutes


class QueueView(QWidget):
    """The waiting runs, in order."""

    removed = Signal(int)
    moved = Signal(int, int)

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        whole = column(self, spacing=6)
        head = QHBoxLayout()
        head.addWidget(label("QUEUE", "section"))
        head.addStretch(1)
        self._sum = label("", "small")
        head.addWidget(self._sum)
        whole.addLayout(head)
        inner = QWidget()
        self._rows = column(inner, spacing=5)
        whole.addWidget(inner)
        self.show_queue([])

    def show_queue(self, queue: list[Queued]) -> None:
        """Show the waiting runs."""
        empty(self._rows)
        for number, item in enumerate(queue):
            self._rows.addWidget(self._row(number, item))
        total = sum(item.duration for item in queue)
        self._sum.setText(f"{len(queue)} waiting · {minutes(total)}" if queue else "")
        self.setVisible(bool(queue))

    def _row(self, number: int, item: Queued) -> QFrame:
        made = panel("card")
        row = QHBoxLayout(made)
        row.setContentsMargins(10, 2, 2, 2)
        row.setSpacing(4)
        name = label(item.title)
        name.setToolTip(item.request.command())
        row.addWidget(name, 1)
        row.addWidget(label(minutes(item.duration), "muted"))
        if number:
            up = IconButton(self._theme, "up", f"Move {item.title} up")
            up.clicked.connect(lambda: self.moved.emit(number, -1))
            row.addWidget(up)
        out = IconButton(self._theme, "close", f"Take {item.title} out of the queue")
        out.clicked.connect(lambda: self.removed.emit(number))
        row.addWidget(out)
        return made
