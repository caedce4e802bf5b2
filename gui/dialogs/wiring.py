"""The connect dialog's second page: what is wired to which input, and is it true?"""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QGridLayout,
    QHeaderView,
    QTableWidget,
    QTableWidgetItem,
    QWidget,
)

from gui.dialogs.bench_text import BenchChoice
from gui.lanes.lane import title_of
from gui.look.theme import Theme
from gui.parts import STRETCH, column, empty, label, push, row, say, set_role, sign
from gui.review.conclusion import ShownConclusion

COLUMNS = ("Input", "Signal", "Range", "Offset", "Shunt")
ROW = 28


class Wiring(QWidget):
    """The table of inputs; below it the wiring check and its verdicts."""

    check_asked = Signal()

    def __init__(self, choice: BenchChoice, theme: Theme) -> None:
        super().__init__()
        self._choice, self._theme = choice, theme
        self._concluded: ShownConclusion | None = None
        self.table = QTableWidget(0, len(COLUMNS))
        self.table.setAccessibleName("Oscilloscope inputs")
        self.table.setHorizontalHeaderLabels(list(COLUMNS))
        self.table.verticalHeader().hide()
        self.table.verticalHeader().setDefaultSectionSize(ROW)
        self.table.setTabKeyNavigation(False)
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        header.setDefaultAlignment(Qt.AlignmentFlag.AlignLeft)
        self.check = push("Run the wiring check", "primary")
        self.progress = label("", "muted", wrap=True)
        self.mark = label("", "pill")
        self.mark.hide()
        self._verdicts = QGridLayout()
        self._verdicts.setHorizontalSpacing(10)
        self._verdicts.setVerticalSpacing(6)
        self._verdicts.setColumnStretch(2, 1)
        self._also = label("", "muted", wrap=True)
        self._also.hide()
        self._lay_out()
        self.show_choice()
        self.check.clicked.connect(self.check_asked)
        theme.changed.connect(self._show_verdicts)

    def show_choice(self) -> None:
        """Fill the table from the choice."""
        self.table.setRowCount(0)
        for at, cells in enumerate(self._choice.channels):
            self.table.insertRow(at)
            for where, text in enumerate(cells):
                self.table.setItem(at, where, QTableWidgetItem(text))
        rows = max(self.table.rowCount(), 2)
        header = self.table.horizontalHeader().sizeHint().height()
        self.table.setFixedHeight(ROW * rows + header + 6)

    def take(self) -> None:
        """Put the table into the choice."""
        rows = []
        for at in range(self.table.rowCount()):
            cells = [self.table.item(at, where) for where in range(len(COLUMNS))]
            texts = [cell.text().strip() if cell else "" for cell in cells]
            rows.append((texts[0], texts[1], texts[2], texts[3], texts[4]))
        self._choice.channels = rows

    def show_progress(self, text: str, *, busy: bool) -> None:
        """Say how far the check is; a check in progress cannot be asked for again."""
        say(self.progress, text)
        self.check.setEnabled(not busy)
        if busy and self._concluded is not None:
            self._concluded = None
            self._show_verdicts()

    def show_conclusion(self, found: ShownConclusion) -> None:
        """Show what the check found."""
        self._concluded = found
        self._show_verdicts()

    @property
    def verdicts(self) -> list[str]:
        """The verdicts as they are shown: "V_C1 as wired: 4.35 V at rest ..."."""
        found = self._concluded.verdicts if self._concluded else ()
        return [f"{v.signal} {_word(v.ok)}: {v.text}" for v in found]

    def _show_verdicts(self) -> None:
        empty(self._verdicts)
        found = self._concluded
        verdicts = found.verdicts if found else ()
        tokens = self._theme.tokens
        for at, verdict in enumerate(verdicts):
            name, colour = (
                ("check", tokens.green) if verdict.ok else ("warning", tokens.red)
            )
            mark = sign(name, colour, _word(verdict.ok))
            also = "".join(f"; {more}" for more in self._more(verdict.signal))
            text = label(f"{_word(verdict.ok)}: {verdict.text}{also}", wrap=True)
            if not verdict.ok:
                set_role(text, "error")
            top = Qt.AlignmentFlag.AlignTop
            self._verdicts.addWidget(mark, at, 0, top)
            self._verdicts.addWidget(
                label(title_of(verdict.signal), "strong"), at, 1, top
            )
            self._verdicts.addWidget(text, at, 2)
        signals = tuple(f"{verdict.signal}:" for verdict in verdicts)
        statements = found.statements if found else ()
        rest = [text for text in statements if not text.startswith(signals)]
        say(self._also, "\n".join(rest))
        wrong = sum(not verdict.ok for verdict in verdicts)
        self.mark.setVisible(found is not None)
        set_role(self.mark, "pill-ok" if verdicts and not wrong else "pill-bad")
        self.mark.setText(
            "no verdict"
            if not verdicts
            else f"{wrong} of {len(verdicts)} channels WRONG"
            if wrong
            else f"all {len(verdicts)} channels as wired"
        )

    def _more(self, signal: str) -> list[str]:
        """What else the check says of a channel, such as its hum."""
        said = self._concluded.statements if self._concluded else ()
        begin = f"{signal}: "
        return [
            text.removeprefix(begin).rstrip(".")
            for text in said
            if text.startswith(begin) and "as wired" not in text and "WRONG" not in text
        ]

    def _lay_out(self) -> None:
        about = label(
            "The wiring check makes a small push on the connected bench and says "
            "whether each channel is what its bench file says: swapped, inverted, "
            "open, wrong attenuation, and how much mains hum it carries.",
            "muted",
            wrap=True,
        )
        run = row(self.check, (self.progress, 1), self.mark, spacing=12)
        parts = (about, self.table, run, self._verdicts, self._also, STRETCH)
        column(self, *parts, spacing=10)


def _word(ok: bool) -> str:
    return "as wired" if ok else "WRONG"
