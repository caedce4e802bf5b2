"""The oscilloscope's inputs: range, offset and coupling, changed between runs."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QFrame, QLineEdit, QWidget

from gui.lanes.lane import title_of
from gui.parts import STRETCH, Combo, column, empty, label, push, row, say
from gui.setup.parameter import toml
from tactile_lab.errors import QuantityError, SceneError
from tactile_lab.instruments.registry import scope_capability
from tactile_lab.quantity import exact, parse, printed, show, typed
from tactile_lab.scene.bench_file import BenchSpec
from tactile_lab.scope import Channel
from tactile_lab.table import dumped


class InputCard(QFrame):
    """One input: what is wired to it, what it sees, and its three settings."""

    changed = Signal()

    def __init__(self, table: Channel, ranges: tuple[float, ...], codes: int) -> None:
        super().__init__()
        self.setProperty("role", "card")
        self._table, self._codes = table, codes
        name = f"{table.input} · {table.signal}"
        self.range = Combo()
        for value in ranges:
            self.range.addItem(f"±{show(value, 'V')}", value)
        self.range.setCurrentIndex(self.range.findData(table.range))
        self.offset = QLineEdit(exact(table.offset, "V"))
        self.coupling = Combo()
        self.coupling.addItems(["DC", "AC"])
        self.coupling.setCurrentText(table.coupling)
        self._sees = label("", "small")
        wired = label(f"{table.input} · {title_of(table.signal)}", "strong")
        top = row(wired, STRETCH, self._sees)
        below = row(spacing=5)
        for words, editor, share in (
            ("Range", self.range, 4),
            ("Offset", self.offset, 4),
            ("Coupling", self.coupling, 3),
        ):
            editor.setAccessibleName(f"{words} of input {name}")
            editor.setToolTip(f"{words} of input {name}")
            below.addWidget(editor, share)
        column(self, top, below, margin=9, spacing=5)
        self.range.currentIndexChanged.connect(self._edited)
        self.offset.textChanged.connect(self._edited)
        self.coupling.currentIndexChanged.connect(self._edited)
        self._edited()

    def table(self) -> dict[str, Any]:
        """The entry of a bench file as the settings stand.

        Raises:
            QuantityError: the offset is no voltage.
        """
        made = dumped(self._table)
        made["range"] = typed(exact(float(self.range.currentData()), "V"))
        made["offset"] = typed(exact(parse(self.offset.text(), "V"), "V"))
        made["coupling"] = self.coupling.currentText()
        return made

    def _edited(self) -> None:
        full = float(self.range.currentData() or self._table.range)
        try:
            middle = -parse(self.offset.text(), "V")
            low, high = (round(middle + sign * full, 9) for sign in (-1, 1))
            code = show(full / self._codes, "V", 2)
            span = printed(f"{low:.4g} to {high:.4g} V")
            self._sees.setText(f"{span} · {code} a code")
        except QuantityError as error:
            self._sees.setText("offset?")
            self._sees.setToolTip(str(error))
        self.changed.emit()


class ScopeInputs(QWidget):
    """One card per wired input; nothing is changed before *Use these settings*."""

    asked = Signal(str)
    """Channels of a bench file as one TOML list."""

    def __init__(self) -> None:
        super().__init__()
        self.cards: list[InputCard] = []
        inner = QWidget()
        self._rows = column(inner, spacing=6)
        self.use = push("Use these settings")
        self.problem = label("", "error", wrap=True)
        self.problem.hide()
        column(self, inner, self.problem, self.use)
        self.use.clicked.connect(self._ask)
        self._idle = False

    def show_bench(self, spec: BenchSpec | None) -> None:
        """Show the inputs of a bench."""
        empty(self._rows)
        self.cards = []
        self.say("")
        scope = None if spec is None else spec.scope
        self.setVisible(scope is not None)
        if scope is None:
            return
        try:
            capability = scope_capability(scope)
            ranges, codes = capability.ranges, capability.codes
        except SceneError as error:
            ranges, codes = tuple(sorted({one.range for one in scope.channels})), 127
            self.say(str(error))
        for table in scope.channels:
            card = InputCard(table, ranges, codes)
            card.changed.connect(self._buttons)
            self.cards.append(card)
            self._rows.addWidget(card)
        self._buttons()

    def allow(self, idle: bool, reason: str) -> None:
        """Let the settings be changed, or say why not."""
        if idle is not self._idle:
            self._idle = idle
            for card in self.cards:
                card.setEnabled(idle)
            self.use.setToolTip(reason or "For all runs until the bench is changed")
            self._buttons()

    def say(self, problem: str) -> None:
        """Tell why the settings cannot be used, "" if they can."""
        say(self.problem, problem)

    def _buttons(self) -> None:
        self.use.setEnabled(self._idle and bool(self.cards))

    def _ask(self) -> None:
        try:
            tables = [card.table() for card in self.cards]
        except QuantityError as error:
            self.say(str(error))
            return
        self.asked.emit(toml(tables))
