"""The form: generated from the typed keys of a protocol, or of any table of a scene."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from pydantic.fields import FieldInfo
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget

from gui.parts import column, empty
from gui.setup.fields import Field
from gui.setup.parameter import FieldText, opened, parameter, value_at
from tactile_lab.table import described
from tactile_lab.trial import Protocol


@dataclass
class _Edit:
    """One change of a form; `stay` is the keyboard's in a field, None without one."""

    form: Form
    before: dict[str, str]
    after: dict[str, str]
    stay: object


class Edits:
    """What was changed in one form or several, to be taken back in turn.

    Qt's own stack of commands ended the process where Python collected a form with it.
    """

    def __init__(self) -> None:
        self._done: list[_Edit] = []
        self._undone: list[_Edit] = []

    def __len__(self) -> int:
        return len(self._done)

    def add(self, edit: _Edit) -> None:
        """Keep a change; what is typed during one stay in a field is one."""
        self._undone.clear()
        last = self._done[-1] if self._done else None
        if last is not None and edit.stay is not None and last.stay is edit.stay:
            last.after = edit.after
        else:
            self._done.append(edit)

    def undo(self) -> None:
        """Take the last change back, if there is one."""
        if self._done:
            edit = self._done.pop()
            self._undone.append(edit)
            edit.form.set_texts(edit.before)

    def redo(self) -> None:
        """Make the change again that was taken back last."""
        if self._undone:
            edit = self._undone.pop()
            self._done.append(edit)
            edit.form.set_texts(edit.after)

    def clear(self) -> None:
        """Forget all changes."""
        self._done.clear()
        self._undone.clear()


class Form(QWidget):
    """Fields of one protocol; undo and redo reach back to the last protocol chosen.

    Attributes:
        values: what stands in the fields, in their order.
        fields: where one sees it; none while the form is folded.
    """

    changed = Signal()

    def __init__(self, edits: Edits | None = None, *, folded: bool = False) -> None:
        super().__init__()
        self.values: list[FieldText] = []
        self.fields: list[Field] = []
        self._folded = folded
        if folded:
            self.hide()
        self.edits = Edits() if edits is None else edits
        self.protocol: type[Protocol] | None = None
        self._shown: dict[str, str] = {}
        self._table = "protocol"
        self._rows = column(self, spacing=6)

    def show_protocol(self, kind: type[Protocol], values: dict[str, object]) -> None:
        """Make the fields of a protocol; `values` are SI, by key."""
        self.protocol = kind
        self.show_table("protocol", kind.parameters(), values)

    def show_table(
        self,
        name: str,
        keys: Mapping[str, FieldInfo],
        values: Mapping[str, object],
        usual: Mapping[str, object] | None = None,
        about: type | None = None,
    ) -> None:
        """Make the fields of a table of a scene.

        Args:
            name: of the table, such as "record".
            keys: what it may hold, as `tactile_lab.table.fields_of` tells.
            values: SI, by key; the default where one is not among them.
            usual: SI, by key: what need not be said; the defaults unless given.
            about: whose docstring says what the keys are, where their types do not.
        """
        said = {} if about is None else described(about)
        empty(self._rows)
        self._table = name
        self.fields, self.values = [], []
        for name, table in keys.items():
            for key, info, words in opened(name, table, said.get(name, "")):
                wanted = parameter(key, info, words)
                plain = None if usual is None else value_at(usual, key)
                text = FieldText(wanted, value_at(values, key, wanted.default), plain)
                self.values.append(text)
        if not self._folded:
            self._make_fields()
        self.edits.clear()
        self._shown = self.texts()
        self.changed.emit()

    def fold(self, folded: bool) -> None:
        """Show the fields, or hide them; they are made when they are first shown."""
        self._folded = folded
        if not folded and not self.fields:
            self._make_fields()
        self.setVisible(not folded)

    def _make_fields(self) -> None:
        for value in self.values:
            field = Field(value)
            field.changed.connect(self._edited)
            self.fields.append(field)
            self._rows.addWidget(field)

    def field(self, key: str) -> Field:
        """The field of a parameter, of a form that is not folded."""
        return next(field for field in self.fields if field.parameter.key == key)

    def value(self, key: str) -> FieldText:
        """What stands in the field of a parameter."""
        return next(value for value in self.values if value.parameter.key == key)

    def texts(self) -> dict[str, str]:
        """What stands in the fields."""
        return {value.parameter.key: value.text for value in self.values}

    def set_texts(self, texts: dict[str, str]) -> None:
        """Put texts into fields, without a trace in undo."""
        self._put(texts)
        self._shown = self.texts()
        self.changed.emit()

    def propose(self, texts: dict[str, str]) -> None:
        """Put texts into fields; can be undone."""
        self._put(texts)
        self._edited()

    def _put(self, texts: dict[str, str]) -> None:
        for where in self.fields or self.values:
            text = texts.get(where.parameter.key)
            if text is not None:
                where.put(text)

    def reset(self) -> None:
        """Put every parameter back to its default; can be undone."""
        self.propose({value.parameter.key: value.default for value in self.values})

    @property
    def problem(self) -> str:
        """Why the form cannot be used, "" if it can."""
        for value in self.values:
            if value.problem:
                return f"{value.parameter.title}: {value.problem}"
        return ""

    def overrides(self) -> list[str]:
        """The form as ``--set`` options: ``table.key=value``.

        Raises:
            FieldError: a field cannot be used.
        """
        return self._entries(self.values)

    def changes(self) -> list[str]:
        """As `overrides`, of what differs from what is usual."""
        changed = (v for v in self.values if v.is_changed and not v.problem)
        return self._entries(changed)

    def _entries(self, values: Iterable[FieldText]) -> list[str]:
        found = ((value.parameter.key, value.entry()) for value in values)
        return [
            f"{self._table}.{key}={text}" for key, text in found if text is not None
        ]

    def changed_texts(self) -> dict[str, str]:
        """What stands in the fields that differ from what is usual."""
        return {v.parameter.key: v.text for v in self.values if v.is_changed}

    def _edited(self) -> None:
        now = self.texts()
        if now != self._shown:
            self.edits.add(_Edit(self, self._shown, now, self._typed_in()))
            self._shown = now
        self.changed.emit()

    def _typed_in(self) -> object:
        """The stay of the keyboard in a field; None while it is in none."""
        for field in self.fields:
            if (stay := field.stay) is not None:
                return stay
        return None
