"""The spikes of what is on screen: one of them, their shape, and their intervals."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget

from gui.look.theme import Theme
from gui.parts import (
    STRETCH,
    IconButton,
    Segments,
    column,
    label,
    push,
    row,
    scrolling,
    stack,
    with_gutter,
)
from gui.plots.numbers import unbroken
from gui.plots.small_plot import SmallPlot
from tactile_lab.plot import Plot

SCOPES = ("Whole run", "In view", "A to B")
"""Of which spikes shapes and intervals are shown."""


class SpikesView(QWidget):
    """Buttons that go from spike to spike, what is known of it, and three plots."""

    stepped = Signal(int)
    """1: on to the next spike; -1: back to the one before."""
    zoomed = Signal()
    """Show the chosen spike so closely that its samples can be told apart."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.scopes = Segments(list(SCOPES), "Which spikes")
        self.scopes.choose(0)
        self.before = push("Previous", tip="The spike before ( , )")
        self.after = push("Next", tip="The next spike ( . )")
        self.closely = IconButton(theme, "zoom", "Zoom to this spike")
        self.facts = label("", "", wrap=True)
        self.said = label("", "", wrap=True)
        self.shape = SmallPlot(theme)
        self.intervals = SmallPlot(theme, "No two spikes in a row.")
        self.succession = SmallPlot(theme, "No two spikes in a row.")
        inner = QWidget()
        go = row(self.before, self.after, self.closely, STRETCH)
        intervals = (self.said, (self.intervals, 1), (self.succession, 1))
        parts = (go, self.facts, (self.shape, 1), *intervals)
        page = with_gutter(scrolling(inner), column(inner, *parts, spacing=9))
        head = row(label("Spikes", "title"), STRETCH, self.scopes)
        stack(self, (head, page), page, spacing=9)
        self.before.clicked.connect(lambda: self.stepped.emit(-1))
        self.after.clicked.connect(lambda: self.stepped.emit(1))
        self.closely.clicked.connect(self.zoomed)

    def show_facts(self, words: str, *, any_spikes: bool, chosen: bool) -> None:
        """Say what is known of the chosen spike, and allow what can be done."""
        self.facts.setText(unbroken(words))
        for button in (self.before, self.after):
            button.setEnabled(any_spikes)
        self.closely.setEnabled(chosen)

    def show_shape(self, plot: Plot | None, nothing: str = "") -> None:
        """Show the shape of spikes, or why it is not known."""
        self.shape.nothing = nothing
        self.shape.show_plot(plot)

    def show_intervals(
        self, words: str, histogram: Plot | None, succession: Plot | None
    ) -> None:
        """Say and show how long intervals are, and how they follow each other."""
        self.said.setText(unbroken(words))
        self.intervals.show_plot(histogram)
        self.succession.show_plot(succession)
