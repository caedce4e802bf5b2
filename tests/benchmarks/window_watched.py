"""The window on the simulated bench, telling what it says of the coil.

    python -c "import window_watched; window_watched.main()"

Driven by `window_session.py`, in a folder of its own. Every tenth of a second a line of
JSON on the standard output tells what the window says; lines of the log, exceptions and
what Qt complains of come as they happen. What the simulated source does is told by the
engine, that of `watched_engine.py`. A word a line on the standard input has the bench
connected or the scene opened. It is imported, for the engine would import a script that
began it, and with it the window.
"""

import json
import sys
import threading
import time
import traceback
from pathlib import Path
from types import TracebackType

import watched_engine
from PySide6.QtCore import (
    QMessageLogContext,
    QPoint,
    QTimer,
    QtMsgType,
    qInstallMessageHandler,
)
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QAbstractButton, QApplication, QDialog, QMenu, QWidget

from gui.app import application, begin
from gui.dialogs.overlay import Overlay
from gui.garbage import collected_here
from gui.look.theme import Theme
from gui.session.log import LogLine
from gui.session.session import Session
from gui.window import Window
from gui.within_reach import fit
from tactile_lab.engine import link
from tactile_lab.engine.memory import map_large, share_heap
from tactile_lab.engine.process import SECOND, take_place

SCENE = """
[protocol]
name = "pulses"
levels = ["120 mN", "160 mN"]
hold = "4 s"
rest = "1 s"

[record]
sample_rate = "100 kS/s"
"""
OPEN = Overlay, QMenu
DRAGS = "QDragManager::drag in possibly invalid state"
"""A press came before Qt was back from the drag before: nothing is dragged then."""

TELLING = threading.Lock()


def tell(what: object) -> None:
    """A line for whoever drives the session; from any thread."""
    with TELLING:
        sys.stdout.write(json.dumps(what) + "\n")
        sys.stdout.flush()


def listen_to_trouble() -> None:
    """Tell exceptions of all threads, and warnings of Qt with where they came."""

    def failed(
        kind: type[BaseException],
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        tell({"problem": "".join(traceback.format_exception(kind, error, trace))})

    def warned(kind: QtMsgType, context: QMessageLogContext, text: str) -> None:
        if kind is not QtMsgType.QtDebugMsg and text != DRAGS:
            stack = "".join(traceback.format_stack()[:-1])
            tell({"problem": f"Qt: {text}\n{stack}"})

    sys.excepthook = failed
    threading.excepthook = lambda a: failed(a.exc_type, a.exc_value, a.exc_traceback)
    qInstallMessageHandler(warned)


def named(one: QWidget | None) -> str:
    """What a widget is, for who has to find out why it is open."""
    if one is None:
        return "none"
    return " ".join((type(one).__name__, one.windowTitle() or one.accessibleName()))


class Watched:
    """The window, and what it says."""

    def __init__(self) -> None:
        self.app = application(["session"])
        self.scene = Path.cwd() / "short.toml"
        self.scene.write_text(SCENE)
        theme = Theme("light")
        theme.apply()
        self.session = Session(Path.cwd() / "runs")
        self.session.run.reports = False
        self.session.log.added.connect(self._logged)
        self.window = Window(self.session, theme)
        fit(self.window, self.window.screen().availableSize())
        self.window.show()
        begin(self.window, str(self.scene), "sim")
        self._names: dict[str, list[int]] = {}
        self._count = 0
        self._timer = QTimer()
        self._timer.timeout.connect(self._report)
        self._timer.start(100)
        threading.Thread(target=self._listen, daemon=True).start()

    def _logged(self, line: LogLine) -> None:
        tell({"log": f"{line.at:%H:%M:%S.%f} {line.source}: {line.text}"})

    def _buttons(self) -> dict[str, list[int]]:
        """Where each button is that can be pressed, by its name."""
        found: dict[str, list[int]] = {}
        for one in self.app.allWidgets():
            if not (isinstance(one, QAbstractButton) and one.isVisible()):
                continue
            middle = one.mapToGlobal(QPoint(one.width() // 2, one.height() // 2))
            if one.isEnabled() and self.app.widgetAt(middle) is one:
                name = one.accessibleName() or one.text()
                found.setdefault(name, [middle.x(), middle.y()])
        return found

    def _keyboard(self) -> str:
        """Which popup, window and widget take a key, as Qt and X have it."""
        has = QGuiApplication.focusWindow()
        return ", ".join(
            (
                f"popup {named(QApplication.activePopupWidget())}",
                f"active {named(QApplication.activeWindow())}",
                f"focus {named(QApplication.focusWidget())}",
                f"X's {has.objectName() if has else None}",
            )
        )

    def _report(self) -> None:
        if self._count % 5 == 0:
            self._names = self._buttons()
        self._count += 1
        stop = self.window.header.stop
        at = stop.mapToGlobal(QPoint(60, 25))
        pages = Path("/proc/self/statm").read_text().split()[1]
        cards = [c for c in self.window.findChildren(Overlay) if c.isVisible()]
        top = [w for w in self.app.topLevelWidgets() if w.isVisible()]
        session = self.session
        tell(
            {
                "at": time.monotonic(),
                "state": session.state.value,
                "truth": stop.truth.value,
                "words": stop.words.spoken,
                "manual": session.manual.alive,
                "monitor": session.monitor.alive,
                "open": [named(w) for w in (*cards, *top) if isinstance(w, OPEN)],
                "dialogs": [named(w) for w in top if isinstance(w, QDialog)],
                "keyboard": self._keyboard(),
                "stop": [at.x(), at.y()],
                "engine": session.link.pid,
                "memory": int(pages) * 4096 / 1e6,
                "buttons": self._names,
            }
        )

    def _act(self, word: str) -> None:
        what = word.strip()
        if what == "connect":
            self.session.connect_bench("sim")
        elif what == "scene":
            self.window.fold(self.window.setup, False)
            self.window.screen_.open_scene(str(self.scene))

    def _listen(self) -> None:
        for word in sys.stdin:
            QTimer.singleShot(0, self.app, lambda word=word: self._act(word))
        QTimer.singleShot(0, self.app, self.app.quit)  # who drives it has gone


def main() -> None:
    """Open the window in the working folder and stay until it is closed."""
    vars(link)["main"] = watched_engine.main
    take_place(SECOND)  # as the program does
    sys.setswitchinterval(1e-3)
    share_heap()
    map_large()
    listen_to_trouble()
    watched = Watched()
    QApplication.setQuitOnLastWindowClosed(True)
    with collected_here():
        watched.app.exec()
        watched.session.close()
