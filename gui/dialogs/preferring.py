"""The card with what a user prefers."""

from __future__ import annotations

from functools import partial
from os.path import expanduser  # that of Path raises where nobody is so called
from pathlib import Path

from PySide6.QtWidgets import QApplication, QCheckBox, QLayout, QLineEdit, QWidget

from gui.ask_file import ask_file
from gui.dialogs.overlay import Overlay
from gui.parts import (
    SCROLL_BAR,
    STRETCH,
    Part,
    column,
    label,
    line,
    line_edit,
    push,
    row,
    say,
    scrolling,
    stack,
    with_gutter,
)
from gui.preferences import Preferences, from_anywhere
from tactile_lab.errors import RunFolderError, TactileLabError
from tactile_lab.scene.load import load_bench

SWITCHES = {
    "sound": "Ring the desktop's bell as a run ends, and three times at a fault",
    "monitor": "Watch the sensor as soon as a bench is ready (coil off)",
    "reports": "Write the report at the end of each run",
    "lsl": "Publish each run live to other programs (Lab Streaming Layer)",
}

PAGE = 260
"""Height of all that is to be set, where the window is high enough, px."""


class PreferencesCard(Overlay):
    """Saved at once where they are valid."""

    def __init__(self, window: QWidget, preferences: Preferences) -> None:
        super().__init__(window, 560)
        self._preferences = preferences
        self.folder = line_edit("Folder for runs", "runs")
        self.bench = line_edit("Bench at the start", "the last; sim, none, or a file")
        self.switches = {key: QCheckBox(words) for key, words in SWITCHES.items()}
        # a desktop may keep its bell silent, and nothing else would tell
        self.switches["sound"].clicked.connect(lambda on: on and QApplication.beep())
        self.problem = label("", "error", wrap=True)
        self.save = push("Save", "primary")
        self.close_button = push("Close")
        self.save.clicked.connect(self._save)
        self.close_button.clicked.connect(self.hide)
        note = label(
            "Folder and bench hold where the command line says nothing else: "
            "--out and --bench.",
            "muted",
            wrap=True,
        )
        page = QWidget()
        parts: tuple[Part, ...] = (
            self._chosen("Folder for runs", self.folder, folder=True),
            self._chosen("Bench at the start", self.bench, folder=False),
            *(note, self.problem, line(), *self.switches.values()),
        )
        area = with_gutter(scrolling(page), column(page, *parts, spacing=12))
        foot = row(STRETCH, self.close_button, self.save, spacing=12)
        whole = label("Settings", "big"), area, foot
        # its scroll bar lies in the card's margin: fields end where Save does
        rows = stack(self.card, whole, area, spacing=12)
        rows.setContentsMargins(22, 22, 22 - SCROLL_BAR, 22)
        self.give_room(area, PAGE)

    def show_preferences(self) -> None:
        """Open the card."""
        self.folder.setText(str(self._preferences.chosen_folder))
        self.bench.setText(self._preferences.chosen_bench)
        for key, switch in self.switches.items():
            switch.setChecked(self._preferences.wants(key))
        say(self.problem, "")
        self.open()
        self.folder.setFocus()

    def _save(self) -> None:
        folder = expanduser(self.folder.text().strip())
        bench = self.bench.text().strip()
        try:
            check_folder(Path(folder))
            if bench not in ("", "none"):
                bench = from_anywhere(bench)
                load_bench(bench)
        except (TactileLabError, OSError) as error:
            say(self.problem, str(error))
            return
        self._preferences.set(
            folder=folder,
            bench=bench,
            **{key: switch.isChecked() for key, switch in self.switches.items()},
        )
        self.hide()

    def _chosen(self, words: str, edit: QLineEdit, *, folder: bool) -> QLayout:
        name = label(words)
        name.setFixedWidth(130)
        browse = push("…", name=f"Choose: {words}")
        kinds = "" if folder else "Bench files (*.toml)"
        put = partial(self._put, edit)
        browse.clicked.connect(
            lambda: ask_file(self, words, put, folder=folder, kinds=kinds)
        )
        return row(name, (edit, 1), browse, spacing=8)

    def _put(self, edit: QLineEdit, path: Path) -> None:
        edit.setText(str(path))


def check_folder(folder: Path) -> None:
    """Refuse what can never be a folder for runs; it need not be there yet.

    Raises:
        RunFolderError: it, or what it would lie in, is a file.
    """
    there = next((one for one in (folder, *folder.parents) if one.exists()), None)
    if there is not None and not there.is_dir():
        raise RunFolderError(f"{there} is a file: choose a folder for runs.")
