"""The menu below the gear."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QMenu, QWidget

from gui.review.run_card import day
from gui.screen.panels import Panels
from gui.screen.screen import Screen
from gui.state import WindowState

RECENT = 8
"""Runs offered."""

Act = Callable[[], object]


@dataclass(frozen=True, kw_only=True)
class MenuActions:
    """What the menu asks of whoever opens it."""

    save_scene: Act
    about_run: Act
    open_skin: Act
    show_studies: Act
    export_view: Act
    part_lanes: Act
    connect: Act
    settings: Act
    copy_command: Act
    help: Act
    about: Act
    quit: Act


class GearMenu(QMenu):
    """What can be asked of the whole window, with the keys that ask the same.

    Args:
        parent: whose menu it is.
        panels: of the window.
        screen: opens scenes and runs.
        recent: scenes opened last.
        acts: the rest.
    """

    def __init__(
        self,
        parent: QWidget,
        panels: Panels,
        screen: Screen,
        recent: list[Path],
        acts: MenuActions,
    ) -> None:
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        session, runs = panels.session, panels.review.runs
        self._add("Open scene …", "Ctrl+O", screen.ask_scene)
        scenes = self.addMenu("Recent scenes")
        for path in recent:
            name = f"{path.stem}    {path.parent}"
            scenes.addAction(name, partial(screen.open_scene, str(path)))
        scenes.setEnabled(bool(recent))
        self._add("Save scene …", "Ctrl+S", acts.save_scene)
        self._add("Open run …", "Ctrl+Shift+O", screen.ask_run)
        last, newest = self.addMenu("Recent runs"), runs.newest(RECENT)
        for entry in newest:
            name = f"{entry.title}    {day(entry.started)}    {entry.status}"
            last.addAction(name, partial(screen.open_run, entry.folder))
        last.setEnabled(bool(newest) and not session.state.in_run)
        self._add("Open a skin …", "", acts.open_skin)
        self._add("Studies …", "", acts.show_studies)
        self._add("About this run …", "Ctrl+I", acts.about_run)
        self._add("Export view …", "Ctrl+E", acts.export_view)
        self._add("Lanes in a window of their own", "Ctrl+L", acts.part_lanes)
        self.addSeparator()
        free = not session.busy and not session.monitor.alive
        use = partial(session.connect_bench, "sim")
        self._add("Use simulated bench", "", use, possible=free)
        self._add("Connect instruments …", "Ctrl+K", acts.connect)
        leave = session.disconnect_bench
        ready = session.state is WindowState.READY
        self._add("Disconnect", "", leave, possible=free and ready)
        self.addSeparator()
        theme = self.addMenu("Theme")
        for word in ("system", "light", "dark"):
            one = theme.addAction(word.capitalize(), partial(panels.theme.choose, word))
            one.setCheckable(True)
            one.setChecked(panels.theme.choice == word)
        self._add("Settings …", "Ctrl+,", acts.settings)
        self.addSeparator()
        self._add("Copy command line", "", acts.copy_command)
        self._add("Help and shortcuts", "?", acts.help)
        self._add("About Tactile Lab", "", acts.about)
        self._add("Quit", "Ctrl+Q", acts.quit)

    def open_below(self, button: QWidget) -> None:
        """Open it below its button."""
        self.popup(button.mapToGlobal(QPoint(0, button.height())))

    def _add(self, words: str, keys: str, act: Act, *, possible: bool = True) -> None:
        # a tab parts the keys; the window has the shortcuts, the menu only names them
        made = self.addAction(f"{words}\t{keys}" if keys else words, act)
        made.setEnabled(possible)
