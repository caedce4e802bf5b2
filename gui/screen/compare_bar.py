"""The bar that arranges compared runs: how they are aligned and laid out."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtGui import QFont, QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QFrame, QLabel, QWidget

from gui.lanes.compare import MARKS, Comparison, ComparisonRows
from gui.lanes.stack import LaneStack
from gui.lanes.view import TimeView
from gui.look.fonts import sized
from gui.look.theme import Theme
from gui.parts import STRETCH, IconButton, Segments, bar, empty, label, row

ALIGNED = ("start", "step", "cursor")
LAYOUTS = (ComparisonRows.STACK, ComparisonRows.OVERLAY, ComparisonRows.DIFFERENCE)


class CompareBar(QFrame):
    """The runs with colour and marker, how they are aligned and laid out."""

    closed = Signal()

    def __init__(self, stack: LaneStack, view: TimeView, theme: Theme) -> None:
        super().__init__()
        self._stack, self._view, self._theme = stack, view, theme
        self.comparison: Comparison | None = None
        self.align = Segments(["Start", "Step", "Cursor"], "Align")
        for number, words in enumerate(
            (
                "Let the runs begin together",
                "Align the step in the middle of the view",
                "Align the spikes nearest to cursor A, or the steps",
            )
        ):
            self.align.group.button(number).setToolTip(words)
        self.layout_ = Segments(["Stack", "Overlay", "Difference"], "Layout")
        for number, layout in enumerate(LAYOUTS):
            words = layout.value[0].upper() + layout.value[1:]
            self.layout_.group.button(number).setToolTip(words)
        self._names = row(spacing=14)
        parts = (("COMPARE", "section"), ("Align", "muted"), ("Layout", "muted"))
        self._words = [label(text, role) for text, role in parts]
        close = IconButton(theme, "close", "End the comparison")
        title, align, layout_ = self._words
        runs = row(title, self._names, STRETCH, spacing=10)
        choices = (align, self.align, layout_, self.layout_, STRETCH, close)
        self._rows = bar(self, (12, 4, 8, 4), 10, (runs, 1), row(*choices, spacing=10))
        self._buttons = (self.align, self.layout_, close)
        close.clicked.connect(self.closed)
        self.align.group.idClicked.connect(self._align)
        self.layout_.group.idClicked.connect(self._lay_out)
        theme.changed.connect(self._show_names)
        view.cursors_changed.connect(self._allow_cursor)
        self._allow_cursor()
        self.hide()

    def show_comparison(self, comparison: Comparison | None) -> None:
        """Show the bar for a comparison, or hide it."""
        self.comparison = comparison
        self.setVisible(comparison is not None)
        if comparison is not None:
            self.align.choose(0)
            self.layout_.choose(0)
            self._show_names()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Leave words out where there is no room for them; then take two rows."""
        super().resizeEvent(event)
        self._show_names()

    def _show_names(self) -> None:
        """Names in full and all words, or what of them there is room for."""
        members = [] if self.comparison is None else self.comparison.members
        full = [
            self._name(number, member.name) for number, member in enumerate(members)
        ]
        short = [self._name(k, m.name.split()[0]) for k, m in enumerate(members)]
        names = full if self._fits(*full) else short
        low = self._fits(*names)
        way = QBoxLayout.Direction
        self._rows.setDirection(way.LeftToRight if low else way.TopToBottom)
        for word in self._words:
            word.setVisible(self._fits(*names, *self._words))
        empty(self._names)
        for name, member in zip(names, members, strict=True):
            name.setToolTip(f"{member.name}\n{member.source.path}")
            self._names.addWidget(name)

    def _fits(self, *parts: QWidget) -> bool:
        """Whether there is room for these beside the buttons."""
        parts = (*parts, *self._buttons)
        return sum(part.sizeHint().width() + 14 for part in parts) < self.width() - 6

    def _name(self, number: int, said: str) -> QLabel:
        colour = self._theme.tokens.runs[number]
        made = QLabel(f"{MARKS[number]} {said}")
        made.setFont(sized(13, QFont.Weight.DemiBold))
        made.setStyleSheet(f"color: {colour}; font-weight: 600;")
        made.ensurePolished()
        return made

    def _allow_cursor(self) -> None:
        """What is nearest to cursor A can be aligned where there is one."""
        there = self._view.cursors is not None
        self.align.group.button(ALIGNED.index("cursor")).setEnabled(there)

    def _align(self, number: int) -> None:
        if self.comparison is None:
            return
        view, how = self._view, ALIGNED[number]
        if how == "cursor" and view.cursors is not None:
            agreed = self.comparison.align(how, view.cursors[0])
            view.move_cursor(0, agreed)
        else:
            self.comparison.align(how, view.start + view.width / 2)
        self._stack.refresh()

    def _lay_out(self, number: int) -> None:
        if self.comparison is not None:
            self.comparison.layout = LAYOUTS[number]
            self._stack.refresh()
