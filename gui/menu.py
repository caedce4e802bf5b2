"""The menu below the gear."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QWidget

from gui.header.header import Header
from gui.popup_menu import Menu
from gui.review.run_card import day
from gui.screen.panels import Panels
from gui.screen.screen import Screen
from gui.state import WindowState

RECENT = 8
"""Runs offered."""

Act = Callable[[], object]


class GearMenu(Menu):
    """What can be asked of the whole window, with the keys that ask the same.

    Args:
        parent: whose menu it is.
        panels: of the window.
        screen: opens scenes and runs.
        recent: scenes opened last.
        acts: what else is asked, by its keys, or by its words where it has none.
    """

    def __init__(
        self,
        parent: QWidget,
        panels: Panels,
        screen: Screen,
        recent: list[Path],
        acts: Mapping[str, Act],
    ) -> None:
        super().__init__(parent)
        self._acts = acts
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        session, runs = panels.session, panels.review.runs
        self._add("Open scene …", "Ctrl+O")
        scenes = self.addMenu("Recent scenes")
        for path in recent:
            name = f"{path.stem}    {path.parent}"
            scenes.addAction(name, partial(screen.open_scene, str(path)))
        scenes.setEnabled(bool(recent))
        self._add("Save scene …", "Ctrl+S")
        self._add("Open run …", "Ctrl+Shift+O")
        last, newest = self.addMenu("Recent runs"), runs.newest(RECENT)
        for entry in newest:
            name = f"{entry.title}    {day(entry.started)}    {entry.status}"
            last.addAction(name, partial(screen.open_run, entry.folder))
        last.setEnabled(bool(newest) and not session.state.in_run)
        self._add("Open a skin …")
        self._add("Studies …")
        self._add("About this run …", "Ctrl+I")
        self._add("Export view …", "Ctrl+E")
        self._add("Lanes in a window of their own", "Ctrl+L")
        self.addSeparator()
        free = not session.busy and not session.monitor.alive
        use = partial(session.connect_bench, "sim")
        self.addAction("Use simulated bench", use).setEnabled(free)
        self._add("Connect instruments …", "Ctrl+K")
        leave = self.addAction("Disconnect", session.disconnect_bench)
        leave.setEnabled(free and session.state is WindowState.READY)
        self.addSeparator()
        theme = self.addMenu("Theme")
        for word in ("system", "light", "dark"):
            one = theme.addAction(word.capitalize(), partial(panels.theme.choose, word))
            one.setCheckable(True)
            one.setChecked(panels.theme.choice == word)
        self._add("Settings …", "Ctrl+,")
        self.addSeparator()
        self._add("Copy command line")
        self._add("Help and shortcuts", "?")
        self._add("About Tactile Lab")
        self._add("Quit", "Ctrl+Q")

    def open_below(self, header: Header) -> None:
        """Open it at its button, below all of the header: STOP stays whole.

        Where the screen is too low for that, Qt moves it up: it is left of STOP then.
        """
        place = header.menu_button.mapToGlobal(QPoint())
        place.setY(header.mapToGlobal(QPoint(0, header.height())).y())
        size, screen = self.sizeHint(), self.screen().availableGeometry()
        if place.y() + size.height() > screen.bottom():
            stop = header.stop.mapToGlobal(QPoint()).x()
            place.setX(max(screen.left(), min(place.x(), stop - size.width())))
        self.popup(place)

    def _add(self, words: str, keys: str = "") -> None:
        # a tab parts the keys; the window has the shortcuts, the menu only names them
        act = self._acts[words if words in self._acts else keys]
        self.addAction(f"{words}\t{keys}" if keys else words, act)
