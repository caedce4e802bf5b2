"""One editor per parameter: text with a unit, switch, choice, file."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal
from pathlib import Path

from PySide6.QtCore import QEvent, QRect, Qt, Signal
from PySide6.QtGui import (
    QFocusEvent,
    QKeyEvent,
    QKeySequence,
    QPainter,
    QPaintEvent,
)
from PySide6.QtWidgets import (
    QCheckBox,
    QFrame,
    QLineEdit,
    QStyle,
    QStyleOptionFrame,
    QToolButton,
)

from gui.ask_file import ask_file
from gui.parts import STRETCH, Combo, column, filled, label, row, say
from gui.setup.parameter import FieldText, FormField, Kind, text_of, with_unit
from tactile_lab.errors import QuantityError
from tactile_lab.quantity import exact, parse

NAME = 100
"""Width of the column of names, px: longer ones take two lines."""


INSIDE = 2
"""Margin that a line edit keeps on both sides of its text, px."""


class QuantityEdit(QLineEdit):
    """A line edit; arrow keys change the number by one in its leading digit's place.

    While nobody edits it, text longer than the field is shortened. Undo is the form's:
    what was typed during one `stay` of the keyboard is one edit.
    """

    edited = Signal()

    def __init__(self, parameter: FormField) -> None:
        super().__init__()
        self._parameter = parameter
        self.stay: object | None = None
        self.textEdited.connect(self.edited)

    def event(self, event: QEvent) -> bool:
        """Leave undo and redo to the form."""
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(
            event, QKeyEvent
        ):
            keys = QKeySequence.StandardKey
            if event.matches(keys.Undo) or event.matches(keys.Redo):
                return False
        return super().event(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        """A stay begins."""
        self.stay = object()
        super().focusInEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """A stay ends: a bare number shows what unit it is taken in."""
        whole = with_unit(self._parameter, self.text())
        if whole != self.text():  # 300 where 250 ms stood is 300 s
            self.setText(whole)
            self.edited.emit()
        self.stay = None
        super().focusOutEvent(event)

    @property
    def shown(self) -> str:
        """The text as far as it fits; all of it while it is edited."""
        room = self._room().width()
        if self.hasFocus():
            return self.text()
        file = self._parameter.kind is Kind.FILE  # its name is what tells it
        way = Qt.TextElideMode.ElideLeft if file else Qt.TextElideMode.ElideRight
        return self.fontMetrics().elidedText(self.text(), way, room)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the text, shortened where it does not fit."""
        shown = self.shown
        if shown == self.text():
            super().paintEvent(event)
            return
        option = QStyleOptionFrame()
        self.initStyleOption(option)
        painter = QPainter(self)
        panel = QStyle.PrimitiveElement.PE_PanelLineEdit
        self.style().drawPrimitive(panel, option, painter, self)
        painter.setPen(option.palette.text().color())
        painter.drawText(self._room(), Qt.AlignmentFlag.AlignVCenter, shown)

    def _room(self) -> QRect:
        option = QStyleOptionFrame()
        self.initStyleOption(option)
        contents = QStyle.SubElement.SE_LineEditContents
        room = self.style().subElementRect(contents, option, self)
        return room.adjusted(INSIDE, 0, -INSIDE, 0)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Step with the arrow keys."""
        unit = self._parameter.unit
        up = {Qt.Key.Key_Up: 1, Qt.Key.Key_Down: -1}.get(Qt.Key(event.key()), 0)
        if not up or unit is None or self._parameter.kind is not Kind.QUANTITY:
            super().keyPressEvent(event)
            return
        try:
            value = parse(self.text(), unit.symbol)
        except QuantityError:
            return
        step = leading_place(value)
        if value == step and up < 0:
            step /= 10
        self.setText(exact(float(f"{value + up * step:.12g}"), unit.symbol))
        self.edited.emit()

    def put(self, text: str) -> None:
        """Show `text` from its start."""
        self.setText(text)
        self.setCursorPosition(0)


def leading_place(value: float) -> float:
    """Worth of one in the leading digit's place: 100 of 250, 0.01 of 0.03; 1 of 0."""
    return 10.0 ** Decimal(repr(value)).adjusted() if value else 1.0


