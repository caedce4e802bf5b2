"""One run: name, tags and notes to be edited; facts, settings and log to be read."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Any

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtWidgets import (
    QAbstractItemDelegate,
    QAbstractItemView,
    QHeaderView,
    QStackedWidget,
    QTableWidget,
    QTableWidgetItem,
    QTextBrowser,
    QWidget,
)

from gui.dialogs.overlay import Overlay
from gui.look.theme import Theme
from gui.parts import (
    STRETCH,
    Elided,
    IconButton,
    Segments,
    column,
    label,
    line_edit,
    push,
    row,
    say,
)
from gui.setup.parameter import parameter, text_of
from tactile_lab.engine.threads import start
from tactile_lab.errors import QuantityError, TactileLabError
from tactile_lab.notebook import facts
from tactile_lab.quantity import exact, parse
from tactile_lab.scene.load import load
from tactile_lab.store.folder import LOG, is_live, read_info
from tactile_lab.store.remarks import Note, Remarks, change_remarks, read_remarks
from tactile_lab.table import dumped, fields_of

PAGES = ("Notes", "Facts", "Settings", "Log")


class NotesTable(QTableWidget):
    """Time and text of each note; Tab goes on from its last cell, back from its first.

    Qt would go round and round among them while one of them is typed into.
    """

    def closeEditor(
        self, editor: QWidget, hint: QAbstractItemDelegate.EndEditHint
    ) -> None:
        """End the typing in a cell."""
        hints, at = QAbstractItemDelegate.EndEditHint, self.currentIndex()
        end = self.model().index(self.rowCount() - 1, 1)
        forward = hint == hints.EditNextItem
        leaves = forward and at == end
        leaves |= hint == hints.EditPreviousItem and at == self.model().index(0, 0)
        super().closeEditor(editor, hints.NoHint if leaves else hint)
        if leaves:
            self.focusNextPrevChild(forward)


class AboutRun(Overlay):
    """A card for one run after the other."""

    saved = Signal(object)
    """The folder whose remarks were changed."""
    _read = Signal(object, str, str)

    def __init__(self, window: QWidget, theme: Theme) -> None:
        super().__init__(window, 760)
        self._folder = Path()
        self._as_read: Remarks | None = None
        self._shown: tuple[object, ...] = ()
        self.heading = Elided("", "muted")
        self.title = line_edit("Name of the run", "its protocol's name")
        self.star = IconButton(theme, "star", "It matters", checkable=True)
        self.star.toggled.connect(
            lambda on: self.star.set_icon("starred" if on else "star")
        )
        self.tags = line_edit("Tags", "separated by commas")
        self.choice = Segments(list(PAGES), "Page")
        self.pages = QStackedWidget()
        self.give_room(self.pages, 330)
        self.notes = NotesTable(0, 2)
        self._set_up_notes()
        self.add = push("Add a note")
        self.remove = push("Take it out", tip="The chosen note (Delete)")
        self.remove.setEnabled(False)
        buttons = row(self.add, self.remove, STRETCH)
        notes = QWidget()
        column(notes, (self.notes, 1), buttons, spacing=8)
        self.pages.addWidget(notes)
        self.texts = {name: QTextBrowser() for name in PAGES[1:]}
        for name, text in self.texts.items():
            text.setAccessibleName(name)
            text.setOpenLinks(False)
            self.pages.addWidget(text)
        self.problem = label("", "error", wrap=True)
        self.save = push("Save", "primary")
        self.close_button = push("Close")
        self._lay_out()
        self.choice.group.idClicked.connect(self.show_page)
        self.add.clicked.connect(lambda: self._add_row(Note(text="", at="")))
        self.remove.clicked.connect(self._take_out)
        delete = QShortcut(QKeySequence("Delete"), self.notes)
        delete.setContext(Qt.ShortcutContext.WidgetShortcut)
        delete.activated.connect(self._take_out)
        self.notes.currentCellChanged.connect(
            lambda row, *_: self.remove.setEnabled(row >= 0)
        )
        self.save.clicked.connect(self._save)
        self.close_button.clicked.connect(self.hide)
        self._read.connect(self._show_read)

    def show_run(self, folder: Path) -> None:
        """Open the card for a run, with what was typed of it and not saved."""
        left = folder == self._folder and self._typed() != self._shown
        self._folder = folder
        self.heading.set_whole(str(folder))
        say(self.problem, "")
        for text in self.texts.values():
            text.setPlainText("reading …")
        try:
            said = read_remarks(folder)
            live = is_live(folder)
        except (TactileLabError, OSError) as error:
            say(self.problem, str(error))
            self.save.setEnabled(False)
        else:
            if left and said == self._as_read:
                say(self.problem, "Not saved yet: Save keeps what was typed here.")
            else:
                self._fill(said)
            self.save.setEnabled(not live)
            self.save.setToolTip("Once the run has ended" if live else "")
        self.show_page(0)
        self.open()
        self.title.setFocus()
        start(lambda: self._look(folder), "about run", finishes=True)

    def _fill(self, said: Remarks) -> None:
        self.title.setText(said.title)
        self.tags.setText(", ".join(said.tags))
        self.star.setChecked(said.starred)
        self.notes.setRowCount(0)
        for note in said.notes:
            self._add_row(note)
        self.notes.setCurrentCell(0 if said.notes else -1, 1)
        self._as_read, self._shown = said, self._typed()

    def _typed(self) -> tuple[object, ...]:
        """All that can be typed or chosen, as it stands there."""
        cells = [
            "" if (item := self.notes.item(at, where)) is None else item.text()
            for at in range(self.notes.rowCount())
            for where in (0, 1)
        ]
        return self.title.text(), self.tags.text(), self.star.isChecked(), *cells

    def show_page(self, number: int) -> None:
        """0 Notes, 1 Facts, 2 Settings, 3 Log."""
        self.choice.choose(number)
        self.pages.setCurrentIndex(number)

    def _look(self, folder: Path) -> None:
        """Read what takes a moment, away from the window's thread."""
        for name, make in (
            ("Facts", facts_of),
            ("Settings", settings_of),
            ("Log", log_of),
        ):
            try:
                text = make(folder)
            except (TactileLabError, OSError) as error:
                text = escape(str(error))
            self._read.emit(folder, name, text)

    def _show_read(self, folder: Path, name: str, text: str) -> None:
        if folder == self._folder:
            self.texts[name].setHtml(text)

    def _written(self, said: Remarks) -> Remarks:
        """What stands in the card; others note, too, while it is open."""
        seen = self._as_read
        late = [one for one in said.notes if seen and one not in seen.notes]
        return replace(
            said,
            title=self.title.text().strip(),
            tags=[t.strip() for t in self.tags.text().split(",") if t.strip()],
            starred=self.star.isChecked(),
            notes=(*self._noted(), *late),
        )

    def _save(self) -> None:
        try:
            change_remarks(self._folder, self._written)
        except TactileLabError as error:
            say(self.problem, str(error))
            self.open()
            return
        self._shown = self._typed()
        self.hide()
        self.saved.emit(self._folder)

    def _noted(self) -> list[Note]:
        found = []
        for at in range(self.notes.rowCount()):
            when, what = self.notes.item(at, 0), self.notes.item(at, 1)
            text = "" if what is None else what.text().strip()
            typed = "" if when is None else when.text().strip()
            if not text:
                continue
            if typed and typed[-1].isdigit():
                typed += " s"
            try:
                time = parse(typed, "s") if typed else None
            except QuantityError as error:
                raise QuantityError(
                    f"The time of the note {text!r}: {error}"
                ) from error
            kept = None if what is None else what.data(Qt.ItemDataRole.UserRole)
            found.append(Note(text=text, time=time, **({"at": kept} if kept else {})))
        return found

    def _add_row(self, note: Note) -> None:
        at = self.notes.rowCount()
        self.notes.insertRow(at)
        time = "" if note.time is None else exact(round(note.time, 3), "s")
        for where, text in enumerate((time, note.text)):
            item = QTableWidgetItem(text)
            item.setData(Qt.ItemDataRole.UserRole, note.at)
            self.notes.setItem(at, where, item)
        if not note.text:
            self.notes.setCurrentCell(at, 1)
            self.notes.edit(self.notes.currentIndex())

    def _take_out(self) -> None:
        """Take out the chosen note; the keyboard goes to what is chosen then.

        Left on the button, it would take out another with a second Enter.
        """
        self.notes.removeRow(self.notes.currentRow())
        (self.notes if self.notes.rowCount() else self.add).setFocus()

    def _set_up_notes(self) -> None:
        self.notes.setAccessibleName("Notes")
        self.notes.setHorizontalHeaderLabels(["Time", "Note"])
        self.notes.verticalHeader().hide()
        self.notes.setShowGrid(False)
        self.notes.setTabKeyNavigation(False)
        one = QAbstractItemView.SelectionMode.SingleSelection
        self.notes.setSelectionMode(one)
        self.notes.setColumnWidth(0, 90)
        header = self.notes.horizontalHeader()
        header.setSectionResizeMode(1, QHeaderView.ResizeMode.Stretch)
        header.setDefaultAlignment(Qt.AlignmentFlag.AlignLeft)

    def _lay_out(self) -> None:
        head = row(label("About this run", "big"), STRETCH, self.choice)
        named = row(label("Name"), (self.title, 2), label("Tags"), (self.tags, 2))
        named.addWidget(self.star)
        foot = row((self.problem, 1), STRETCH, self.close_button, self.save)
        parts = (head, self.heading, named, (self.pages, 1), foot)
        column(self.card, *parts, margin=22, spacing=12)


