"""Pictures of the window in each state: ``python -m gui.screenshots [FOLDER]``.

Drives the window on the simulated bench as a person would; offscreen unless a platform
is given. Runs take real time, so this needs about two minutes.
"""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from PySide6.QtGui import QPixmap
from PySide6.QtWidgets import QApplication, QWidget

from gui.app import application, begin
from gui.dialogs.connect import Connect
from gui.dialogs.overlay import Overlay
from gui.look.theme import Theme
from gui.session.session import Session
from gui.state import State
from gui.window import Window

SIZE = (1720, 1080)


class Stage:
    """A window and the means to wait for it."""

    def __init__(self, folder: Path, out: Path, bench: str | None) -> None:
        self.app: QApplication = application([])
        self.theme = Theme("light")
        self.theme.apply()
        # in this process, where a plug can be pulled
        self.session = Session(out, separate=False)
        self.window = Window(self.session, self.theme)
        self.window.resize(*SIZE)
        self.window.show()
        self.folder = folder
        self.taken: dict[str, QPixmap] = {}
        begin(self.window, None, bench)

    def until(self, done: Callable[[], bool], longest: float = 60.0) -> None:
        """Let the window live until `done()`."""
        end = time.monotonic() + longest
        while not done() and time.monotonic() < end:
            self.app.processEvents()
            time.sleep(0.004)

    def live(self, seconds: float) -> None:
        """Let the window live for so long."""
        end = time.monotonic() + seconds
        self.until(lambda: time.monotonic() > end, seconds + 1)

    def shoot(
        self, name: str, theme: str = "light", widget: QWidget | None = None
    ) -> None:
        """Save a picture."""
        if self.theme.choice != theme:
            self.theme.choose(theme)
        self.live(0.15)
        self.taken[name] = (widget or self.window).grab()
        if not self.session.busy:  # compressing would starve a run in progress
            self.save()

    def save(self) -> None:
        """Write the pictures taken since the last time."""
        for name, picture in self.taken.items():
            file = self.folder / f"{name}.png"
            picture.save(str(file))
            print(file, flush=True)
        self.taken.clear()

    def ready(self) -> None:
        """Wait for bench and plan."""
        session = self.session
        self.until(
            lambda: session.state is State.READY and session.expectation is not None
        )
        self.live(0.4)


def main(folder: Path) -> None:
    """Make all pictures in `folder`."""
    folder = folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    # the log names the runs folder: a relative one says nothing of this computer
    with tempfile.TemporaryDirectory() as home, contextlib.chdir(home):
        stage = Stage(folder, Path("runs"), None)
        stage.until(lambda: stage.session.expectation is not None)
        stage.shoot("window_first_start")
        stage.session.connect_bench("sim")
        stage.ready()
        stage.shoot("window_ready")
        _run(stage)
        _after(stage)
        stage.save()
        stage.window.close()


def _run(stage: Stage) -> None:
    window, session = stage.window, stage.session
    window.setup.start()
    stage.until(lambda: session.source is not None and session.source.reach > 11.2)
    window.setup.enqueue()
    stage.shoot("window_running_light")
    window.close()
    stage.shoot("window_close_light")
    window.closing.keep.click()
    stage.theme.choose("dark")
    stage.until(lambda: session.source is None or session.source.reach > 15.4)
    stage.shoot("window_running_dark", "dark")
    stage.theme.choose("light")
    session.unqueue(0)
    stage.until(lambda: not session.busy, 30)
    session.acknowledge()
    if not window.opening.ending.startswith("complete"):
        _complete(stage)
    stage.live(1.0)


def _complete(stage: Stage) -> None:
    """A whole run; taking pictures starves the simulated bench, so try again."""
    session = stage.session
    for _ in range(4):
        stage.window.setup.start()
        stage.until(lambda: session.state is State.RUNNING, 5)
        stage.until(lambda: not session.busy, 40)
        stage.live(0.3)
        session.acknowledge()
        if stage.window.opening.ending.startswith("complete"):
            return


