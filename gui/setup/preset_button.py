"""The star: keep the form's parameters under a name, and take them up again."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtCore import QPoint, Signal
from PySide6.QtWidgets import QLineEdit, QWidgetAction

from gui.look.theme import Theme
from gui.parts import IconButton
from gui.popup_menu import Menu
from gui.setup.form import Form
from gui.setup.parameter import FieldError, text_of
from gui.setup.presets import parameters, presets, save_preset
from tactile_lab.engine.request import Request
from tactile_lab.errors import SceneError, TactileLabError
from tactile_lab.whole_file import failing_as


class PresetButton(IconButton):
    """A filled star while the form shows one of its protocol's presets.

    Attributes:
        name: of a new one, in the menu that was opened last.
    """

    failed = Signal(str)
    asked = Signal(str, str, str, object)
    """Before one is replaced or deleted: question, what is lost, the answer for which
    the last is done."""

    def __init__(
        self, theme: Theme, form: Form, folder: Path, request: Callable[[], Request]
    ) -> None:
        super().__init__(theme, "star", "Presets of this protocol")
        self._form, self._folder, self._request = form, folder, request
        self._read: dict[Path, tuple[int, dict[str, object]]] = {}
        self.name = QLineEdit()
        self.clicked.connect(self.open_menu)

    def mark(self) -> None:
        """Fill the star where the form shows a preset."""
        shown = self.shown()
        self.set_icon("starred" if shown else "star")
        words = f"Preset: {shown}" if shown else "Presets of this protocol"
        self.setToolTip(words)
        self.setAccessibleName(words)

    def shown(self) -> str:
        """Name of the preset that the form shows, "" for none."""
        now = self._form.texts()
        for name, file in self._presets().items():
            try:
                if self._texts(file) == now:
                    return name
            except TactileLabError:
                continue  # told when somebody takes it up
        return ""

    def save(self, name: str) -> None:
        """Keep the form's parameters; where a preset has that name, ask first."""
        name = name.strip()
        if name not in self._presets() or name == self.shown():
            self._save(name)
            return
        self.asked.emit(
            f"Replace the preset “{name}”?",
            "What it holds now is lost; the form keeps what stands in it.",
            "Replace it",
            partial(self._save, name),
        )

    def _save(self, name: str) -> None:
        try:
            save_preset(self._folder, name, self._request().load())
        except (TactileLabError, FieldError) as error:
            self.failed.emit(str(error))
        self.mark()

    def use(self, file: Path) -> None:
        """Put a preset's parameters into the form; can be undone."""
        try:
            self._form.propose(self._texts(file))
        except TactileLabError as error:
            self.failed.emit(str(error))

    def open_menu(self) -> None:
        """Open the menu below the star."""
        self.menu_of_presets().popup(self.mapToGlobal(QPoint(0, self.height())))
        self.name.setFocus()

    def menu_of_presets(self) -> Menu:
        """A menu with the presets, a name for a new one, and to delete."""
        menu, shown, found = Menu(self), self.shown(), self._presets()
        menu.aboutToHide.connect(menu.deleteLater)
        for name, file in found.items():
            action = menu.addAction(name, partial(self.use, file))
            action.setCheckable(True)
            action.setChecked(name == shown)
        if not found:
            menu.addAction("No presets yet").setEnabled(False)
        menu.addSeparator()
        self.name = QLineEdit()
        self.name.setPlaceholderText("Keep these parameters as …")
        self.name.setAccessibleName("Name of the new preset")
        self.name.setMinimumWidth(220)
        field = QWidgetAction(menu)
        field.setDefaultWidget(self.name)
        menu.addAction(field)
        self.name.returnPressed.connect(partial(self._save_and_close, menu))
        if found:
            menu.addSeparator()
            out = menu.addMenu("Delete")
            for name, file in found.items():
                out.addAction(name, partial(self._ask_to_delete, name, file))
        return menu

    def _save_and_close(self, menu: Menu) -> None:
        menu.close()
        self.save(self.name.text())

    def _ask_to_delete(self, name: str, file: Path) -> None:
        self.asked.emit(
            f"Delete the preset “{name}”?",
            f"{file} goes for good; the form keeps what stands in it.",
            "Delete it",
            partial(self._delete, file),
        )

    def _delete(self, file: Path) -> None:
        try:
            with failing_as(f"The preset {file} was not deleted", kind=SceneError):
                file.unlink(missing_ok=True)
        except SceneError as error:
            self.failed.emit(str(error))
        self.mark()

    def _presets(self) -> dict[str, Path]:
        kind = self._form.protocol
        return {} if kind is None else presets(self._folder, kind.name)

    def _texts(self, file: Path) -> dict[str, str]:
        """A preset as it stands in the form's fields."""
        with failing_as(f"The preset {file} cannot be read", kind=SceneError):
            changed = file.stat().st_mtime_ns
        if self._read.get(file, (0, {}))[0] != changed:
            self._read[file] = (changed, parameters(file))
        values = self._read[file][1]
        return {
            asked.key: text_of(asked, values[asked.key])
            for asked in (value.parameter for value in self._form.values)
            if asked.key in values
        }
