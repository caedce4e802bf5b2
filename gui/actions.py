"""Shortcuts and the menu.

Single keys are taken only where no widget wanted them: text fields keep their letters,
buttons their space bar.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtGui import (
    QContextMenuEvent,
    QGuiApplication,
    QKeyEvent,
    QKeySequence,
    QShortcut,
)
from PySide6.QtWidgets import QAbstractButton, QApplication, QWidget

from gui.ask_file import ask_file
from gui.banner import Banner
from gui.dialogs.closing import Closing
from gui.dialogs.overlay import Overlay
from gui.look.theme import Theme
from gui.menu import Act, GearMenu
from gui.parts import IconButton
from gui.preferences import Preferences
from gui.run_actions import RunActions
from gui.screen.panels import Panels
from gui.screen.screen import Screen
from gui.stop_anywhere import StopAnywhere
from gui.tab_order import enter_next, scroll
from gui.within_reach import fit
from tactile_lab.engine.threads import start
from tactile_lab.errors import TactileLabError

IN_CARDS = ("PgUp", "PgDown", "Return", "Enter")
"""Single keys that act within an open card, too."""

BELOW_CARDS = frozenset(
    "Ctrl+R Ctrl+Return Ctrl+Shift+Return Ctrl+Z Ctrl+Y Ctrl+Shift+Z Ctrl+M Ctrl+N "
    "Ctrl+F Ctrl+1 Ctrl+2 Ctrl+3 Ctrl+4".split()
)
"""Keys that act on what an open card hides, or lead there: not while it is open."""


@dataclass(frozen=True)
class Shortcut:
    """One shortcut.

    Attributes:
        written: its keys as `QKeySequence` has them, a space between two.
        words: what it does, for the list.
        act: does it.
        repeats: acts again and again while it is held down.
    """

    written: str
    words: str
    act: Callable[[], object]
    repeats: bool = False

    @property
    def keys(self) -> list[str]:
        """Each of its keys."""
        return self.written.split()

    @property
    def single(self) -> bool:
        """Whether it has neither Ctrl nor F1 to F12: fields and buttons come first."""
        return re.match(r"Ctrl\+|(Shift\+)?F\d", self.written) is None


class Actions(QObject):
    """All shortcuts of the panels.

    Args:
        window: has the shortcuts, is closed and pictured.
        panels: what they work on.
        screen: opens scenes and runs.
        runs: what can be done with runs on disk.
        closing: the question in which Esc is not STOP.
        preferences: of the user.
    """

    fold_asked = Signal(QWidget, bool)
    """Fold a side panel, or unfold it."""
    lanes_asked = Signal()
    """Put the lanes into a window of their own, or back."""
    _skin_read = Signal(object)
    _skin_failed = Signal(str)

    def __init__(
        self,
        window: QWidget,
        panels: Panels,
        screen: Screen,
        runs: RunActions,
        closing: Closing,
        preferences: Preferences,
    ) -> None:
        super().__init__(window)
        self.window, self.panels, self.screen = window, panels, screen
        self.runs, self.preferences = runs, preferences
        self._closing = closing
        self._grabbed = 1
        self.keys = self._all()
        self.bind(window)
        once = frozenset(
            QKeySequence(keys).toString()
            for key in self.keys
            for keys in key.keys
            if not key.single and not key.repeats
        )
        stop = StopAnywhere(window, panels.stops, closing, panels.session, once)
        self._is_held = stop.keys.is_held
        self._skin_read.connect(self._show_skin)
        self._skin_failed.connect(screen.say)
        panels.header.help_asked.connect(lambda: self.show_help())
        for part, button, _ in self._helped:
            button.clicked.connect(
                lambda _=False, part=part: self._help_on(lambda one: one is part)
            )
        panels.header.menu_asked.connect(self.show_menu)
        panels.header.picture_asked.connect(self.copy_picture)

    def bind(self, window: QWidget) -> None:
        """Let all keys but the single ones act in a window."""
        for key in self.keys:
            for keys in () if key.single else key.keys:
                shortcut = QShortcut(QKeySequence(keys), window)
                shortcut.activated.connect(partial(self._act, key, keys))

    def _act(self, key: Shortcut, pressed: str) -> None:
        if self._closing.isVisible():  # what a key opens would lie above the question
            return
        if self._card() is None or pressed not in BELOW_CARDS:
            key.act()

    def take_key(self, event: QKeyEvent) -> bool:
        """A key no widget wanted; whether it was one of the single ones.

        None acts on what lies hidden below a card.
        """
        pressed, covered = _written(event), self._card() is not None
        if pressed in ("Left", "Right") and _chooses():
            return True  # at the end of the choices: nothing else moves by it
        for key in self.keys:
            if key.single and pressed in key.keys:
                if covered and pressed not in IN_CARDS:
                    return False
                if key.repeats or not self._is_held(event):
                    key.act()
                return True
        return False

    def _all(self) -> list[Shortcut]:
        panels, there = self.panels, self._there
        tools, view = panels.centre.tools, panels.centre.view
        write_note = there(panels.centre.write_note)
        cross = panels.centre.stack.scene.toggle_crosshair
        form, stepped = panels.setup.form, panels.review.spikes.stepped.emit
        return [
            Shortcut("Ctrl+R", "Run", panels.setup.start),
            Shortcut("Ctrl+Return", "Queue; save a queued run", panels.setup.enqueue),
            Shortcut(
                "Ctrl+Shift+Return", "Start the queue", panels.session.start_queue
            ),
            Shortcut("Space", "Freeze the display", tools.freeze.click),
            Shortcut("F", "Follow", tools.follow.click),
            Shortcut("A", "Fit the whole run", view.show_all),
            Shortcut("Z", "Zoom to a box", tools.zoom.click),
            Shortcut("C", "Cursors", tools.cursors.click),
            Shortcut("1", "Grab cursor A", lambda: self._grab(0)),
            Shortcut("2", "Grab cursor B", lambda: self._grab(1)),
            Shortcut("M", "Model", tools.twin.click),
            Shortcut("Shift+M", "Residual", tools.residual.click),
            Shortcut("+ =", "Zoom in", lambda: view.zoom(1.5), repeats=True),
            Shortcut("-", "Zoom out", lambda: view.zoom(1 / 1.5), repeats=True),
            Shortcut("Backspace", "The view before", view.back, repeats=True),
            Shortcut("Shift+Backspace", "Forward again", view.forward, repeats=True),
            Shortcut("X", "Crosshair", cross),
            Shortcut("L", "Choose lanes", tools.lanes.click),
            Shortcut("Left", "Earlier", lambda: self._nudge(-1), repeats=True),
            Shortcut("Right", "Later", lambda: self._nudge(1), repeats=True),
            Shortcut(".", "Next spike", lambda: stepped(1), repeats=True),
            Shortcut(",", "The spike before", lambda: stepped(-1), repeats=True),
            Shortcut("Ctrl+M", "Monitor the sensor", tools.monitor.click),
            Shortcut("Home", "Start of the run", self._home),
            Shortcut("End", "End of the run", lambda: view.set_follow(True)),
            Shortcut("N", "Note", write_note),
            Shortcut("Ctrl+N", "Note, from a field", write_note),
            Shortcut("Ctrl+O", "Open a scene", self.screen.ask_scene),
            Shortcut("Ctrl+Shift+O", "Open a run", self.screen.ask_run),
            Shortcut("Ctrl+K", "Connect instruments", there(self.connect_dialog)),
            Shortcut("Ctrl+,", "Settings", there(self.show_preferences)),
            Shortcut("Ctrl+Q", "Quit", self.window.close),
            Shortcut("Ctrl+S", "Save the scene", lambda: self.save_scene()),
            Shortcut("Ctrl+E", "Export the view", lambda: self.export_view()),
            Shortcut("Ctrl+F", "Search runs", there(self._search)),
            Shortcut("Ctrl+I", "About the run: notes", there(self.runs.about_shown)),
            Shortcut("F5", "Read the runs anew", self.screen.list_runs),
            Shortcut("Ctrl+1", "Results", there(lambda: self._tab(0))),
            Shortcut("Ctrl+2", "Runs", there(lambda: self._tab(1))),
            Shortcut("Ctrl+3", "Manual", there(lambda: self._tab(2))),
            Shortcut("Ctrl+4", "Spikes", there(lambda: self._tab(3))),
            Shortcut("Ctrl+Z", "Undo in the form", form.edits.undo, repeats=True),
            Shortcut(
                "Ctrl+Y Ctrl+Shift+Z", "Redo in the form", form.edits.redo, repeats=True
            ),
            Shortcut("Return Enter", "Press the button that has the keyboard", _press),
            Shortcut("F7", "Fold the left panel", lambda: self._fold(panels.setup)),
            Shortcut("F8", "Fold the right panel", lambda: self._fold(panels.review)),
            Shortcut("F6", "The next panel", lambda: self._enter(True)),
            Shortcut("Shift+F6", "The panel before", lambda: self._enter(False)),
            Shortcut("PgUp", "Scroll up", lambda: self._scroll(-1), repeats=True),
            Shortcut("PgDown", "Scroll down", lambda: self._scroll(1), repeats=True),
            Shortcut("F10", "Menu", self.show_menu),
            Shortcut("Shift+F10", "Menu of what has the keyboard", _ask_menu),
            Shortcut("F11", "Lanes only", self._focus),
            Shortcut("Ctrl+L", "Lanes in a window of their own", self.lanes_asked.emit),
            Shortcut("Ctrl+Shift+C", "Copy a picture", self.copy_picture),
            Shortcut(
                "? F1",
                "Help on the panel that has the keyboard, and shortcuts",
                there(self._help_here),
            ),
        ]

    def _there(self, act: Callable[[], object]) -> Callable[[], None]:
        """Act, and bring the window the keyboard: the lanes' own may have had it."""

        def acted() -> None:
            act()
            self.window.activateWindow()

        return acted

    def _enter(self, forward: bool) -> None:
        """Give the keyboard to a panel: fault, form, lanes, log, results, header.

        To a new fault first, wherever the keyboard is.
        """
        card, panels, active = self._card(), self.panels, QApplication.activeWindow()
        centre, faults = panels.centre, self.window.findChildren(Banner)
        parts = (*faults, panels.setup, centre.lanes, centre.record, panels.review)
        new = [one for one in faults if one.isVisible() and not one.met]
        if card is None and new and new[0].window() is active:
            new[0].met = True
            enter_next(new[:1], forward=True)
            return
        shown = (*(parts if card is None else (card,)), panels.header)
        enter_next([one for one in shown if one.window() is active], forward=forward)

    def _scroll(self, way: int) -> None:
        """Scroll an open card, else the panel that has the keyboard, else the right."""
        setup = self.panels.setup
        focus = QApplication.focusWidget()
        left = focus is not None and setup.isAncestorOf(focus)
        scroll(self._card() or (setup if left else self.panels.review), way)

    def _card(self) -> Overlay | None:
        """The uppermost open card."""
        cards = self.window.findChildren(Overlay)
        return next((card for card in reversed(cards) if card.isVisible()), None)

    def _nudge(self, way: int) -> None:
        """Move the cursor that was grabbed last, and stay with it; else the view."""
        view, which = self.panels.centre.view, self._grabbed
        if view.cursors is None:
            view.pan(way * view.width / 10)
            return
        to = view.cursors[which] + way * view.width / 400
        view.move_cursor(which, to)
        if not view.start <= to <= view.end:
            view.show_span(to - view.width / 2, view.width)

    def _grab(self, which: int) -> None:
        """Bring cursor A (0) or B (1) to the middle; the arrows then move it."""
        self._grabbed = which
        self.panels.centre.tools.bring(which)

    def _home(self) -> None:
        view = self.panels.centre.view
        view.show_span(0.0, view.width)

    def _tab(self, number: int) -> None:
        panels = self.panels
        if panels.review.isHidden():
            self.fold_asked.emit(panels.review, False)
        panels.review.show_tab(number)
        panels.review.focus_tab()

    def _search(self) -> None:
        self._tab(1)
        self.panels.review.runs.search.setFocus()

    def _fold(self, side: object) -> None:
        panels = self.panels
        panel = panels.setup if side is panels.setup else panels.review
        self.fold_asked.emit(panel, panel.isVisible())

    def _focus(self) -> None:
        panels = self.panels
        folded = panels.setup.isVisible() or panels.review.isVisible()
        self.fold_asked.emit(panels.setup, folded)
        self.fold_asked.emit(panels.review, folded)

    def copy_picture(self) -> None:
        """Put a picture of the window on the clipboard."""
        QGuiApplication.clipboard().setPixmap(self.window.grab())

    def save_scene(self) -> None:
        """Save the form as a scene file."""
        from gui.dialogs.saving import save_scene

        save_scene(self.panels)

    def export_view(self) -> None:
        """Export what the lanes show."""
        from gui.dialogs.saving import export_view

        export_view(self.panels)

    def ask_skin(self) -> None:
        """Ask for an array of sensors and show it in a window of its own."""
        kinds = "Skin, or its events (*.toml *.h5)"
        ask_file(self.window, "Open a skin", self.open_skin, kinds=kinds)

    def open_skin(self, path: Path) -> None:
        """Compute an array, or play its events; above the lanes: what prevents it."""
        out = self.panels.session.out.parent / "skins"

        def work() -> None:  # STOP would wait for it in the window's thread
            from gui.skin.window import open_skin

            try:
                self._skin_read.emit(open_skin(path, out))
            except (TactileLabError, OSError) as error:
                self._skin_failed.emit(str(error))

        start(work, "open skin", finishes=True)

    def _show_skin(self, made: Callable[[Theme, Panels], QWidget]) -> None:
        window = made(self.panels.theme, self.panels)
        fit(window, self.window.screen().availableSize())
        window.show()

    def show_studies(self) -> None:
        """Show the studies beside the runs, and those among them."""
        from gui.dialogs.studies import show_studies

        out = self.panels.session.out
        roots = (out.parent / "studies", out)
        opened = self.screen.open_point
        show_studies(self.window, self.panels.theme, roots, opened)

    @property
    def _helped(self) -> list[tuple[QWidget, IconButton, str]]:
        """Panels, the button of each that asks for help on it, and its topic now."""
        setup, centre = self.panels.setup, self.panels.centre
        review = self.panels.review
        tab = ("Results", "Runs", "Manual", "Spikes")[review.tab]
        return [
            (setup, setup.help, "Protocol"),
            (centre.lanes, centre.tools.help, "Lanes"),
            (centre.record, centre.log.help, "Steps and log"),
            (review, review.help, tab),
        ]

    def _help_on(self, inside: Callable[[QWidget], bool]) -> None:
        """Show the help at the panel of which that holds, else its start."""
        topics = [topic for part, _, topic in self._helped if inside(part)]
        self.show_help(topics[0] if topics else "")

    def _help_here(self) -> None:
        """Show the help at the panel that has the keyboard, else its start."""
        focus = QApplication.focusWidget()
        self._help_on(lambda part: focus is not None and part.isAncestorOf(focus))

    def show_help(self, topic: str = "", page: int = 0) -> None:
        """Show the help: 0 panels, at a topic; 1 shortcuts; 2 about the program."""
        from gui.dialogs.help import show_help

        keys = [(", ".join(key.keys), key.words) for key in self.keys]
        show_help(self.window, keys, topic, page)

    def connect_dialog(self) -> None:
        """Show the connect dialog."""
        from gui.dialogs.connect import show_connect

        show_connect(self.window, self.panels, self.screen)

    def show_preferences(self) -> None:
        """Show the card with what a user prefers."""
        from gui.dialogs.preferring import PreferencesCard

        found = self.window.findChild(PreferencesCard)
        card = found or PreferencesCard(self.window, self.preferences)
        card.show_preferences()

    def show_menu(self) -> None:
        """Open the menu below its button."""
        acts: dict[str, Act] = {}
        for one in self.keys:
            acts |= dict.fromkeys(one.keys, one.act)
        acts |= {
            "Open a skin …": self.ask_skin,
            "Studies …": self.show_studies,
            "Copy command line": self.copy_command,
            "Help and shortcuts": self.show_help,
            "About Tactile Lab": partial(self.show_help, page=2),
        }
        recent = self.preferences.recent
        menu = GearMenu(self.window, self.panels, self.screen, recent, acts)
        menu.open_below(self.panels.header)

    def copy_command(self) -> None:
        """Put the command that runs what the form asks for on the clipboard."""
        QGuiApplication.clipboard().setText(self.panels.setup.request().command())


