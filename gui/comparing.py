"""Comparing two or three runs: loading them, and the bar that arranges them."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel

from gui.lanes.compare import MARKS, Comparison, Member
from gui.look.theme import Theme
from gui.parts import IconButton, Segments, empty, label
from gui.review.entries import Entry
from gui.session.threads import start
from tactile_lab.errors import TactileLabError


class CompareBar(QFrame):
    """The runs with colour and marker, how they are aligned and laid out."""

    changed = Signal()
    closed = Signal()

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self.comparison: Comparison | None = None
        self.at = 0.0
        self.align = Segments(["Start", "Step"], "Align")
        self.layout_ = Segments(["Stack", "Overlay"], "Layout")
        self._names = QHBoxLayout()
        self._names.setSpacing(14)
        close = IconButton(theme, "close", "End the comparison")
        row = QHBoxLayout(self)
        row.setContentsMargins(12, 4, 8, 4)
        row.setSpacing(10)
        row.addWidget(label("COMPARE", "section"))
        row.addLayout(self._names)
        row.addStretch(1)
        row.addWidget(label("Align", "muted"))
        row.addWidget(self.align)
        row.addWidget(label("Layout", "muted"))
        row.addWidget(self.layout_)
        row.addWidget(close)
        close.clicked.connect(self.closed)
        self.align.group.idClicked.connect(self._arrange)
        self.layout_.group.idClicked.connect(self._arrange)
        theme.changed.connect(self._show_names)
        self.hide()

    def show_comparison(self, comparison: Comparison | None) -> None:
        """Show the bar for a comparison, or hide it."""
        self.comparison = comparison
        self.setVisible(comparison is not None)
        if comparison is not None:
            self.align.choose(0)
            self.layout_.choose(0)
            self._show_names()

    def look_at(self, time: float) -> None:
        """The step at `time`, s, is the one that "Step" aligns."""
        self.at = time

    def _show_names(self) -> None:
        if self.comparison is None:
            return
        empty(self._names)
        for number, member in enumerate(self.comparison.members):
            name = QLabel(f"{MARKS[number]} {member.name}")
            colour = self._theme.tokens.runs[number]
            name.setStyleSheet(f"color: {colour}; font-weight: 600;")
            name.setToolTip(str(member.source.path))
            self._names.addWidget(name)

    def _arrange(self) -> None:
        if self.comparison is not None:
            how = ("start", "step")[max(self.align.chosen, 0)]
            self.comparison.align(how, self.at)
            self.comparison.stacked = self.layout_.chosen == 0
            self.changed.emit()


def load_comparison(
    chosen: list[Entry],
    loaded: Callable[[Comparison], None],
    failed: Callable[[str], None],
) -> None:
    """Load two or three runs in a background thread, which calls one of the two."""

    def work() -> None:
        from gui.lanes.stored import RunSource

        members: list[Member] = []
        try:
            for entry in chosen[:3]:
                source = RunSource(entry.folder)
                name = entry.folder.name[11:17]
                members.append(Member(f"{name} {entry.scene}".strip(), source))
        except (TactileLabError, OSError) as error:
            for member in members:
                member.source.close()
            failed(str(error))
            return
        loaded(Comparison(members))

    start(work, "compare")
