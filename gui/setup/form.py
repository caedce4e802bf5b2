"""The form: generated from the typed keys of a protocol, or of any table of a scene."""

from __future__ import annotations

from collections.abc import Mapping

from pydantic.fields import FieldInfo
from PySide6.QtCore import Signal
from PySide6.QtGui import QUndoCommand, QUndoStack
from PySide6.QtWidgets import QWidget

from gui.parts import column, empty
from gui.setup.fields import Field
from gui.setup.parameter import parameter
from tactile_lab.table import described
from tactile_lab.trial import Protocol


class Form(QWidget):
    """Fields of one protocol; undo and redo reach back to the last protocol chosen."""

    changed = Signal()

    def __init__(self, undo: QUndoStack | None = None) -> None:
        super().__init__()
        self.fields: list[Field] = []
        self.undo = undo or QUndoStack(self)
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
        self.fields = []
        for key, info in keys.items():
            wanted = parameter(key, info, said.get(key, ""))
            plain = None if usual is None else usual.get(key)
            field = Field(wanted, values.get(key, wanted.default), plain)
            field.changed.connect(self._edited)
            self.fields.append(field)
            self._rows.addWidget(field)
        self.undo.clear()
        self._shown = self.texts()
        self.changed.emit()

    def field(self, key: str) -> Field:
        """The field of a parameter."""
        return next(field for field in self.fields if field.parameter.key == key)

    def texts(self) -> dict[str, str]:
        """What stands in the fields."""
        return {field.parameter.key: field.text for field in self.fields}

    def set_texts(self, texts: dict[str, str]) -> None:
        """Put texts into fields, without a trace in undo."""
        for field in self.fields:
            if field.parameter.key in texts:
                field.set_text(texts[field.parameter.key])
        self._shown = self.texts()
        self.changed.emit()

    def propose(self, texts: dict[str, str]) -> None:
        """Put texts into fields; can be undone."""
        for field in self.fields:
            if field.parameter.key in texts:
                field.set_text(texts[field.parameter.key])
        self._edited()

    def reset(self) -> None:
        """Put every parameter back to its default; can be undone."""
        self.propose({field.parameter.key: field.default for field in self.fields})

    def undo_edit(self) -> None:
        """Take the last edit back."""
        self.undo.undo()

    def redo_edit(self) -> None:
        """Make the edit again that was taken back."""
        self.undo.redo()

    @property
    def problem(self) -> str:
        """Why the form cannot be used, "" if it can."""
        for field in self.fields:
            if field.problem:
                return f"{field.parameter.title}: {field.problem}"
        return ""

    def overrides(self) -> list[str]:
        """The form as ``--set`` options: ``table.key=value``.

        Raises:
            FieldError: a field cannot be used.
        """
        made = []
        for field in self.fields:
            entry = field.entry()
            if entry is not None:
                made.append(f"{self._table}.{field.parameter.key}={entry}")
        return made

    def changes(self) -> list[str]:
        """As `overrides`, of what differs from what is usual."""
        made = []
        for field in self.fields:
            if field.is_changed and not field.problem:
                entry = field.entry()
                if entry is not None:
                    made.append(f"{self._table}.{field.parameter.key}={entry}")
        return made

    def changed_texts(self) -> dict[str, str]:
        """What stands in the fields that differ from what is usual."""
        return {f.parameter.key: f.text for f in self.fields if f.is_changed}

    def _edited(self) -> None:
        now = self.texts()
        if now != self._shown:
            self.undo.push(_Edit(self, self._shown, now, self._typed_in()))
            self._shown = now
        self.changed.emit()

    def _typed_in(self) -> object:
        """The stay of the keyboard in a field; None while it is in none."""
        for field in self.fields:
            if (stay := field.stay) is not None:
                return stay
        return None


class _Edit(QUndoCommand):
    """One change of the form."""

    def __init__(
        self, form: Form, before: dict[str, str], after: dict[str, str], stay: object
    ) -> None:
        super().__init__("edit")
        self.stay = stay
        self._form, self._before, self.after = form, before, after
        self._done = True

    def id(self) -> int:
        """Of all edits, so that Qt offers each to the one before it."""
        return 1

    def mergeWith(self, later: QUndoCommand) -> bool:
        """Take in what was typed during the same stay in a field."""
        assert isinstance(later, _Edit)
        if self.stay is None or later.stay is not self.stay:
            return False
        self.after = later.after
        return True

    def undo(self) -> None:
        """Put the former texts back."""
        self._done = False
        self._form.set_texts(self._before)

    def redo(self) -> None:
        """Put the later texts back; the first time they stand there already."""
        if not self._done:
            self._form.set_texts(self.after)
        self._done = True
