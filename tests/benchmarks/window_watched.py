"""The window on the simulated bench, telling what it says and what is true.

    python tests/benchmarks/window_watched.py FOLDER

Driven by `window_session.py`. Every tenth of a second a line of JSON on the standard
output tells what the window says of the coil and what the simulated source does; lines
of the log, exceptions and what Qt complains of come as they happen. Engine and
simulated far ends are in this process. A word a line on the standard input has the
source fail or work again.
"""

import json
import sys
import threading
import time
import traceback
from pathlib import Path
from types import TracebackType
from typing import cast

from PySide6.QtCore import (
    QMessageLogContext,
    QPoint,
    QTimer,
    QtMsgType,
    qInstallMessageHandler,
)
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QAbstractButton, QApplication, QDialog, QMenu, QWidget

from gui.app import application, begin, fit
from gui.dialogs.overlay import Overlay
from gui.garbage import collected_here
from gui.look.theme import Theme
from gui.session.log import LogLine
from gui.session.session import Session
from gui.window import Window
from sim_backend.coil.source import SimCoilSource
from sim_backend.serial_line import wires
from sim_backend.serial_line.faults import Kind, SerialFault
from tactile_lab.engine.memory import map_large, share_heap

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
AMOUNTS = {"late": 1.0, "unplug": 2.0}
"""Of faults that have one, s."""


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


def number(far: wires.FarEnd) -> int:
    """The how many-th far end it is: they are numbered as they are plugged in."""
    return int(far.name.rpartition("-")[2])


def source(far: wires.FarEnd) -> SimCoilSource:
    """The coil source that is the far end."""
    assert isinstance(far.instrument, SimCoilSource)
    return far.instrument


def named(one: QWidget | None) -> str:
    """What a widget is, for who has to find out why it is open."""
    if one is None:
        return "none"
    return " ".join((type(one).__name__, one.windowTitle() or one.accessibleName()))


class Watched:
    """The window, the far ends of its coil sources, and what both say."""

    def __init__(self, folder: Path) -> None:
        self.app = application(["session"])
        self.scene = folder / "short.toml"
        self.scene.write_text(SCENE)
        theme = Theme("light")
        theme.apply()
        self.session = Session(folder / "runs", separate=False)
        self.session.run.reports = False
        self.session.log.added.connect(self._logged)
        self.window = Window(self.session, theme)
        fit(self.window, self.window.screen().availableSize())
        self.window.show()
        begin(self.window, str(self.scene), "sim")
        self._names: dict[str, list[int]] = {}
        self._count, self._newest = 0, 0
        self._timer = QTimer()
        self._timer.timeout.connect(self._report)
        self._timer.start(100)
        threading.Thread(target=self._listen, daemon=True).start()

    @property
    def coils(self) -> list[wires.FarEnd]:
        """The newest source, while it lives: a bench connected anew has its own.

        One that was unplugged stays as it was, and may outlive the one after it.
        """
        ends = [far for name, far in wires._far_ends.items() if "coil" in name]
        for far in ends:
            self._newest = max(self._newest, number(far))
        return [far for far in ends if number(far) == self._newest]

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
        session, coils = self.session, self.coils
        tell(
            {
                "at": time.monotonic(),
                "state": session.state.value,
                "truth": stop.truth.value,
                "words": stop.words.spoken,
                "manual": session.manual.alive,
                "monitor": session.monitor.alive,
                "output": any(source(far).output_on for far in coils),
                "source": [far.name for far in coils],
                "open": [named(w) for w in (*cards, *top) if isinstance(w, OPEN)],
                "dialogs": [named(w) for w in top if isinstance(w, QDialog)],
                "keyboard": self._keyboard(),
                "stop": [at.x(), at.y()],
                "memory": int(pages) * 4096 / 1e6,
                "buttons": self._names,
            }
        )

    def _act(self, word: str) -> None:
        what, _, kind = word.strip().partition(" ")
        if what == "fault":
            fault = SerialFault(
                kind=cast(Kind, kind), times=None, amount=AMOUNTS.get(kind, 0.0)
            )
            for far in self.coils:
                far.faults.add(fault)
        elif what == "mend":
            for far in self.coils:
                far.faults.clear()
        elif what == "connect":
            self.session.connect_bench("sim")
        elif what == "scene":
            self.window.fold(self.window.setup, False)
            self.window.screen_.open_scene(str(self.scene))

    def _listen(self) -> None:
        for word in sys.stdin:
            QTimer.singleShot(0, self.app, lambda word=word: self._act(word))
        QTimer.singleShot(0, self.app, self.app.quit)  # who drives it has gone


def main(folder: Path) -> None:
    sys.setswitchinterval(1e-3)
    share_heap()  # as the program does
    map_large()
    listen_to_trouble()
    watched = Watched(folder)
    QApplication.setQuitOnLastWindowClosed(True)
    with collected_here():
        watched.app.exec()
        watched.session.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
