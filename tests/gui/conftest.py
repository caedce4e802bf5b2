import os

os.environ["QT_QPA_PLATFORM"] = "offscreen"
os.environ["QT_SCALE_FACTOR"] = "1"

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication

from gui.app import application, begin
from gui.look.theme import Theme
from gui.session.session import Session
from gui.state import State
from gui.window import Window

SCENE = """
[protocol]
name = "pulses"
levels = ["80 mN", "120 mN"]
ramp = "100 ms"
hold = "400 ms"
rest = "100 ms"

[record]
sample_rate = "200 kS/s"
"""


@dataclass
class Lab:
    """The window with what tests need to drive it."""

    app: QApplication
    window: Window
    session: Session
    folder: Path
    texts: dict[str, str] = field(default_factory=dict)

    def until(self, done: Callable[[], object], longest: float = 60.0) -> None:
        end = time.monotonic() + longest
        while not done():
            assert time.monotonic() < end, [line.text for line in self.session.lines][
                -6:
            ]
            self.app.processEvents()
            time.sleep(0.002)

    def live(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        self.until(lambda: time.monotonic() > end)

    def ready(self) -> None:
        """Bench connected, plan there, nothing running, left-overs gone."""
        session, window = self.session, self.window
        while session.queue:
            session.unqueue(0)
        window.closing.hide()
        if session.busy:
            session.stop("test is over")
        session.watch(False)
        self.until(lambda: not session.busy and not session.monitor.alive)
        self.live(0.05)
        session.acknowledge()
        if session.state is State.DISCONNECTED:
            session.connect_bench("sim")
        self.until(lambda: session.state is State.READY)
        window.opening.close_run()
        wanted = str(self.folder / "short.toml")
        texts = window.setup.form.texts()
        if session.expectation is None or texts != self.texts:
            window.opening.open_scene(wanted)
            session.expectation = None
            self.until(lambda: session.expectation is not None)
            self.texts = window.setup.form.texts()
        window.setup.plan_now()

    def run(self) -> None:
        """Start the form's run and wait until the coil is live."""
        self.window.setup.run.click()
        self.until(lambda: self.session.source is not None)
        self.until(lambda: (c := self.session.coil_view()) is not None and c.output)

    def complete_run(self) -> None:
        """A run from start to end; an overloaded computer gets another chance."""
        session = self.session
        for _ in range(4):
            self.run()
            self.until(lambda: session.state in (State.READY, State.FAULT))
            self.live(0.1)
            if session.state is State.READY:
                return
            # in real time a starved scope is a fault, as it must be
            assert session.fault is not None
            assert "sample_rate" in session.fault.title, session.fault
            session.acknowledge()
        raise AssertionError("this computer is too busy for real time")


@pytest.fixture(scope="session")
def app() -> QApplication:
    return application([])


@pytest.fixture(scope="module")
def opened(
    app: QApplication, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Lab]:
    """One window for all tests of a module, on the simulated bench."""
    folder = tmp_path_factory.mktemp("window")
    (folder / "short.toml").write_text(SCENE)
    theme = Theme("light")
    theme.apply()
    session = Session(folder / "runs", separate=False)
    session.reports = False
    window = Window(session, theme)
    window.show()
    begin(window, str(folder / "short.toml"), "sim")
    lab = Lab(app, window, session, folder)
    yield lab
    if session.busy:
        session.stop("tests are over")
        session.wait_for_end(10.0)
    lab.live(0.05)
    session.fault = None
    window.close()
    window.deleteLater()
    app.processEvents()


@pytest.fixture
def lab(opened: Lab) -> Lab:
    opened.ready()
    return opened
