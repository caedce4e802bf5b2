"""Everything that the window can have open, over itself or beside it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFileDialog, QMessageBox, QWidget

from gui.ask_file import ask_file
from gui.dialogs.connect import Connect
from gui.dialogs.overlay import Overlay
from gui.dialogs.preferring import PreferencesCard
from gui.lanes_window import LanesWindow
from gui.plots.small_plot import SmallPlot
from gui.skin.window import SkinWindow
from tactile_lab.store.summary import RunSummary

SKIN = """
duration = "20 ms"
[array]
grid = [2, 1]
[[stimulus]]
kind = "sphere"
force = "1 N"
"""

Open = Callable[[], object]


def openers(lab: Any, tmp_path: Path) -> dict[str, tuple[Open, ...]]:
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

    def open_skin() -> None:
        acts.open_skin(skin)
        lab.until(lambda: window.findChildren(SkinWindow))

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
        "plots/plot_box.py": (plot_menu,),
        "lanes_window.py": (window.part_lanes,),
        "review/runs.py": (lambda: window.review.runs._show_menu(entry, QPoint(9, 9)),),
        "screen/screen.py": (window.screen_.ask_scene, window.screen_.ask_run),
        "setup/fields.py": (window.setup.form.field("levels")._choose_file,),
        "setup/preset_button.py": (window.setup.star.open_menu,),
        "skin/window.py": (open_skin,),
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
