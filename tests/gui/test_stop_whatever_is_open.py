"""STOP acts whatever of the window is open; what opens something is found, not listed.

`test_on_screen.py` presses the same on a real screen, with the source as witness.
"""

import re
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget
from whatever_is_open import openers, seen, shut

import gui

OPENS = re.compile(
    r"\bQ?Menu\(|\bask_file\(|WindowType\.|\bQDialog\(|QMessageBox\(|QInputDialog"
    r"|QProgressDialog|class \w+\((Overlay|Q?Menu|QDialog|QMainWindow|QMessageBox)\)"
    r"|WindowTitle\("
)
"""What has something open over the window, or beside it, as it is written."""


def press_stop(window: QWidget) -> None:
    """A click on STOP, which an open menu would take."""
    stop, popup = window.header.stop, QApplication.activePopupWidget()
    at = stop.mapToGlobal(stop.rect().center())
    took = popup or stop
    QTest.mouseClick(took, Qt.MouseButton.LeftButton, pos=took.mapFromGlobal(at))


def press_key(window: QWidget, key: Qt.Key) -> None:
    """A key to what has the keyboard."""
    takes = QApplication.activePopupWidget() or QApplication.focusWidget()
    QTest.keyClick(takes or QApplication.activeWindow() or window, key)


def test_every_dialog_and_menu_of_the_window_is_known_here(lab, tmp_path) -> None:
    """A new file that opens something has to say above how."""
    folder = Path(gui.__file__).parent
    files = {
        str(file.relative_to(folder))
        for file in folder.rglob("*.py")
        if OPENS.search(file.read_text(encoding="utf-8"))
    }
    others = {"window.py", "within_reach.py", "popup_menu.py"}  # open nothing alone
    assert files - others == set(openers(lab, tmp_path))


def test_stop_acts_over_every_dialog_and_menu(lab, tmp_path, monkeypatch) -> None:
    """Each in turn while the coil is in use: F12, Esc, and a click.

    STOP is told here, not carried out: a run would take the test's processor.
    """
    window, session = lab.window, lab.session
    known = openers(lab, tmp_path)
    stopped: list[object] = []
    ways = {
        "F12": lambda: press_key(window, Qt.Key.Key_F12),
        "Esc": lambda: press_key(window, Qt.Key.Key_Escape),
        "click": lambda: press_stop(window),  # the last: it takes the keyboard
    }
    with monkeypatch.context() as spied:
        spied.setattr(type(session), "busy", True)
        spied.setattr(session, "stop", lambda *reason: stopped.append(reason))
        for file, opens in known.items():
            for number, opened in enumerate(opens):
                for name, press in ways.items():
                    case = f"{name} over {file}, {number}"
                    before = len(stopped)
                    if not seen(window):
                        opened()
                        lab.app.processEvents()
                    assert seen(window), f"{case}: nothing was opened"
                    assert QApplication.activeModalWidget() is None, case
                    press()
                    keeps = name == "Esc" and file == "dialogs/closing.py"
                    assert len(stopped) == before + (not keeps), case
                shut(window)