def facts_of(folder: Path) -> str:
    """What `tactile-lab show` says of a run, and on which versions it was made."""
    from tactile_lab.commands.show import describe, rows

    summary = describe(folder)
    found = [(name, value) for name, value in rows(summary) if value]
    info = read_info(folder)
    versions = (info.get("environment") or {}).items()
    said = [(name, _brief(value)) for name, value in versions]
    kind = "simulated" if summary["simulated"] else "measured"
    state = f"{summary['status'].capitalize()}, {kind}"
    return facts(state, found) + facts("Made with", said)


def _brief(value: Any) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {one}" for name, one in value.items())
    return str(value)


def settings_of(folder: Path) -> str:
    """The scene as it was run, table by table; what is no default is bold."""
    scene = load(folder / "scene.toml")
    tables: dict[str, Any] = {"protocol": scene.protocol, "record": scene.record}
    tables |= {"detect": scene.detect, "simulated": scene.simulated}
    pages = []
    for name, table in tables.items():
        found = []
        for key, info in fields_of(type(table)).items():
            field, own = parameter(key, info), getattr(table, key)
            words = escape(f"{key} = {text_of(field, own) or '—'}")
            usual = own == field.default and not field.required
            found.append(words if usual else f"<b>{words}</b>")
        pages.append(f"<p><b>[{name}]</b><br>{'<br>'.join(found)}</p>")
    bench = "<br>".join(
        f"{escape(str(key))} = {escape(str(value))}"
        for key, value in dumped(scene.bench).items()
    )
    return "".join((*pages, f"<p><b>[bench]</b><br>{bench}</p>"))


def log_of(folder: Path) -> str:
    """The run's own log, line by line."""
    found = []
    for line in (folder / LOG).read_text("utf-8", "replace").splitlines():
        try:
            said = json.loads(line)
            clock = str(said["at"])[11:23]
            found.append((clock, f"{said['kind']}: {said['text']}"))
        except (ValueError, KeyError, TypeError):
            continue  # the last line of a run that was cut short
    return facts("Log", found)
