"""The run browser: what lies in the runs folder, found, sorted and tidied."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from PySide6.QtCore import QPoint, Qt, QTimer, Signal
from PySide6.QtGui import QKeySequence, QShortcut, QShowEvent
from PySide6.QtWidgets import QWidget

from gui.look.theme import Theme
from gui.parts import (
    STRETCH,
    Combo,
    IconButton,
    Segments,
    column,
    empty,
    label,
    line_edit,
    push,
    row,
    scrolling,
    stack,
    with_gutter,
)
from gui.popup_menu import Menu
from gui.review.run_card import RunCard, differing
from gui.review.thumbnails import Thumbnails
from gui.tab_order import reach
from tactile_lab.quantity import count
from tactile_lab.store.summary import RunSummary

PAGE = 20
"""Runs listed at once, 0.25 MB each; a button lists as many more."""

FILTERS: dict[str, Callable[[RunSummary], bool]] = {
    "All": lambda entry: True,
    "Complete": lambda entry: entry.status == "complete",
    "Sim": lambda entry: entry.simulated is True,
    "Faults": lambda entry: entry.status not in ("complete", "running"),
    "★": lambda entry: entry.starred,
}

ORDERS: dict[str, tuple[Callable[[RunSummary], Any], bool]] = {
    "Newest first": (lambda entry: (entry.started, entry.name), True),
    "Oldest first": (lambda entry: (entry.started, entry.name), False),
    "By name": (lambda entry: entry.title.casefold(), False),
    "Longest first": (lambda entry: entry.duration or 0.0, True),
    "Most spikes first": (lambda entry: entry.spikes or 0, True),
}
"""Key and whether the largest comes first."""


class RunsView(QWidget):
    """Search, filter, order, cards, and what to do with the chosen one."""

    opened = Signal(object)
    again = Signal(object)
    compared = Signal(object)
    recovered = Signal(object)
    about_asked = Signal(object)
    starred = Signal(object)
    deleted = Signal(object)
    refresh_asked = Signal()

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.cards: list[RunCard] = []
        self._theme = theme
        self.thumbnails = Thumbnails()
        self.thumbnails.made.connect(self._show_thumbnail)
        self._entries: list[RunSummary] = []
        self._listed = PAGE
        self._chosen: RunSummary | None = None
        self._focused: Path | None = None
        self._current: frozenset[Path] = frozenset()
        self.search = line_edit(
            "Search runs", "Search names, notes, levels …  (Ctrl+F)"
        )
        self.filter = Segments(list(FILTERS), "Runs shown")
        self.filter.choose(0)
        self.order = Combo()
        self.order.setAccessibleName("Order of runs")
        self.order.addItems(list(ORDERS))
        self._count = label("", "muted")
        self.refresh = IconButton(theme, "refresh", "Read the folder anew (F5)")
        inner = QWidget()
        self._rows = column(inner, spacing=6)
        self.open = push("Open run", "primary")
        self.recover = push("Recover", "primary")
        self.rerun = push("Re-run with these settings")
        self.about = push("About …", tip="Name, tags, notes, settings, log")
        self.compare = push("Compare")
        head = row((self.search, 1), self.refresh, spacing=4)
        top = row(self.order, STRETCH, self._count)
        self._page = page = with_gutter(scrolling(inner), self._rows)
        first = row((self.open, 3), (self.recover, 3), (self.about, 2), spacing=6)
        parts = (head, self.filter, top, page, first, self.rerun, self.compare)
        stack(self, parts, page)
        self.search.textChanged.connect(self._show_first)
        down = QShortcut(QKeySequence("Down"), self.search)
        down.setContext(Qt.ShortcutContext.WidgetShortcut)
        down.activated.connect(self._go_to_list)
        self.filter.group.idClicked.connect(self._show_first)
        self.order.currentIndexChanged.connect(self._show_first)
        self.refresh.clicked.connect(self.refresh_asked)
        for button, asked in (
            (self.open, self.opened),
            (self.rerun, self.again),
            (self.recover, self.recovered),
            (self.about, self.about_asked),
        ):
            button.clicked.connect(partial(self._emit_chosen, asked))
        self.compare.clicked.connect(lambda: self.compared.emit(self.ticked()))
        self._show()

    def show_entries(self, found: list[RunSummary]) -> None:
        """List these runs."""
        if found != self._entries:
            self._entries = found
            if self._chosen is not None:  # what is said of it may have changed
                self._chosen = self._entry(self._chosen.folder)
            self._show()

    def show_current(self, *folders: Path) -> None:
        """Mark the runs on screen; a file dialog names a folder in full."""
        self._current = frozenset(folder.absolute() for folder in folders)
        self._choose(self._entry(folders[0]) if folders else self._chosen)

    def newest(self, most: int) -> list[RunSummary]:
        """The newest runs of the folder that can be opened."""
        whole = [one for one in self._entries if not one.trouble]
        return sorted(whole, key=lambda one: one.started, reverse=True)[:most]

    def ticked(self) -> list[RunSummary]:
        """Runs ticked for comparison."""
        return [card.entry for card in self.cards if card.tick.isChecked()]

    def menu_of(self, entry: RunSummary) -> Menu:
        """What can be done with a run."""
        menu = Menu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        star = "Take the star away" if entry.starred else "Give it a star"
        for words, asked, offered in (
            ("Open", self.opened, True),
            ("Re-run with these settings", self.again, True),
            ("About, notes and tags …", self.about_asked, True),
            (star, self.starred, entry.status != "unreadable"),
            ("Recover", self.recovered, entry.status == "cut short"),
            ("Delete …", self.deleted, entry.status != "running"),
        ):
            if offered:
                menu.addAction(words, partial(asked.emit, entry))
        return menu

    def _entry(self, folder: Path) -> RunSummary | None:
        named = folder.absolute()
        return next((e for e in self._entries if e.folder.absolute() == named), None)

    def _emit_chosen(self, asked: Any, *_: object) -> None:
        if self._chosen is not None:
            asked.emit(self._chosen)

    def _show_menu(self, entry: RunSummary, at: QPoint) -> None:
        self.menu_of(entry).popup(at)

    def _show_first(self, *_: object) -> None:
        self._listed = PAGE
        self._show()

    def _show_more(self) -> None:
        self._listed += PAGE
        self._show()

    def _show(self) -> None:
        chosen = list(FILTERS.values())[max(self.filter.chosen, 0)]
        key, largest_first = list(ORDERS.values())[max(self.order.currentIndex(), 0)]
        ticked = {card.entry.folder for card in self.cards if card.tick.isChecked()}
        having = (c.entry.folder for c in self.cards if c.hasFocus())
        # read anew before the keyboard was back, it goes where it was to go
        self._focused = next(having, self._focused if self.hasFocus() else None)
        if self._focused is not None:
            self.setFocus()  # or Qt would give the keyboard to, and choose, another run
        words = self.search.text()
        fitting = [one for one in self._entries if chosen(one) and one.says(words)]
        fitting.sort(key=key, reverse=largest_first)
        listed = fitting[: self._listed]
        apart = _told_apart(listed)
        before = {card.entry.folder: card for card in self.cards}
        self.cards = []
        for entry in listed:
            card, differs = before.get(entry.folder), apart[entry.folder]
            if card is None or not card.tells(entry, differs):
                card = self._card(entry, differs, entry.folder in ticked)
            self.cards.append(card)
        empty(self._rows, self.cards)
        for card in self.cards:
            self._rows.addWidget(card)
        self._ask_thumbnails()
        if not fitting:
            self._rows.addWidget(self._nothing())
        elif len(listed) < len(fitting):
            more = push(f"Show more: {len(fitting) - len(listed)} are not listed")
            more.clicked.connect(self._show_more)
            self._rows.addWidget(more)
        self._rows.addStretch(1)
        self._count.setText(count(len(fitting), "run"))
        on_screen = next(filter(self._on_screen, listed), None)
        self._choose(self._chosen if self._chosen in listed else on_screen)
        if self._focused is not None:
            there = [one for one in self.cards if one.entry.folder == self._focused]
            to = next(iter(there or self.cards), None) or self.search
            QTimer.singleShot(0, to, to.setFocus)  # once it is on screen

    def _card(self, entry: RunSummary, apart: str, ticked: bool) -> RunCard:
        card = RunCard(entry, self._theme, apart)
        card.thumbnail.show_thumbnail(self.thumbnails.of(entry.folder))
        card.tick.setChecked(ticked)
        card.opened.connect(self.opened)
        card.chosen.connect(self._choose)
        card.ticked.connect(self._buttons)
        card.menu_asked.connect(self._show_menu)
        card.stepped.connect(partial(self._step, card))
        card.paged.connect(partial(self._step_pages, card))
        return card

    def _go_to_list(self) -> None:
        """Give the keyboard to the chosen run, or to the first."""
        chosen = [card for card in self.cards if card.entry == self._chosen]
        for card in (chosen or self.cards)[:1]:
            reach(card)

    def _step(self, card: RunCard, way: int) -> None:
        """Give the keyboard to a run so many below, or above (below zero)."""
        at = self.cards.index(card) + way
        reach(self.cards[min(max(at, 0), len(self.cards) - 1)])

    def _step_pages(self, card: RunCard, way: int) -> None:
        """Give the keyboard to a run as many below (1) or above (-1) as are seen."""
        seen = self._page.viewport().height() // card.height()
        self._step(card, way * max(seen, 1))

    def _nothing(self) -> QWidget:
        text = (
            "No run fits search and filter."
            if self._entries
            else "No runs yet.\nThey are listed here from their first second on."
        )
        none = label(text, "muted", wrap=True)
        none.setAlignment(Qt.AlignmentFlag.AlignCenter)
        none.setContentsMargins(0, 40, 0, 0)
        return none

    def showEvent(self, event: QShowEvent) -> None:
        """Pictures are made for those who look, and other programs' runs are seen."""
        super().showEvent(event)
        self.refresh_asked.emit()
        self._ask_thumbnails()

    def _ask_thumbnails(self) -> None:
        if self.isVisible():
            ended = [c.entry for c in self.cards if c.entry.status != "running"]
            self.thumbnails.ask([entry.folder for entry in ended])

    def _show_thumbnail(self, folder: Path) -> None:
        for card in self.cards:
            if card.entry.folder == folder:
                card.thumbnail.show_thumbnail(self.thumbnails.of(folder))

    def _on_screen(self, entry: RunSummary) -> bool:
        return entry.folder.absolute() in self._current

    def _choose(self, entry: RunSummary | None) -> None:
        self._chosen, first = entry, next(iter(self.cards), None)
        for card in self.cards:
            shown = self._on_screen(card.entry)
            card.mark(chosen=card.entry == entry, shown=shown)
            card.stop_tab(card.entry == entry or (entry is None and card is first))
        self._buttons()

    def _buttons(self) -> None:
        entry = self._chosen
        for button, words in (
            (self.open, "Show it in the lanes (Enter)"),
            (self.rerun, "Put its settings into the form, or into the queue"),
            (self.about, "Name, tags, notes, settings, log"),
        ):
            button.setEnabled(entry is not None)
            button.setToolTip(words if entry is not None else "Choose a run first")
        cut = entry is not None and entry.status == "cut short"
        self.recover.setToolTip("Make it readable by any program; works on a copy")
        other, offered = (self.open, self.recover) if cut else (self.recover, self.open)
        offered.setVisible(True)
        if other.hasFocus():  # or Qt would give the keyboard to whatever comes next
            offered.setFocus()
        other.setVisible(False)
        many = len(self.ticked())
        self.compare.setEnabled(many in (2, 3))
        self.compare.setText(
            f"Compare {many} runs" if many in (2, 3) else "Compare: tick 2 or 3"
        )
        self.compare.setAccessibleName(self.compare.text())
        self.compare.setToolTip("Tick two or three runs to compare them")
        place = 0
        for card in self.cards:
            card.show_place(place if card.tick.isChecked() else None)
            place += card.tick.isChecked()


def _told_apart(listed: Sequence[RunSummary]) -> dict[Path, str]:
    """In what each run differs from the others of its protocol in the list."""
    told: dict[Path, str] = {}
    for protocol in {entry.protocol for entry in listed}:
        alike = [entry for entry in listed if entry.protocol == protocol]
        folders = (entry.folder for entry in alike)
        told |= zip(folders, differing(alike), strict=True)
    return told