def _after(stage: Stage) -> None:
    window, session = stage.window, stage.session
    window.page.setFocus()
    window.centre.view.show_all()
    window.centre.tools.widths.choose(3)
    window.centre.tools.toggle_cursors(True)
    stage.until(window.review.results.report.isVisible, 30)
    stage.shoot("window_complete")
    window.review.show_tab(1)
    window.opening.list_runs()
    stage.live(0.5)
    cards = window.review.runs.cards
    if cards:
        window.opening.open_run(cards[0].entry.folder)
        stage.until(lambda: window.opening.run is not None and
                    window.opening.run.model is not None)  # fmt: skip
        window.centre.view.show_span(9.2, 0.6)
        stage.live(0.4)
        stage.shoot("window_old_run")
        window.opening.close_run()
    window.review.show_tab(2)
    session.begin_manual()
    stage.until(lambda: session.manual is not None, 60)
    stage.live(1.5)
    window.review.manual.set_asked.emit(0.25)
    stage.live(2.0)
    session.read_field()
    stage.until(lambda: not session.reading_field, 20)
    stage.live(0.3)
    stage.shoot("window_manual")
    session.stop("picture taken")
    stage.until(lambda: session.manual is None)
    window.resize(1180, 720)
    stage.live(0.2)
    stage.shoot("window_small_dark", "dark")
    window.resize(*SIZE)
    stage.theme.choose("light")
    window.actions_.show_help()
    stage.shoot("window_help")
    _close_overlays(window)
    window.actions_.connect_dialog()
    stage.shoot("window_connect")
    _close_overlays(window)
    _wiring(stage)
    _compare(stage)
    _monitor(stage)
    _unplugged(stage)


def _close_overlays(window: Window) -> None:
    for overlay in window.findChildren(Overlay):
        overlay.hide()


def _wiring(stage: Stage) -> None:
    """The wiring check from its page, with its verdicts."""
    window, session = stage.window, stage.session
    window.actions_.connect_dialog()
    dialog = window.findChild(Connect)
    assert isinstance(dialog, Connect)
    dialog.show_page(1)
    dialog.wiring.check.click()
    stage.until(lambda: session.state is State.RUNNING, 10)
    stage.until(lambda: not session.busy, 40)
    stage.until(lambda: bool(dialog.wiring.verdicts), 30)
    stage.shoot("window_wiring")
    _close_overlays(window)
    session.acknowledge()
    window.opening.open_scene(None)
    session.expectation = None
    window.setup.plan_now()
    stage.until(lambda: session.expectation is not None)


def _compare(stage: Stage) -> None:
    """Two shorter runs beside the first."""
    window, session = stage.window, stage.session
    for levels in ("80, 120, 160, 180 mN", "90, 130, 170, 200 mN"):
        window.setup.form.field("levels").set_text(levels)
        session.expectation = None
        window.setup.plan_now()
        stage.until(lambda: session.expectation is not None)
        stage.live(0.2)
        _complete(stage)
    window.setup.form.reset()
    window.opening.list_runs()
    stage.live(0.6)
    window.review.show_tab(1)
    cards = window.review.runs.cards
    pulses = [c for c in cards if c.entry.title == "Pulses"]
    for card in [c for c in pulses if c.entry.status == "complete"][:3]:
        card.tick.setChecked(True)
    window.review.runs.compare.click()
    stage.until(window.centre.compare_bar.isVisible)
    window.centre.view.show_span(8.0, 5.0)
    window.centre.compare_bar.at = 10.0
    window.centre.compare_bar.align.group.button(1).click()
    stage.live(0.5)
    stage.shoot("window_compare")
    window.opening.close_run()


def _monitor(stage: Stage) -> None:
    window, session = stage.window, stage.session
    window.review.show_tab(1)
    session.watch(True)
    stage.until(
        lambda: (
            session.monitor.source is not None and session.monitor.source.reach > 6.0
        )
    )
    stage.shoot("window_monitor")
    session.watch(False)
    stage.until(lambda: not session.monitor.alive)


def _unplugged(stage: Stage) -> None:
    """Pull the coil's plug in a run: the fault, and a coil nobody knows about."""
    from sim_backend import serial_wires
    from sim_backend.faults import SerialFault

    window, session = stage.window, stage.session
    session.expectation = None
    window.setup.plan_now()
    stage.until(lambda: session.expectation is not None)
    stage.live(0.3)
    window.setup.start()
    stage.until(lambda: session.source is not None and session.source.reach > 6.5)
    wires = serial_wires.__dict__["_far_ends"]
    coil = [far for name, far in wires.items() if "coil" in name][-1]
    coil.faults.add(SerialFault(kind="unplug", times=None))
    stage.until(lambda: session.state is State.FAULT)
    stage.live(0.3)
    stage.shoot("window_fault_dark", "dark")
    stage.shoot("window_fault_light")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("docs/pictures"))
