"""The run browser: what lies in the runs folder, newest first."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent, QMouseEvent, QShowEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QFrame,
    QLabel,
    QWidget,
)

from gui.look.icons import pixmap
from gui.look.theme import Theme
from gui.parts import (
    STRETCH,
    Elided,
    Segments,
    bar,
    column,
    empty,
    label,
    line_edit,
    lines,
    push,
    row,
    scrolling,
    set_role,
    stack,
    with_gutter,
)
from gui.review.entries import SHOWN, Entry
from gui.review.thumbnails import Thumbnails, ThumbnailView
from gui.state import minutes

PILLS = {
    "complete": ("ok", "pill-ok"),
    "running": ("running", "pill"),
    "aborted": ("aborted", "pill-warn"),
    "cut short": ("cut short", "pill-bad"),
    "recovered": ("recovered", "pill-warn"),
    "faulted": ("fault", "pill-bad"),
}


class RunCard(QFrame):
    """One run: name, status, when, how long; a tick to compare."""

    opened = Signal(object)
    chosen = Signal(object)
    ticked = Signal()

    def __init__(self, entry: Entry, theme: Theme) -> None:
        super().__init__()
        self.entry = entry
        self.thumbnail = ThumbnailView(theme)
        self.setProperty("role", "run")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setToolTip(
            f"{entry.title}\n{entry.folder.name}\nEnter or double click opens it, "
            "Space ticks it"
        )
        self.tick = QCheckBox()
        self.tick.setAccessibleName(f"Compare {entry.folder.name}")
        self.tick.setToolTip("Tick two or three runs to compare them")
        self.tick.toggled.connect(self.ticked)
        word, role = PILLS.get(entry.status, (entry.status, "pill"))
        first = row((Elided(entry.title, "strong"), 1))
        first.addWidget(label(word, role), 0, Qt.AlignmentFlag.AlignVCenter)
        kind = "sim" if entry.simulated else "bench"
        when = f"{entry.started} · {minutes(entry.duration)} · {kind}"
        self._eye = QLabel()
        self._eye.setToolTip("On screen")
        theme.changed.connect(self._tint)
        self._theme = theme
        self._tint()
        second = row((Elided(when, "muted"), 1), self._eye, spacing=6)
        words = lines(first, second, spacing=2)
        bar(self, (8, 7, 10, 7), 10, self.thumbnail, (words, 1), self.tick)

    def mark(self, *, chosen: bool, shown: bool) -> None:
        """Show whether it is the chosen one, and whether it is on screen."""
        set_role(self, "run-chosen" if chosen else "run")
        self._eye.setVisible(shown)
        said = f"{self.entry.title}, {self.entry.status}, {self.entry.started}"
        self.setAccessibleName(f"{said}, on screen" if shown else said)

    def _tint(self) -> None:
        self._eye.setPixmap(pixmap("eye", self._theme.tokens.muted, 16))

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Choose the run."""
        self.chosen.emit(self.entry)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Open the run."""
        self.opened.emit(self.entry)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Open with Enter, tick with Space."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.opened.emit(self.entry)
        elif event.key() == Qt.Key.Key_Space:
            self.tick.toggle()
        else:
            super().keyPressEvent(event)

    def focusInEvent(self, event: object) -> None:
        """Choose the run with the keyboard."""
        self.chosen.emit(self.entry)


class RunsView(QWidget):
    """Search, filter, cards, and what to do with the chosen one."""

    opened = Signal(object)
    again = Signal(object)
    compared = Signal(object)

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.cards: list[RunCard] = []
        self._theme = theme
        self.thumbnails = Thumbnails()
        self.thumbnails.made.connect(self._show_thumbnail)
        self._entries: list[Entry] = []
        self._chosen: Entry | None = None
        self._current: Path | None = None
        self.search = line_edit("Search runs", "Search runs …  (Ctrl+F)")
        self.filter = Segments(["All", "Complete", "Sim", "Faults"], "Runs shown")
        self.filter.choose(0)
        self._count = label("", "muted")
        inner = QWidget()
        self._rows = column(inner, spacing=6)
        self.open = push("Open run", "primary")
        self.rerun = push("Re-run with these settings")
        self.compare = push("Compare")
        top = row(self.filter, STRETCH, self._count)
        page = with_gutter(scrolling(inner), self._rows)
        parts = (self.search, top, page, self.open, self.rerun, self.compare)
        stack(self, parts, page)
        self.search.textChanged.connect(self._show)
        self.filter.group.idClicked.connect(self._show)
        self.open.clicked.connect(
            lambda: self._chosen and self.opened.emit(self._chosen)
        )
        self.rerun.clicked.connect(
            lambda: self._chosen and self.again.emit(self._chosen)
        )
        self.compare.clicked.connect(lambda: self.compared.emit(self.ticked()))
        self._show()

    def show_entries(self, found: list[Entry]) -> None:
        """List these runs."""
        if found != self._entries:
            self._entries = found
            self._show()

    def show_current(self, folder: Path | None) -> None:
        """Mark the run on screen."""
        self._current = folder
        self._choose(next((e for e in self._entries if e.folder == folder), None))

    def ticked(self) -> list[Entry]:
        """Runs ticked for comparison."""
        return [card.entry for card in self.cards if card.tick.isChecked()]

    def _show(self, *_: object) -> None:
        words = self.search.text().lower().split()
        chosen = max(self.filter.chosen, 0)
        ticked = {card.entry.folder for card in self.cards if card.tick.isChecked()}
        empty(self._rows)
        self.cards = []
        fitting = [
            e
            for e in self._entries
            if e.shown_under(chosen) and all(w in e.text for w in words)
        ]
        for entry in fitting[:SHOWN]:
            card = RunCard(entry, self._theme)
            card.thumbnail.show_thumbnail(self.thumbnails.of(entry.folder))
            card.tick.setChecked(entry.folder in ticked)
            card.opened.connect(self.opened)
            card.chosen.connect(self._choose)
            card.ticked.connect(self._buttons)
            self.cards.append(card)
            self._rows.addWidget(card)
        self._ask_thumbnails()
        if not fitting:
            text = (
                "No run fits search and filter."
                if self._entries
                else "No runs yet.\nThey are listed here from their first second on."
            )
            none = label(text, "muted", wrap=True)
            none.setAlignment(Qt.AlignmentFlag.AlignCenter)
            none.setContentsMargins(0, 40, 0, 0)
            self._rows.addWidget(none)
        self._rows.addStretch(1)
        many = len(fitting)
        self._count.setText(f"{many} run{'' if many == 1 else 's'}")
        listed = fitting[:SHOWN]
        on_screen = next((e for e in listed if e.folder == self._current), None)
        self._choose(self._chosen if self._chosen in listed else on_screen)

    def showEvent(self, event: QShowEvent) -> None:
        """Pictures are made for those who look."""
        super().showEvent(event)
        self._ask_thumbnails()

    def _ask_thumbnails(self) -> None:
        if self.isVisible():
            ended = [c.entry for c in self.cards if c.entry.status != "running"]
            self.thumbnails.ask([entry.folder for entry in ended])

    def _show_thumbnail(self, folder: Path) -> None:
        for card in self.cards:
            if card.entry.folder == folder:
                card.thumbnail.show_thumbnail(self.thumbnails.of(folder))

    def _choose(self, entry: Entry | None) -> None:
        self._chosen = entry
        for card in self.cards:
            shown = card.entry.folder == self._current
            card.mark(chosen=card.entry == entry, shown=shown)
        self._buttons()

    def _buttons(self) -> None:
        for button, words in (
            (self.open, "Show it in the lanes (Enter)"),
            (self.rerun, "Put its settings into the form, or into the queue"),
        ):
            button.setEnabled(self._chosen is not None)
            button.setToolTip(words if self._chosen else "Choose a run first")
        many = len(self.ticked())
        self.compare.setEnabled(many in (2, 3))
        self.compare.setText(
            f"Compare {many} runs" if many in (2, 3) else "Compare: tick 2 or 3"
        )
        self.compare.setToolTip("Tick two or three runs to compare them")
