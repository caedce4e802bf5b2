"""STOP acts whatever of the window is open; what opens something is found, not listed.

`test_on_screen.py` presses the same on a real screen, with the source as witness.
"""

import re
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFileDialog, QMessageBox, QWidget

import gui
from gui.ask_file import ask_file
from gui.dialogs.connect import Connect
from gui.dialogs.overlay import Overlay
from gui.dialogs.preferring import PreferencesCard
from gui.lanes_window import LanesWindow
from gui.plots.small_plot import SmallPlot
from gui.skin.window import SkinWindow
from tactile_lab.store.summary import RunSummary

OPENS = re.compile(
    r"\bQMenu\(|\bask_file\(|WindowType\.|\bQDialog\(|QMessageBox\(|QInputDialog"
    r"|QProgressDialog|class \w+\((Overlay|QMenu|QDialog|QMainWindow|QMessageBox)\)"
    r"|WindowTitle\("
)
"""What has something open over the window, or beside it, as it is written."""

SKIN = """
duration = "20 ms"
[array]
grid = [2, 1]
[[stimulus]]
kind = "sphere"
force = "1 N"
"""

Open = Callable[[], object]


def openers(lab, tmp_path: Path) -> dict[str, tuple[Open, ...]]:
    """How each file of the window that opens something is made to."""
    window = lab.window
    acts, stack = window.actions_, window.centre.stack
    skin, entry = (
        tmp_path / "skin.toml",
        RunSummary(folder=tmp_path / "run", name="run"),
    )
    skin.write_text(SKIN)
    (tmp_path / "there.txt").touch()

    def connect(page: int, ask: Callable[[Connect], object]) -> Open:
        def opened() -> None:
            acts.connect_dialog()
            dialog = window.findChild(Connect)
            dialog.show_page(page)
            ask(dialog)

        return opened

    def replace() -> None:
        ask_file(window, "Save", print, start=str(tmp_path / "there.txt"), save=True)
        window.findChild(QFileDialog).accept()

    def browse() -> None:
        acts.show_preferences()
        card = window.findChild(PreferencesCard)
        next(b for b in card.findChildren(QWidget) if _is_browse(b)).click()

    def plot_menu() -> None:
        plots = window.findChildren(SmallPlot)
        plot = next(one for one in plots if one.isVisible() and one.panels)
        at = plot.mapFromScene(plot.panels[0].box.sceneBoundingRect().center())
        QTest.mouseClick(plot.viewport(), Qt.MouseButton.RightButton, pos=at)

    def lane_menu() -> None:
        box = stack.rows[0].box
        stack.scene.menu_asked.emit(box, QPointF(200, 40), QPoint(300, 300))

    return {
        "actions.py": (acts.ask_skin,),
        "ask_file.py": (replace,),
        "dialogs/about_run.py": (lambda: window.runs.card.show_run(entry.folder),),
        "dialogs/closing.py": (window.close,),
        "dialogs/confirm.py": (lambda: window.runs.delete(entry),),
        "dialogs/connect.py": (
            connect(1, lambda _: None),
            connect(0, lambda one: one._ask_and_save()),
            connect(2, lambda one: one._ask_and_use(tmp_path / "calibration.toml")),
        ),
        "dialogs/help.py": tuple(
            lambda page=page: acts.show_help(page=page) for page in range(3)
        ),
        "dialogs/preferring.py": (acts.show_preferences, browse),
        "dialogs/question.py": (window.question.open,),
        "dialogs/saving.py": (acts.save_scene, acts.export_view),
        "dialogs/studies.py": (acts.show_studies,),
        "lanes/stack.py": (lane_menu,),
        "lanes/tools.py": (window.centre.tools.lanes.click,),
        "menu.py": (acts.show_menu,),
        "plots/small_plot.py": (plot_menu,),
        "lanes_window.py": (window.part_lanes,),
        "review/runs.py": (lambda: window.review.runs._show_menu(entry, QPoint(9, 9)),),
        "screen/screen.py": (window.screen_.ask_scene, window.screen_.ask_run),
        "setup/fields.py": (window.setup.form.field("levels")._choose_file,),
        "setup/preset_button.py": (window.setup.star.open_menu,),
        "skin/window.py": (lambda: acts.open_skin(skin),),
    }


def _is_browse(one: QWidget) -> bool:
    return one.accessibleName().startswith("Choose: ")


def seen(window: QWidget) -> list[QWidget]:
    """What is open over the window, or beside it."""
    cards = [card for card in window.findChildren(Overlay) if card.isVisible()]
    popup = QApplication.activePopupWidget()
    kinds = QFileDialog, QMessageBox, SkinWindow, LanesWindow
    beside = [one for one in QApplication.topLevelWidgets() if isinstance(one, kinds)]
    return [*cards, *([popup] if popup else []), *(b for b in beside if b.isVisible())]


def shut(window: QWidget) -> None:
    for one in reversed(seen(window)):
        one.hide() if isinstance(one, Overlay) else one.close()


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
    assert files - {"window.py"} == set(openers(lab, tmp_path))


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
