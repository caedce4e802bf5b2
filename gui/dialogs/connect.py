"""The connect dialog: instruments, wiring, calibration; saves a bench file.

The wiring check and the field calibration run as any other scene does: the form shows
them, STOP stops them, their run folder is kept. The pages only watch.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QTimer, Signal
from PySide6.QtWidgets import QScrollArea, QStackedWidget, QWidget

from gui.ask_file import ask_file
from gui.dialogs.bench_text import bench_text, show_bench, start_choice
from gui.dialogs.calibrating import Calibrating
from gui.dialogs.instruments import InstrumentsPage
from gui.dialogs.overlay import Overlay
from gui.dialogs.wiring import Wiring
from gui.look.theme import Theme
from gui.parts import (
    STRETCH,
    Segments,
    column,
    label,
    line_edit,
    push,
    row,
    say,
    scrolling,
)
from gui.review.conclusion import conclusion_of
from gui.session.log import Severity
from gui.session.session import Session
from gui.state import WindowState
from tactile_lab.acquisition.events import RunState
from tactile_lab.errors import TactileLabError
from tactile_lab.plugins import protocol_checking
from tactile_lab.scene.bench_file import BenchSpec
from tactile_lab.scene.write_bench import write_bench, write_calibrated_bench

if TYPE_CHECKING:
    from gui.screen.panels import Panels
    from gui.screen.screen import Screen
    from tactile_lab.acquisition.ending import Executed

BENCHES = "Bench files (*.toml)"

PAGE = 540
"""Height of a page where the window is high enough, px."""


class Connect(Overlay):
    """Three pages and one file."""

    prepare_asked = Signal(str)
    """A shipped scene belongs into the form."""
    run_asked = Signal(str)
    """A shipped scene belongs into the form, and is to be run."""

    def __init__(self, window: QWidget, session: Session, theme: Theme) -> None:
        super().__init__(window, 760)
        self.session = session
        self._choice = start_choice()
        self._shown: BenchSpec | None = None
        self._running = ""
        self._wiring, self._field = (protocol_checking(w) for w in ("wiring", "field"))
        self._ended = {self._wiring: "", self._field: ""}
        self.instruments = InstrumentsPage(self._choice, theme)
        self.wiring = Wiring(self._choice, theme)
        self.calibration = Calibrating(self._choice, theme)
        self.name = line_edit("Name of the bench", text=self._choice.name)
        self.problem = label("", "error", wrap=True)
        self.problem.hide()
        self.pages = QStackedWidget()
        for page in (self.instruments, self.wiring, self.calibration):
            self.pages.addWidget(scrolling(page))
        self.tabs = Segments(["Instruments", "Wiring", "Calibration"], "Page")
        self.save = push("Save bench file and connect …", "primary")
        self.open_file = push("Open bench file …")
        self.close_button = push("Close")
        self._lay_out()
        self.show_page(0)
        self.tabs.group.idClicked.connect(self.show_page)
        self.save.clicked.connect(self._ask_and_save)
        self.open_file.clicked.connect(self._ask_and_open)
        self.close_button.clicked.connect(self.hide)
        self.wiring.check_asked.connect(lambda: self._run(self._wiring))
        self.calibration.field_asked.connect(lambda: self._run(self._field))
        self.calibration.force_asked.connect(self._prepare_force)
        self.calibration.use_asked.connect(self._ask_and_use)
        session.status.changed.connect(self._follow)
        session.stopped.connect(self._give_up)
        session.plan.arrived.connect(self._planned)
        session.run.trial_ended.connect(self._trial_ended)
        session.run.ended.connect(self._run_ended)
        session.run.reported.connect(self._reported)

    def show_bench(self) -> None:
        """Show the connected bench, where there is one."""
        spec = self.session.bench.spec
        if spec is not None and spec is not self._shown:
            self._shown = spec
            show_bench(self._choice, spec)
            self.name.setText(self._choice.name)
            self.instruments.show_choice()
            self.wiring.show_choice()
            self.calibration.show_choice()
        self._follow()

    def show_page(self, number: int) -> None:
        """0 Instruments, 1 Wiring, 2 Calibration."""
        self.tabs.choose(number)
        self.pages.setCurrentIndex(number)

    def save_to(self, path: Path) -> bool:
        """Write the bench file and connect; whether both can be done."""
        choice = self.instruments.take()
        self.wiring.take()
        self.calibration.take()
        choice.name = self.name.text().strip() or "my bench"
        try:
            write_bench(bench_text(choice), path)
        except (TactileLabError, OSError) as error:
            self._say(str(error))
            return False
        self.session.log.add(Severity.GOOD, "bench", f"Saved {path}")
        return self._connect_to(path, f"Saved {path}, and not connected. ")

    def use_calibration(self, calibration: Path, path: Path) -> bool:
        """Save the connected bench with a calibration, and connect to it."""
        spec = self.session.bench.spec
        if spec is None:
            self._say("No bench is connected that the calibration could belong to.")
            return False
        try:
            named = replace(spec, name=self.name.text().strip() or spec.name)
            write_calibrated_bench(named, calibration, path)
        except TactileLabError as error:
            self._say(str(error))
            return False
        said = f"Saved {path} with its calibration"
        self.session.log.add(Severity.GOOD, "bench", said)
        problem = self.session.connect_bench(str(path))
        self._say(problem and f"{said}, and not connected. {problem}")
        self.show_bench()
        return not problem

    # --- the runs the pages ask for

    def _run(self, scene: str) -> None:
        self._running = scene
        self._say_progress("Preparing …", busy=True)
        self.run_asked.emit(scene)
        self._follow()

    def _planned(self) -> None:
        if self._running and self.session.plan.problem:
            self._end(self.session.plan.problem)

    def _give_up(self) -> None:
        """STOP came before the run that a page asked for began."""
        if self._running and not self.session.busy:
            self._end("Stopped before it began.")

    def _trial_ended(self, outcome: object) -> None:
        source = self.session.source
        if self._running == self._field and source is not None:
            self.calibration.show_loop(source.loop)

    def _run_ended(self, done: Executed) -> None:
        if not self._running:
            return
        if done.state is RunState.COMPLETE:
            self._say_progress("Judging what was recorded …", busy=True)
        else:
            self._end(f"Not completed: {done.reason or done.state}.")

    def _reported(self, folder: Path) -> None:
        """Show what a wiring check or a field calibration found, whoever ran it."""
        try:
            found = conclusion_of(folder)
        except TactileLabError as error:
            if self._running:
                self._end(str(error))
            return
        if found.protocol == self._wiring:
            self.wiring.show_conclusion(found)
        elif found.protocol == self._field:
            self.calibration.show_conclusion(found)
            # once it has its place
            QTimer.singleShot(0, self._reveal_findings)
        if found.protocol == self._running:
            self._end(f"Kept as {folder.name}")
        if self.isVisible():
            self.open()

    def _reveal_findings(self) -> None:
        """Scroll to what was found and what can be done with it."""
        page = self.pages.widget(2)
        if isinstance(page, QScrollArea):
            page.ensureWidgetVisible(self.calibration.use)
            page.ensureWidgetVisible(self.calibration.findings)

    def _follow(self) -> None:
        """Say where the run is that a page asked for, or why there can be none."""
        session = self.session
        if self._running:
            if session.state is WindowState.FAULT:
                self._end(
                    session.status.fault.title if session.status.fault else "Fault"
                )
            elif session.state is WindowState.RUNNING and session.run.trial is not None:
                index, words = session.run.trial  # the header's clock has the time
                self._say_progress(f"Step {index + 1}: {words}", busy=True)
            return
        reason = {
            WindowState.READY: "",
            WindowState.DISCONNECTED: "Connect a bench first.",
            WindowState.CONNECTING: "The bench is still connecting.",
            WindowState.FAULT: "Acknowledge the fault first.",
        }.get(session.state, "Another run is in progress.")
        if session.manual.alive:
            reason = "The coil is driven by hand; switch it off first."
        for page, button, ended in (
            (self.wiring, self.wiring.check, self._ended[self._wiring]),
            (self.calibration, self.calibration.field, self._ended[self._field]),
        ):
            button.setEnabled(not reason)
            button.setToolTip(reason)
            say(page.progress, reason or ended)

    def _say_progress(self, text: str, *, busy: bool) -> None:
        page = self.wiring if self._running == self._wiring else self.calibration
        page.show_progress(text, busy=busy)
        for other in (self.wiring.check, self.calibration.field):
            other.setEnabled(not busy)
        if not busy and self.card.hasFocus():  # as locking the button left it
            (
                self.wiring.check if page is self.wiring else self.calibration.field
            ).setFocus()

    def _end(self, text: str) -> None:
        self._say_progress(text, busy=False)
        self._ended[self._running], self._running = text, ""

    # --- files

    def _ask_and_save(self) -> None:
        ask_file(
            self,
            "Save the bench file",
            self.save_to,
            kinds=BENCHES,
            start="bench.toml",
            save=True,
        )

    def _ask_and_open(self) -> None:
        ask_file(self, "Open a bench file", self._connect_to, kinds=BENCHES)

    def _connect_to(self, path: Path, saved: str = "") -> bool:
        """Connect to a bench file; whether that may be done now."""
        problem = self.session.connect_bench(str(path))
        if problem:
            self._say(saved + problem)
            return False
        say(self.problem, "")
        self.hide()
        return True

    def _ask_and_use(self, calibration: Path | None) -> None:
        spec = self.session.bench.spec
        if calibration is None or spec is None:
            return
        start = "bench.toml" if spec.path is None else str(spec.path)
        ask_file(
            self,
            "Save the calibrated bench",
            partial(self.use_calibration, calibration),
            kinds=BENCHES,
            start=start,
            save=True,
        )

    def _prepare_force(self) -> None:
        self.hide()
        self.prepare_asked.emit(protocol_checking("force"))

    def _say(self, problem: str) -> None:
        say(self.problem, problem)
        self.open()

    def _lay_out(self) -> None:
        head = row(label("Connect instruments", "big"), STRETCH, self.tabs)
        named = row(label("Name of the bench"), (self.name, 1))
        foot = row(self.open_file, STRETCH, self.close_button, self.save)
        parts = (head, named, (self.pages, 1), self.problem, foot)
        column(self.card, *parts, margin=22, spacing=14)
        self.give_room(self.pages, PAGE)


def show_connect(window: QWidget, panels: Panels, screen: Screen) -> None:
    """Open the dialog."""
    found = window.findChild(Connect)
    if isinstance(found, Connect):
        shown = found
    else:
        shown = Connect(window, panels.session, panels.theme)
        shown.prepare_asked.connect(screen.open_scene)
        shown.run_asked.connect(screen.run_scene)
    shown.show_bench()
    shown.open()
    shown.instruments.scan.setFocus()
