"""Opening scenes and runs, and what the lanes show because of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QTimer, Signal
from PySide6.QtWidgets import QFileDialog

from gui.lanes.compare import Comparison
from gui.lanes.source import LiveSource, PlanSource, Source
from gui.review.entries import Entry, entries
from gui.review.gathering import Gathering
from gui.screen.agreeing import Agreeing
from gui.screen.compare_bar import load_comparison
from gui.screen.panels import Panels
from gui.screen.records import Records
from gui.screen.showing import lanes_shown
from gui.session.form_plan import Planned
from gui.session.log import Level
from gui.state import State
from tactile_lab.engine.threads import start
from tactile_lab.errors import TactileLabError
from tactile_lab.store.folder import DATA
from tactile_lab.trial import Outcome

if TYPE_CHECKING:
    from gui.lanes.stored import RunSource
    from tactile_lab.acquisition.ending import Executed


LATER = 1000
"""Milliseconds after a run's end until runs are listed anew: its record comes first."""


class Screen(QObject):
    """What is on screen: the plan, the run in progress, or a run from disk.

    Attributes:
        run: the run from disk on screen, None while plan or live run are.
        ending: how the run on screen ended, in words.
    """

    changed = Signal()
    failed = Signal(str)
    listed = Signal(object)
    compared = Signal(object)

    def __init__(self, panels: Panels) -> None:
        super().__init__(panels.centre)
        self._panels = panels
        self.run: Source | None = None
        self.ending = ""
        self.gathering = Gathering(panels.review.results, panels.session, self)
        Agreeing(panels.session, self.gathering)
        self._modelled: Source | None = None
        self._ended: Path | None = None
        self._records = Records(panels.session, self)
        self._records.loaded.connect(self._show_run)
        self._records.exchanged.connect(self._exchange)
        self._records.failed.connect(self.say)
        self.failed.connect(self.say)
        self.listed.connect(self._list)
        self.compared.connect(self._show_comparison)
        runs = panels.review.runs
        runs.opened.connect(lambda entry: self.open_run(entry.folder))
        runs.again.connect(self._again)
        runs.compared.connect(
            lambda chosen: load_comparison(chosen, self.compared.emit, self.failed.emit)
        )
        bar = panels.centre.compare_bar
        bar.changed.connect(panels.centre.stack.refresh)
        view = panels.centre.view
        view.changed.connect(
            lambda: bar.look_at(
                view.start + view.width / 2, (view.cursors or [None])[0]
            )
        )
        bar.agreed.connect(lambda time: view.move_cursor(0, time))
        bar.closed.connect(self.close_run)
        panels.review.results.report_asked.connect(self.gathering.open_report)
        panels.review.export.clicked.connect(
            lambda: self.gathering.open_folder(panels.session.out)
        )

    # --- asked by the user

    @property
    def _busy(self) -> bool:
        return self._panels.session.state in (State.RUNNING, State.ABORTING)

    def ask_scene(self) -> None:
        """Let the user choose a scene, and open it."""
        name, _ = QFileDialog.getOpenFileName(
            self._panels.centre.window(),
            "Open a scene",
            "",
            "Scenes and protocols (*.toml *.py)",
        )
        if name:
            self.open_path(Path(name))

    def ask_run(self) -> None:
        """Let the user choose a run, and open it."""
        name = QFileDialog.getExistingDirectory(
            self._panels.centre.window(), "Open a run", str(self._panels.session.out)
        )
        if name:
            self.open_path(Path(name))

    def open_path(self, path: Path) -> None:
        """Open a scene, a protocol file, a run folder or a run's data file."""
        if path.is_dir() or path.suffix in (".h5", ".json"):
            folder = path if path.is_dir() else path.parent
            if self._busy:
                self._queue(str(folder / "scene.toml"), f"{folder.name[18:]} again")
            else:
                self.open_run(folder)
        elif self._busy:
            self._queue(str(path), path.stem)
        else:
            self.open_scene(str(path))

    def open_scene(self, name: str | None) -> bool:
        """Put a scene into the form; whether that went well.

        A mistake in the scene is shown, and nothing else changes.
        """
        before = self._panels.setup.form.texts()
        try:
            self._panels.setup.open_scene(name)
        except (TactileLabError, OSError) as error:
            self.say(str(error))
            return False
        after = self._panels.setup.form.texts()
        new = [f"{key} {before[key]} → {value}" for key, value in after.items()
               if key in before and before[key] != value]  # fmt: skip
        said = f"Scene {name or 'demo'} loaded"
        self._panels.session.log.add(
            Level.INFO, "scene", f"{said}: {', '.join(new)}" if new else said
        )
        return True

    def run_scene(self, name: str) -> None:
        """Put a shipped scene into the form, and run it as soon as it is planned."""
        self.leave_run()
        if self.open_scene(name):
            self._panels.setup.start_when_planned()

    def open_run(self, folder: Path) -> None:
        """Open a run from disk in the same lanes; read away from this thread."""
        self._records.open(folder)

    def list_runs(self) -> None:
        """Read the run folder anew, away from this thread."""
        out = self._panels.session.out
        start(lambda: self.listed.emit(entries(out)), "list runs")

    # --- told by the session

    def plan_arrived(self, planned: Planned) -> None:
        """Show the plan in the lanes, unless a run is on screen."""
        session = self._panels.session
        if planned.expectation is None or self._busy or self.run is not None:
            return
        if session.source is None:
            self.show_lanes()
            preview = planned.expectation.preview
            self._panels.centre.view.set_now(0.0, preview.length)
            self._panels.centre.stack.show_source(PlanSource(preview))
            self._panels.centre.view.show_span(0.0, preview.length)

    def follow_run(self, source: LiveSource) -> None:
        """Show the run that begins."""
        self.leave_run()
        self._ended = None
        panels = self._panels
        self.show_lanes()
        panels.centre.stack.show_source(source)
        view = panels.centre.view
        view.clear_cursors()
        panels.centre.tools.cursors.setChecked(False)
        view.follow = True
        view.set_width(5.0)
        view.set_follow(True)
        panels.centre.tools.follow.setChecked(True)
        if not panels.session.monitor.alive:
            self.ending = ""
            expectation = panels.session.run.expectation
            steps = expectation.estimate.trials if expectation else 0
            searched = expectation is None or expectation.needs.detect_on is not None
            self.gathering.begin(steps, fires=searched)
        self.changed.emit()

    def trial_ended(self, outcome: Outcome) -> None:
        """Add a step to the results."""
        self.gathering.step(outcome, self._panels.session.source)

    def run_ended(self, done: Executed) -> None:
        """The run is on disk now."""
        self.ending = f"{done.state} · {done.folder.name} · {done.spikes} spikes"
        source = self._panels.session.source
        if source is not None:
            self._panels.centre.view.set_now(source.reach, source.length)
        self.gathering.end(done, source)
        if (done.folder / DATA).exists():  # not where it ended before the first sample
            self._ended = done.folder
            self._records.exchange(done.folder)
        QTimer.singleShot(LATER, self.list_runs)

    def reported(self, folder: Path) -> None:
        """A report exists, and the twin has come to the end."""
        self.gathering.reported(folder, self.run or self._panels.session.source)

    def take_fetched(self) -> None:
        """Repaint where samples of a run on disk have been read."""
        if self.run is not None and self.run.take_fetched():
            if self.run.has_model and self._modelled is not self.run:
                self._modelled = self.run
                self.gathering.compare_with_model(self.run)
            self.show_lanes()
            self._panels.centre.stack.refresh()
            self._panels.centre.stack.show_values()

    def close_run(self) -> None:
        """Go back from a run on disk to the session's last run, or to the plan."""
        self.leave_run()
        source, centre = self._panels.session.source, self._panels.centre
        if source is not None and centre.stack.source is not source:
            self.show_lanes()
            centre.stack.show_source(source)
            centre.view.set_now(source.reach, source.length)
            centre.view.show_all()
            if self._ended is not None:
                self._records.exchange(self._ended)
        self._panels.setup.plan_now()

    def show_lanes(self) -> None:
        """Show the lanes of what is on screen."""
        lanes = lanes_shown(self._panels.session, self.run)
        if lanes is not None:
            self._panels.centre.stack.show_lanes(lanes)

    # --- inside

    def leave_run(self) -> None:
        """Let go of the run from disk on screen."""
        self._records.forget()
        self.gathering.forget()
        if self.run is not None:
            self.run.close()
            self.run = self._records.shown = None
            self._panels.centre.compare_bar.show_comparison(None)
            self._panels.session.run.name = ""
        self._panels.centre.notice.hide()

    def _show_run(self, source: RunSource) -> None:
        panels = self._panels
        if self._busy:
            source.close()
            self.say("A run is in progress; old runs open when it has ended.")
            return
        self.leave_run()
        self.run = self._records.shown = source
        panels.session.run.name = f"Looking at {source.path.name}"
        view = panels.centre.view
        view.set_now(source.reach, source.length)
        view.clear_cursors()
        panels.centre.tools.cursors.setChecked(False)
        self.show_lanes()
        panels.centre.stack.show_source(source)
        view.show_all()
        panels.centre.stack.show_values()
        status = str(source.info.get("status"))
        self.ending = f"{status} · {source.path.name} · {source.spikes.size} spikes"
        self.gathering.stored(source)
        panels.review.runs.show_current(source.path)
        self._show_progress(source)
        self.changed.emit()

    def _exchange(self, source: RunSource) -> None:
        """Show the record in place of what was seen live; nothing else moves."""
        panels = self._panels
        if self._busy or self.run is not None:
            source.close()
            return
        self.run = self._records.shown = source
        panels.centre.view.set_now(source.reach, source.length)
        self.show_lanes()
        panels.centre.stack.exchange_source(source)
        panels.review.runs.show_current(source.path)
        self._show_progress(source)

    def _show_progress(self, source: RunSource) -> None:
        self._panels.centre.progress.show_run(
            self._panels.session.snapshot(), source.holds, source.length,
            source.reach, None, self.ending,
        )  # fmt: skip

    def _show_comparison(self, comparison: Comparison) -> None:
        session, centre = self._panels.session, self._panels.centre
        if self._busy:
            comparison.close()
            self.say("A run is in progress; runs are compared when it has ended.")
            return
        self.leave_run()
        self.run = comparison
        session.run.name = f"Comparing {len(comparison.members)} runs"
        centre.compare_bar.show_comparison(comparison)
        centre.view.set_now(comparison.reach, comparison.length)
        self.show_lanes()
        centre.stack.show_source(comparison)
        centre.view.show_all()
        self.changed.emit()

    def _queue(self, scene: str, title: str) -> None:
        problem = self._panels.session.enqueue_scene(scene, title)
        if problem:
            self.say(problem)

    def _again(self, entry: Entry) -> None:
        scene = str(entry.folder / "scene.toml")
        if self._busy:
            self._queue(scene, entry.title)
        else:
            self.close_run()
            self.open_scene(scene)

    def _list(self, found: list[Entry]) -> None:
        self._panels.review.runs.show_entries(found)
        self._panels.centre.empty.show_recent(
            [(f"{e.title} · {e.started} · {e.status}", e.folder) for e in found[:4]]
        )

    def say(self, problem: str) -> None:
        """Tell why something could not be opened, above the lanes and in the log."""
        self._panels.session.log.add(Level.ERROR, "open", problem)
        self._panels.centre.notice.setText(problem)
        self._panels.centre.notice.setStyleSheet("")
        self._panels.centre.notice.show()
