"""The log: time, sign, source, text; filters; time-stamped notes."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import (
    QAbstractTableModel,
    QModelIndex,
    QPersistentModelIndex,
    QSortFilterProxyModel,
    Qt,
    Signal,
)
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QWidget

from gui.look.icons import pixmap
from gui.look.theme import Theme
from gui.parts import STRETCH, IconButton, Segments, column, label, line_edit, row
from gui.record.log_table import LogTable
from gui.session.log import LogLine, Severity

Index = QModelIndex | QPersistentModelIndex
ROOT = QModelIndex()
MOST = 5000


class LogModel(QAbstractTableModel):
    """Lines of the log, newest last."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.lines: list[LogLine] = []
        self._theme = theme

    def add(self, line: LogLine) -> None:
        """Append a line; the oldest go past `MOST`."""
        if len(self.lines) >= MOST:
            self.beginRemoveRows(ROOT, 0, 499)
            del self.lines[:500]
            self.endRemoveRows()
        at = len(self.lines)
        self.beginInsertRows(ROOT, at, at)
        self.lines.append(line)
        self.endInsertRows()

    def rowCount(self, parent: Index = ROOT) -> int:
        """Lines."""
        return 0 if parent.isValid() else len(self.lines)

    def columnCount(self, parent: Index = ROOT) -> int:
        """Time, sign, source, text."""
        return 4

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """What a cell shows."""
        line, where = self.lines[index.row()], index.column()
        if role == Qt.ItemDataRole.DisplayRole:
            at = f"{line.at:%H:%M:%S}.{line.at.microsecond // 1000:03d}"
            return (at, None, line.source, line.text)[where]
        if role == Qt.ItemDataRole.DecorationRole and where == 1:
            return pixmap(line.level.value, self._colour(line), 16)
        if role == Qt.ItemDataRole.ForegroundRole:
            if line.level is Severity.ERROR:
                return QColor(self._theme.tokens.red)
            if where in (0, 2):
                return QColor(self._theme.tokens.muted)
        if role == Qt.ItemDataRole.ToolTipRole and where == 3:
            return line.text
        if role == Qt.ItemDataRole.AccessibleTextRole:
            return f"{line.level.name.lower()}: {line.source}: {line.text}"
        return None

    def _colour(self, line: LogLine) -> str:
        tokens = self._theme.tokens
        return {
            Severity.INFO: tokens.muted,
            Severity.GOOD: tokens.green,
            Severity.WARNING: tokens.amber,
            Severity.ERROR: tokens.red,
            Severity.NOTE: tokens.accent,
        }[line.level]


class LogFilter(QSortFilterProxyModel):
    """All, warnings, safety or notes."""

    choice = 0

    def choose(self, choice: int) -> None:
        """0 all, 1 warnings and errors, 2 safety, 3 notes."""
        self.choice = choice
        self.invalidate()

    def filterAcceptsRow(self, row: int, parent: Index) -> bool:
        """Whether a line is shown."""
        model = self.sourceModel()
        assert isinstance(model, LogModel)
        line = model.lines[row]
        return (
            True,
            line.level in (Severity.WARNING, Severity.ERROR),
            line.safety,
            line.level is Severity.NOTE,
        )[self.choice]


class LogView(QWidget):
    """The log with its filters and the field for notes."""

    noted = Signal(str)
    step_chosen = Signal(float, object)
    """A line that tells of a time of a run was double clicked; time, s, and folder."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.model = LogModel(theme)
        self.filter = LogFilter()
        self.filter.setSourceModel(self.model)
        self.choices = Segments(["All", "Warnings", "Safety", "Notes"], "Log filter")
        self.choices.choose(0)
        self.help = IconButton(theme, "help", "Help on steps and log")
        self.note = line_edit("Note", "Add a note …  (N)")
        self.note.setToolTip("Stamped with wall-clock and run time; Enter adds it")
        self.note.setMinimumWidth(120)
        self.note.setMaximumWidth(280)
        self.table = LogTable(self.filter)
        self.title = label("Run log", "title")
        # its hint says where a note goes: it has the room first
        top = (self.title, self.choices, (STRETCH, 0), (self.note, 1), self.help)
        column(self, row(*top, spacing=10), (self.table, 1))
        self.choices.group.idClicked.connect(self._chosen)
        self.note.returnPressed.connect(self._noted)
        self.table.activated.connect(self._activated)
        theme.changed.connect(self.table.viewport().update)

    def add(self, line: LogLine) -> None:
        """Append a line."""
        self.model.add(line)

    def show_safety(self) -> None:
        """Show the last lines about the coil."""
        self.choices.choose(2)
        self._chosen(2)

    def _chosen(self, number: int) -> None:
        self.filter.choose(number)
        self.table.scrollToBottom()

    def _activated(self, index: Index) -> None:
        line = self.model.lines[self.filter.mapToSource(index).row()]
        if line.time is not None:
            self.step_chosen.emit(line.time, line.run)

    def _noted(self) -> None:
        text = self.note.text().strip()
        if text:
            self.note.clear()  # first: what cannot be kept is put back
            self.noted.emit(text)