def _ask_menu() -> None:
    """Ask what has the keyboard for its menu: X11 has no key but Menu for that."""
    focus = QApplication.focusWidget()
    if focus is not None:
        at, why = focus.rect().center(), QContextMenuEvent.Reason.Keyboard
        asked = QContextMenuEvent(why, at, focus.mapToGlobal(at))
        QApplication.sendEvent(focus, asked)


def _chooses() -> bool:
    """Whether the keyboard is at a choice of one, where arrows go to the next."""
    focus = QApplication.focusWidget()
    return isinstance(focus, QAbstractButton) and focus.group() is not None


def _press() -> None:
    """Press the button that has the keyboard, as Space does."""
    focus = QApplication.focusWidget()
    if isinstance(focus, QAbstractButton):
        focus.click()


def _written(event: QKeyEvent) -> str:
    """A key as it is written in the list of shortcuts."""
    if event.text() in ("+", "-", "=", "?"):
        return event.text()
    shift = event.modifiers() & Qt.KeyboardModifier.ShiftModifier
    other = event.modifiers() & ~(
        Qt.KeyboardModifier.ShiftModifier | Qt.KeyboardModifier.KeypadModifier
    )
    if other:
        return ""
    name = QKeySequence(event.key()).toString()
    return f"Shift+{name}" if shift else name
