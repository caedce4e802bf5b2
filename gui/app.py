"""Starting the window."""

from __future__ import annotations

import importlib
import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QSettings, QTimer
from PySide6.QtWidgets import QApplication

from gui import bindings as _first  # noqa: F401
from gui.garbage import collected_here
from gui.look import fonts
from gui.look.theme import Theme
from gui.preferences import Preferences
from gui.session.session import Session
from gui.state import CoilKnowledge, stop_truth
from gui.tool_tips import ToolTips
from gui.within_reach import WithinReach, fit
from tactile_lab.engine.memory import map_large, share_heap
from tactile_lab.engine.process import SECOND, take_place
from tactile_lab.engine.threads import start

if TYPE_CHECKING:
    from gui.window import Window
    from tactile_lab.lab import Lab


def application(arguments: Sequence[str] = ()) -> QApplication:
    """The one application, in Fusion style with the bundled font."""
    found = QApplication.instance()
    app = found if isinstance(found, QApplication) else QApplication(list(arguments))
    if app.findChildren(ToolTips):
        return app  # all that is open would be styled anew
    app.setApplicationName("Tactile Lab")
    app.setOrganizationName("tactile-lab")
    app.setStyle("Fusion")
    app.setFont(fonts.load())
    ToolTips(app)
    WithinReach(app)
    return app


def main(
    target: str | None = None,
    *,
    out: Path | None = None,
    bench: str | None = None,
    theme: str = "system",
    lab: Lab | None = None,
) -> int:
    """Open the window and stay until it is closed.

    Args:
        target: scene, protocol file or run folder to open; None for the last scene.
        out: folder for run folders; None for that of the preferences.
        bench: "sim", a bench file, "none"; None for that of the preferences.
        theme: "system", "light" or "dark".
        lab: what counts where the preferences name nothing.

    Returns:
        Exit code: 0, or 4 where the coil's safe state could not be verified.
    """
    take_place(SECOND)
    # Python threads hand over every 5 ms by default: too long for a frame of 33 ms
    sys.setswitchinterval(1e-3)
    share_heap()
    map_large()
    app = application(["tactile-lab"])
    chosen = Theme(theme)
    chosen.apply()
    settings = QSettings()
    wishes = Preferences(settings, lab, out)
    session = Session(wishes.folder)
    session.run.notes = lab.notes if lab else {}
    session.run.reports = wishes.wants("reports")
    session.run.publish = wishes.wants("lsl")
    wanted = bench or wishes.bench
    if wanted == "none":
        session.link.open()
    else:
        session.connect_bench(wanted)  # which answers while the window is built
    from gui.window import Window

    window = Window(session, chosen, settings, wishes)
    fit(window, window.screen().availableSize())
    window.show()
    _close_on_signals(window.leave)
    QTimer.singleShot(0, lambda: begin(window, target or wishes.scene, None))
    with collected_here():
        app.exec()
        session.close()
    left = session.status.coil.left_unknown
    said = stop_truth(session.state, session.coil_view(), left)
    return 4 if said is CoilKnowledge.UNKNOWN else 0


def show_skin(path: Path, out: Path, theme: str) -> None:
    """Open the window of an array of sensors and stay until it is closed.

    Args:
        path: a skin's file, which is computed now, or the folder of its events.
        out: where the folder of a skin that is computed is put.
        theme: "system", "light" or "dark".

    Raises:
        SceneError, ParameterError, RunFolderError: it cannot be shown.
    """
    app = application(["tactile-lab"])
    chosen = Theme(theme)
    chosen.apply()
    from gui.skin.window import open_skin

    window = open_skin(path, out)(chosen, None)
    fit(window, window.screen().availableSize())
    window.show()
    _close_on_signals(window.close)
    with collected_here():
        app.exec()


def begin(window: Window, target: str | None, bench: str | None) -> None:
    """What happens right after the window has appeared."""
    path = None if target is None else Path(target)
    is_run = path is not None and path.is_dir()
    if not window.screen_.open_scene(None if is_run else target):
        window.screen_.open_scene(None)  # which ships, so that there is a form
    if is_run and path is not None:
        window.screen_.open_run(path)
    window.screen_.list_runs()
    window.session.bench.ready.connect(_load_reader)
    window.page.setFocus()
    if bench is not None:  # in a turn of its own: the scene is painted meanwhile
        QTimer.singleShot(0, lambda: window.session.connect_bench(bench))


def _load_reader() -> None:
    """Load what reads runs, and what numpy loads when asked for unique values.

    At the end of a step or of a run it would hold up the lanes.
    """

    def load() -> None:
        for name in ("numpy.ma", "gui.lanes.stored"):
            importlib.import_module(name)

    start(load, "load reader", finishes=True)


def _close_on_signals(close: Callable[[], object]) -> None:
    """SIGINT, SIGTERM and SIGHUP end the window as its close button, without asking."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), lambda number, frame: close())
