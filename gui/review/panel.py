"""The right panel: Results, Runs, Manual, Spikes."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QButtonGroup,
    QFrame,
    QStackedWidget,
    QToolButton,
)

from gui.look.theme import Theme
from gui.parts import (
    SCROLL_BAR,
    STRETCH,
    IconButton,
    filled,
    row,
    scrolling,
    stack,
    with_gutter,
)
from gui.review.manual import ManualView
from gui.review.noise_view import NoiseView
from gui.review.results import ResultsView
from gui.review.runs import RunsView
from gui.review.spikes import SpikesView


class ReviewPanel(QFrame):
    """Four tabs."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.setProperty("role", "panel")
        self.setAccessibleName("Results, runs, manual control and spikes")
        self.setMinimumWidth(336)
        self.results = ResultsView(theme)
        self.runs = RunsView(theme)
        self.manual = ManualView(theme)
        self.spikes = SpikesView(theme)
        self.noise = NoiseView(theme)
        self._first = QStackedWidget()
        self._first.addWidget(self.results)
        self._first.addWidget(self.noise)
        self.export = IconButton(theme, "folder", "Open the run's folder")
        self.help = IconButton(theme, "help", "Help on this panel")
        manual = with_gutter(scrolling(self.manual), self.manual.rows)
        self._pages = QStackedWidget()
        self._tabs = QButtonGroup(self)
        head = row(spacing=2)
        pages = {
            "Results": self._first,
            "Runs": self.runs,
            "Manual": manual,
            "Spikes": self.spikes,
        }
        for number, (name, page) in enumerate(pages.items()):
            tab = QToolButton()
            tab.setText(name)
            tab.setCheckable(True)
            tab.setProperty("role", "tab")
            tab.setToolTip(f"{name} (Ctrl+{number + 1})")
            tab.setAccessibleName(f"Tab {name}")
            self._tabs.addButton(tab, number)
            self._pages.addWidget(page)
            head.addWidget(tab)
        filled(head, (STRETCH, self.export, self.help))
        whole = stack(self, (head, self._pages), self._pages, spacing=10)
        whole.setContentsMargins(14, 6, 14 - SCROLL_BAR, 12)
        self._tabs.idClicked.connect(self.show_tab)
        self.show_tab(0)

    @property
    def tab(self) -> int:
        """Number of the tab shown."""
        return self._pages.currentIndex()

    def show_monitor(self, *, on: bool) -> None:
        """Show the noise of what is monitored in place of results, or no longer."""
        self._first.setCurrentWidget(self.noise if on else self.results)

    def show_tab(self, number: int) -> None:
        """0 Results, 1 Runs, 2 Manual, 3 Spikes."""
        self._tabs.button(number).setChecked(True)
        self._pages.setCurrentIndex(number)

    def focus_tab(self) -> None:
        """Give the keyboard to the tab shown; `Tab` goes on into its page."""
        self._tabs.button(self.tab).setFocus(Qt.FocusReason.ShortcutFocusReason)
