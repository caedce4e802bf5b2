"""The tables of a scene besides its protocol's: each a form that can be unfolded."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtWidgets import QSizePolicy, QToolButton, QWidget

from gui.look.icons import icon
from gui.look.theme import Theme
from gui.parts import column
from gui.setup.form import Edits, Form
from tactile_lab.quantity import count
from tactile_lab.scene.scene import Scene
from tactile_lab.table import fields_of

TITLES = {
    "record": "Record",
    "detect": "Spike detection",
    "conditions": "Conditions",
    "coil": "Playing the force",
    "bench.coil.limits": "Limits of the coil",
    "sensor": "Sensor, voltages set by hand",
    "simulated": "Simulated bench",
}
"""Tables by their path in a scene, and what they are called."""

LASTING = "conditions"
"""Who measures on what stays where another scene says nothing of it."""


def tables_of(scene: Scene) -> dict[str, Any]:
    """The tables of a scene that have a form, by their path."""
    found = {name: getattr(scene, name) for name in TITLES if "." not in name}
    if scene.bench.coil is not None:
        found["bench.coil.limits"] = scene.bench.coil.limits
    if not scene.bench.simulated:
        del found["simulated"]  # of no effect
    return found


class Section(QWidget):
    """One table under its title; the title tells how much of it was changed."""

    def __init__(self, theme: Theme, name: str, edits: Edits) -> None:
        super().__init__()
        self._theme = theme
        self.form = Form(edits, folded=True)
        self.head = QToolButton()
        self.head.setProperty("role", "section")
        self.head.setCheckable(True)
        self.head.setIconSize(QSize(12, 12))
        self.head.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self.head.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.title = TITLES[name]
        column(self, self.head, self.form, spacing=4)
        self.head.toggled.connect(self._unfold)
        self.form.changed.connect(self.tell)
        theme.changed.connect(self.tell)
        self.tell()

    def _unfold(self, on: bool) -> None:
        self.form.fold(not on)
        self.tell()

    def tell(self) -> None:
        """Say in the title how much is changed, and whether something is wrong."""
        many = len(self.form.changes())
        words = self.title + (f" · {count(many, 'change')}" if many else "")
        if self.form.problem:
            words += " · !"
        self.head.setText(words)
        self.head.setAccessibleName(words)
        name = "chevron" if self.head.isChecked() else "chevron-right"
        self.head.setIcon(icon(name, self._theme.tokens.muted))


class Sections(QWidget):
    """All of them; together they are as a form is."""

    changed = Signal()

    def __init__(self, theme: Theme, edits: Edits) -> None:
        super().__init__()
        rows = column(self, spacing=2)
        self.sections = {name: Section(theme, name, edits) for name in TITLES}
        for section in self.sections.values():
            section.form.changed.connect(self.changed)
            rows.addWidget(section)

    def show_scene(self, scene: Scene, usual: Scene) -> None:
        """Fill all forms.

        Args:
            scene: has the values.
            usual: has those that need not be said.
        """
        kept = self.sections[LASTING].form.changed_texts()
        tables, plain = tables_of(scene), tables_of(usual)
        for name, section in self.sections.items():
            table = tables.get(name)
            section.setVisible(table is not None)
            if table is None:
                section.form.show_table(name, {}, {})
                continue
            keys = fields_of(type(table))
            values = {key: getattr(table, key) for key in keys}
            base = plain.get(name, table)
            section.form.show_table(
                name,
                keys,
                values,
                usual={key: getattr(base, key) for key in keys},
                about=type(table),
            )
        if not self.sections[LASTING].form.changes():
            self.sections[LASTING].form.set_texts(kept)

    def form(self, name: str) -> Form:
        """The form of a table."""
        return self.sections[name].form

    def texts(self) -> dict[str, dict[str, str]]:
        """What stands in the fields, by table."""
        return {name: form.texts() for name, form in self.forms()}

    def changed_texts(self) -> dict[str, dict[str, str]]:
        """What stands in the fields that differ from what is usual, by table."""
        return {name: form.changed_texts() for name, form in self.forms()}

    def propose(self, texts: dict[str, dict[str, str]]) -> None:
        """Put texts into fields; can be undone."""
        for name, form in self.forms():
            form.propose(texts.get(name, {}))

    def set_texts(self, texts: dict[str, dict[str, str]]) -> None:
        """Put texts into fields, without a trace in undo."""
        for name, form in self.forms():
            form.set_texts(texts.get(name, {}))

    @property
    def problem(self) -> str:
        """Why one of them cannot be used, "" if all can."""
        return next((form.problem for _, form in self.forms() if form.problem), "")

    def overrides(self) -> list[str]:
        """What is changed, as ``--set`` options.

        Raises:
            FieldError: a field cannot be used.
        """
        return [text for _, form in self.forms() for text in form.changes()]

    def forms(self) -> Iterator[tuple[str, Form]]:
        """Each form by its table."""
        return ((name, section.form) for name, section in self.sections.items())