class Switch(QCheckBox):
    """On or off; its text is "true" or "false"."""

    edited = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.toggled.connect(self.edited)

    def text(self) -> str:
        """What it says."""
        return "true" if self.isChecked() else "false"

    def put(self, text: str) -> None:
        """Switch."""
        self.setChecked(text == "true")


class Choice(Combo):
    """One of several words."""

    edited = Signal()

    def __init__(self, choices: Sequence[str]) -> None:
        super().__init__()
        self.addItems(list(choices))
        self.currentTextChanged.connect(self.edited)

    def text(self) -> str:
        """The word chosen."""
        return self.currentText()

    def put(self, text: str) -> None:
        """Choose a word."""
        self.setCurrentText(text)


def editor(parameter: FormField) -> QuantityEdit | Switch | Choice:
    """What edits a parameter: it has `text`, `put` and `edited`."""
    if parameter.kind is Kind.SWITCH:
        return Switch()
    if parameter.kind is Kind.CHOICE:
        return Choice(parameter.choices)
    edit = QuantityEdit(parameter)
    default = text_of(parameter, parameter.default)
    if parameter.optional:
        edit.setPlaceholderText("automatic")
    elif not parameter.required:
        edit.setPlaceholderText(default or "none")
    if parameter.kind in (Kind.QUANTITY, Kind.INTEGER, Kind.NUMBER):
        edit.setAlignment(Qt.AlignmentFlag.AlignRight)
    return edit


class Field(QFrame):
    """Label, mark, editor and the reason why a text cannot be used.

    Args:
        value: the text it shows and changes.
    """

    changed = Signal()

    def __init__(self, value: FieldText) -> None:
        super().__init__()
        self.value, self.parameter = value, value.parameter
        self._mark = QFrame()
        self._mark.setFixedSize(3, 22)
        self._reason = label("", "error", wrap=True)
        self._reason.hide()
        name = label(self.parameter.title, wrap=True)
        name.setToolTip(self.parameter.help)
        name.setFixedWidth(NAME)
        across = row(self._mark, name, spacing=6)
        self._editor = editor(self.parameter)
        self._editor.put(value.text)
        self._editor.edited.connect(self._edited)
        name.setBuddy(self._editor)
        self.setFocusProxy(self._editor)
        self._editor.setAccessibleName(self.parameter.title)
        self._editor.setAccessibleDescription(self.parameter.help)
        self._editor.setToolTip(self.parameter.help)
        if isinstance(self._editor, Switch):
            filled(across, (self._editor, STRETCH))
        else:
            across.addWidget(self._editor, 1)
        if self.parameter.kind is Kind.FILE:
            across.addWidget(self._browse())
        column(self, across, self._reason, spacing=2)
        self._judge()

    @property
    def text(self) -> str:
        """What stands in the field."""
        return self.value.text

    def put(self, text: str) -> None:
        """Put text into the field."""
        self.value.put(text)
        self._editor.put(text)
        self._judge()

    def _judge(self) -> None:
        """Mark the field as changed or invalid."""
        colour = "palette(highlight)" if self.value.is_changed else "transparent"
        self._mark.setStyleSheet(f"background: {colour}; border-radius: 1px;")
        self._mark.setToolTip(f"Default: {self.value.default or 'none'}")
        if isinstance(self._editor, QuantityEdit):
            self._editor.setToolTip(f"{self.text}\n{self.parameter.help}".strip())
        say(self._reason, self.value.problem)
        invalid = str(bool(self.value.problem)).lower()
        if self._editor.property("invalid") != invalid:
            self._editor.setProperty("invalid", invalid)
            self._editor.style().unpolish(self._editor)
            self._editor.style().polish(self._editor)

    @property
    def stay(self) -> object:
        """What stands for the keyboard's stay in the field; None where it is not."""
        return self._editor.stay if isinstance(self._editor, QuantityEdit) else None

    def _browse(self) -> QToolButton:
        button = QToolButton()
        button.setText("…")
        button.setAccessibleName(f"Choose {self.parameter.title}")
        button.clicked.connect(self._choose_file)
        return button

    def _choose_file(self) -> None:
        ask_file(self, self.parameter.title, self._take_file)

    def _take_file(self, path: Path) -> None:
        self.put(str(path))
        self.changed.emit()

    def _edited(self) -> None:
        self.value.put(self._editor.text())
        self._judge()
        self.changed.emit()
