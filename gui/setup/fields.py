"""One editor per parameter: text with a unit, switch, choice, file."""

from __future__ import annotations

from PySide6.QtCore import QRect, Qt, Signal
from PySide6.QtGui import QKeyEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QFileDialog,
    QFrame,
    QHBoxLayout,
    QLineEdit,
    QStyle,
    QStyleOptionFrame,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from gui.parts import label
from gui.setup.kinds import Kind, Parameter
from gui.setup.texts import FieldError, entry_of, exact, text_of
from tactile_lab.errors import QuantityError
from tactile_lab.quantity import parse

NAME = 100
"""Width of the column of names, px: longer ones take two lines."""


INSIDE = 2
"""Margin that a line edit keeps on both sides of its text, px."""


class QuantityEdit(QLineEdit):
    """A line edit; arrow keys change the number by one in its leading digit's place.

    While nobody edits it, text longer than the field is shortened.
    """

    def __init__(self, parameter: Parameter) -> None:
        super().__init__()
        self._parameter = parameter

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
        steps = {Qt.Key.Key_Up: 1, Qt.Key.Key_Down: -1}.get(Qt.Key(event.key()), 0)
        if not steps or unit is None or self._parameter.kind is not Kind.QUANTITY:
            super().keyPressEvent(event)
            return
        try:
            value = parse(self.text(), unit.symbol)
        except QuantityError:
            return
        step = 10.0 ** (len(f"{abs(value):.0e}") and int(f"{abs(value):.0e}"[2:]))
        if value == step and steps < 0:
            step /= 10
        self.setText(exact(float(f"{value + steps * step:.12g}"), unit.symbol))
        self.textEdited.emit(self.text())


class Field(QFrame):
    """Label, mark, editor and the reason why a value cannot be used."""

    changed = Signal()

    def __init__(self, parameter: Parameter, value: object) -> None:
        super().__init__()
        self.parameter = parameter
        self.default = text_of(parameter, parameter.default)
        self.problem = ""
        self._mark = QFrame()
        self._mark.setFixedSize(3, 22)
        self._reason = label("", "error", wrap=True)
        self._reason.hide()
        self._edit: QLineEdit | None = None
        self._box: QComboBox | None = None
        self._check: QCheckBox | None = None
        name = label(parameter.title, wrap=True)
        name.setToolTip(self._tip())
        name.setFixedWidth(NAME)
        row = QHBoxLayout()
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(6)
        row.addWidget(self._mark)
        row.addWidget(name, 0)
        editor = self._editor()
        name.setBuddy(editor)
        self.setFocusProxy(editor)
        editor.setAccessibleName(parameter.title)
        editor.setAccessibleDescription(self._tip())
        editor.setToolTip(self._tip())
        if self._check is None:
            row.addWidget(editor, 1)
        else:
            row.addWidget(editor)
            row.addStretch(1)
        if parameter.kind is Kind.FILE:
            row.addWidget(self._browse())
        whole = QVBoxLayout(self)
        whole.setContentsMargins(0, 0, 0, 0)
        whole.setSpacing(2)
        whole.addLayout(row)
        whole.addWidget(self._reason)
        self.set_text(text_of(parameter, value))

    @property
    def text(self) -> str:
        """What stands in the field."""
        if self._check is not None:
            return str(self._check.isChecked())
        if self._box is not None:
            return self._box.currentText()
        assert self._edit is not None
        return self._edit.text()

    def set_text(self, text: str) -> None:
        """Put text into the field."""
        if self._check is not None:
            self._check.setChecked(text == "True")
        elif self._box is not None:
            self._box.setCurrentText(text)
        elif self._edit is not None:
            self._edit.setText(text)
            self._edit.setCursorPosition(0)
        self.check()

    @property
    def is_changed(self) -> bool:
        """Whether the value differs from the protocol's own default."""
        return self.text.strip() != self.default

    def entry(self) -> str | None:
        """What a scene file would hold; None to leave the key out.

        Raises:
            FieldError: it cannot be used.
        """
        return entry_of(self.parameter, self.text)

    def check(self) -> None:
        """Mark the field as changed or invalid."""
        try:
            self.entry()
            self.problem = ""
        except FieldError as error:
            self.problem = str(error)
        self.show_problem(self.problem)
        colour = "palette(highlight)" if self.is_changed else "transparent"
        self._mark.setStyleSheet(f"background: {colour}; border-radius: 1px;")
        self._mark.setToolTip(f"Default: {self.default or 'none'}")
        if self._edit is not None:
            self._edit.setToolTip(f"{self.text}\n{self._tip()}".strip())

    def show_problem(self, problem: str) -> None:
        """Show why the value cannot be used, "" if it can."""
        self._reason.setText(problem)
        self._reason.setVisible(bool(problem))
        if (
            self._edit is not None
            and self._edit.property("invalid") != str(bool(problem)).lower()
        ):
            self._edit.setProperty("invalid", str(bool(problem)).lower())
            self._edit.style().unpolish(self._edit)
            self._edit.style().polish(self._edit)

    def lock(self, locked: bool) -> None:
        """Forbid or allow editing."""
        for editor in (self._edit, self._box, self._check):
            if editor is not None:
                editor.setEnabled(not locked)

    def _tip(self) -> str:
        unit = self.parameter.unit
        limits = unit.limits() if unit is not None else ""
        parts = [self.parameter.help, f"Allowed: {limits}." if limits else ""]
        if self.default:
            parts.append(f"Default: {self.default}.")
        return " ".join(part for part in parts if part)

    def _editor(self) -> QWidget:
        if self.parameter.kind is Kind.SWITCH:
            self._check = QCheckBox()
            self._check.toggled.connect(self._edited)
            return self._check
        if self.parameter.kind is Kind.CHOICE:
            self._box = QComboBox()
            self._box.addItems(list(self.parameter.choices))
            self._box.currentTextChanged.connect(self._edited)
            return self._box
        self._edit = QuantityEdit(self.parameter)
        self._edit.textEdited.connect(self._edited)
        if self.parameter.optional:
            self._edit.setPlaceholderText("automatic")
        elif not self.parameter.required and not self.default:
            self._edit.setPlaceholderText("none")
        if self.parameter.kind in (Kind.QUANTITY, Kind.INTEGER, Kind.NUMBER):
            self._edit.setAlignment(Qt.AlignmentFlag.AlignRight)
        return self._edit

    def _browse(self) -> QToolButton:
        button = QToolButton()
        button.setText("…")
        button.setAccessibleName(f"Choose {self.parameter.title}")
        button.clicked.connect(self._choose_file)
        return button

    def _choose_file(self) -> None:
        name, _ = QFileDialog.getOpenFileName(self, self.parameter.title)
        if name:
            self.set_text(name)
            self.changed.emit()

    def _edited(self) -> None:
        self.check()
        self.changed.emit()
