import os

os.environ["QT_QPA_PLATFORM"] = "offscreen"
os.environ["QT_SCALE_FACTOR"] = "1"

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from lane_stack import stack
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QApplication, QWidget
from served_source import Source

from gui.app import application, begin
from gui.dialogs.overlay import Overlay
from gui.garbage import collected_here
from gui.look.theme import Theme
from gui.session.session import Session
from gui.state import WindowState
from gui.window import Window
from tactile_lab.engine.request import Request

__all__ = ["stack"]

LONGEST = 90.0
"""Seconds a condition is waited for: a busy machine is slow, not wrong."""

SHORT = """
[protocol]
name = "pulses"
levels = ["80 mN", "120 mN"]
ramp = "100 ms"
hold = "300 ms"
rest = "100 ms"

[record]
sample_rate = "500 kS/s"
"""

LONG = """
[protocol]
name = "pulses"
levels = ["120 mN"]
hold = "3000 s"

[record]
sample_rate = "20 kS/s"
"""


@dataclass
class Lab:
    """The window with what tests need to drive it.

    The engine serves it from a thread, so that faults can be put into the simulated
    far ends, and on the simulated clock: no test depends on this machine's speed.
    """

    app: QApplication
    window: Window
    session: Session
    folder: Path
    texts: dict[str, str] = field(default_factory=dict)
    complete: list[Path] = field(default_factory=list)

    def until(self, done: Callable[[], object], longest: float = LONGEST) -> None:
        end = time.monotonic() + longest
        while not done():
            assert time.monotonic() < end, [
                line.text for line in self.session.log.lines
            ][-6:]
            self.app.processEvents()
            time.sleep(0.002)

    def ready(self) -> None:
        """Bench connected, plan there, nothing running, left-overs gone."""
        session, window = self.session, self.window
        while session.queue.items:
            session.queue.remove(session.queue.items[0])
        session.run.waiting.clear()
        window.preferences.keep(folder=str(session.out), reports=False)
        session.run.reports = False  # a test may have set other preferences
        for overlay in window.findChildren(Overlay):
            overlay.hide()
        self.until(self.in_front)  # another test may have had a window of its own
        if session.busy:
            session.stop("test is over")
        session.show_monitor(False)
        self.until(lambda: not session.busy and not session.monitor.alive)
        self.until(lambda: session.link.idle)
        session.acknowledge()
        session.take_as_off()
        if session.state is WindowState.DISCONNECTED:
            session.connect_bench("sim")
        self.until(lambda: session.state is WindowState.READY)
        window.screen_.close_run()
        wanted = str(self.folder / "short.toml")
        texts = window.setup.form.texts()
        if session.plan.expectation is None or texts != self.texts:
            window.screen_.open_scene(wanted)
            session.plan.expectation = None
            self.until(lambda: session.plan.expectation is not None)
            self.texts = window.setup.form.texts()
        window.setup.plan_now()

    def in_front(self) -> bool:
        """Whether the window is the active one; what lies over it is closed.

        A focus that comes while a popup is open Qt gives to the window and does not
        call it active, and then takes no request for it, as it has the focus:
        another window has to have it in between.
        """
        while (popup := QApplication.activePopupWidget()) is not None:
            popup.close()
        if self.window.isActiveWindow():
            return True
        between = QWidget()
        between.show()
        self.window.activateWindow()
        self.app.processEvents()
        return self.window.isActiveWindow()

    def run(self) -> None:
        """Start a run of an hour and wait until the coil is live."""
        session = self.session
        session.start(Request(str(self.folder / "long.toml"), (), "sim"), "Long")
        self.until(lambda: session.source is not None)
        self.until(lambda: (c := session.coil_view()) is not None and c.output)

    def complete_run(self) -> Path:
        """The form's run from start to end; its folder."""
        session = self.session
        before = session.run.folder
        self.window.setup.run.click()
        assert session.state is WindowState.RUNNING
        self.until(lambda: session.state in (WindowState.READY, WindowState.FAULT))
        assert session.state is WindowState.READY, session.status.fault
        self.until(lambda: not session.busy)
        assert session.run.folder is not None and session.run.folder != before
        self.complete.append(session.run.folder)
        return session.run.folder

    def runs(self, count: int) -> list[Path]:
        """Folders of that many complete runs; only missing ones are run."""
        while len(self.complete) < count:
            self.complete_run()
        return self.complete[:count]


@pytest.fixture(scope="session")
def app() -> QApplication:
    return application([])


@pytest.fixture(scope="module", autouse=True)
def collected(app: QApplication) -> Iterator[None]:
    """As in the program: a circle of Qt's, ended in another thread, ends the tests.

    What is deleted later outside of any loop Qt keeps until it is asked for: a window
    that a module left took F12 before that of the next ones.
    """
    with collected_here():
        yield
        app.sendPostedEvents(None, QEvent.Type.DeferredDelete.value)


@pytest.fixture(scope="session")
def opened(
    app: QApplication, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Lab]:
    """One window for all tests, on the simulated bench."""
    folder = tmp_path_factory.mktemp("window")
    (folder / "short.toml").write_text(SHORT)
    (folder / "long.toml").write_text(LONG)
    theme = Theme("light")
    theme.apply()
    session = Session(folder / "runs", separate=False, realtime=False)
    window = Window(session, theme)
    window.show()
    begin(window, str(folder / "short.toml"), "sim")
    lab = Lab(app, window, session, folder)
    yield lab
    if session.busy:
        session.stop("tests are over")
        lab.until(lambda: not session.busy)
    lab.until(lambda: session.link.idle)
    session.status.fault = None
    window.leave()
    session.close()
    window.deleteLater()
    app.processEvents()


@pytest.fixture
def lab(opened: Lab) -> Lab:
    opened.ready()
    return opened


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Source]:
    if os.name != "posix":
        pytest.skip("needs a pseudo-terminal")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    made = Source(tmp_path)
    yield made
    made.served.close()
