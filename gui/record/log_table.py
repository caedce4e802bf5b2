"""The log as a table of whole rows; the row one is at shows all of its message."""

from __future__ import annotations

from html import escape

from PySide6.QtCore import QAbstractItemModel, QModelIndex, QRect, Qt
from PySide6.QtGui import (
    QAction,
    QGuiApplication,
    QKeyEvent,
    QKeySequence,
    QResizeEvent,
)
from PySide6.QtWidgets import QAbstractItemView, QTableView, QToolTip

from gui.table_keys import is_the_windows

ROW = 22
"""Height of a line of text, px: rows and viewport are multiples of it."""

WIDTHS = (112, 28, 78)
"""Of time, sign and source, px; the message has the rest."""

MESSAGE = len(WIDTHS)

LONG = 60_000
"""Time for which a message that the log has no room for can be read, ms."""


class LogTable(QTableView):
    """Newest lines at the bottom, none of them cut.

    The current row grows until its message is readable in full; where the log is too
    low for that, a tool tip has it. Ctrl+C copies it. The newest line stays in sight
    unless somebody looks further up.
    """

    def __init__(self, model: QAbstractItemModel) -> None:
        super().__init__()
        self.setModel(model)
        self.setAccessibleName("Log")
        self.setShowGrid(False)
        self.setWordWrap(True)
        self.horizontalHeader().hide()
        self.verticalHeader().hide()
        self.verticalHeader().setMinimumSectionSize(ROW)
        self.verticalHeader().setDefaultSectionSize(ROW)
        for where, width in enumerate(WIDTHS):
            self.setColumnWidth(where, width)
        self.horizontalHeader().setStretchLastSection(True)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setVerticalScrollMode(QAbstractItemView.ScrollMode.ScrollPerItem)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setTabKeyNavigation(False)
        copy = QAction("Copy", self)
        copy.setShortcut(QKeySequence.StandardKey.Copy)
        copy.setShortcutContext(Qt.ShortcutContext.WidgetShortcut)
        copy.triggered.connect(self.copy)
        self.addAction(copy)
        self.setContextMenuPolicy(Qt.ContextMenuPolicy.ActionsContextMenu)
        self.selectionModel().currentRowChanged.connect(self._current_changed)
        self._follows = True
        bar = self.verticalScrollBar()
        bar.valueChanged.connect(self._scrolled)
        bar.rangeChanged.connect(self._range_changed)

    def copy(self) -> None:
        """Put the selected lines on the clipboard, one below the other."""
        rows = sorted(index.row() for index in self.selectionModel().selectedRows())
        QGuiApplication.clipboard().setText("\n".join(self._line(row) for row in rows))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Go from line to line."""
        if is_the_windows(event):
            event.ignore()
        else:
            super().keyPressEvent(event)

    def updateGeometries(self) -> None:
        """Keep the viewport a multiple of a row."""
        super().updateGeometries()  # which takes the margin for that of its headers
        over = self.viewport().height() % ROW
        if over:
            self.setViewportMargins(0, over, 0, 0)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the message readable."""
        super().resizeEvent(event)
        self._fit(self.currentIndex())

    def _scrolled(self, value: int) -> None:
        """Whoever looks further up is left there."""
        self._follows = value == self.verticalScrollBar().maximum()

    def _range_changed(self) -> None:
        if self._follows:
            self.scrollToBottom()

    def _line(self, row: int) -> str:
        cells = (self.model().index(row, where).data() for where in (0, 2, MESSAGE))
        return "  ".join(str(cell) for cell in cells)

    def _current_changed(self, current: QModelIndex, before: QModelIndex) -> None:
        if before.isValid() and self.rowHeight(before.row()) != ROW:
            self.setRowHeight(before.row(), ROW)
            self._follows = True  # it was left only for the sake of that line
        self._fit(current)

    def _fit(self, current: QModelIndex) -> None:
        """Give a row the height of its message."""
        if not current.isValid():
            return
        text = str(current.siblingAtColumn(MESSAGE).data())
        room = QRect(0, 0, self.columnWidth(MESSAGE) - 14, 10_000)
        wrapped = self.fontMetrics().boundingRect(room, Qt.TextFlag.TextWordWrap, text)
        room_for = max(self.viewport().height() // ROW, 1)
        rows = -(-wrapped.height() // ROW)
        if rows > 1:
            self._follows = False  # it stays in sight while it is read
        if self.rowHeight(current.row()) != ROW * min(rows, room_for):
            self.setRowHeight(current.row(), ROW * min(rows, room_for))
            self.scrollTo(current)
        if rows > room_for and self.isVisible():
            where = self.viewport().mapToGlobal(self.visualRect(current).topLeft())
            QToolTip.showText(where, f"<p>{escape(text)}</p>", self, QRect(), LONG)
