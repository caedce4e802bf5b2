"""What is on screen: the plan, the run in progress, or what was opened from disk."""

from __future__ import annotations

import gc
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QTimer, Signal

from gui.ask_file import ask_file
from gui.lanes.compare import MARKS, Comparison
from gui.lanes.lane import Lane, lanes_for
from gui.lanes.live import LiveSource
from gui.lanes.source import PlanSource, Source
from gui.review.run_card import day
from gui.review.run_results import RunResults
from gui.screen.panels import Panels
from gui.screen.records import Records
from gui.session.log import Severity
from gui.session.session import BY_HAND
from gui.state import WindowState
from tactile_lab.acquisition.events import RunState
from tactile_lab.engine.memory import trim
from tactile_lab.engine.threads import start
from tactile_lab.errors import RunFolderError, TactileLabError
from tactile_lab.quantity import looked_for, show
from tactile_lab.signals import AVERAGED
from tactile_lab.store.catalogue import Catalogue
from tactile_lab.store.folder import DATA
from tactile_lab.store.summary import RunSummary
from tactile_lab.trial import Outcome

if TYPE_CHECKING:
    from gui.lanes.stored import RunSource
    from gui.session.fit import Agreement
    from tactile_lab.acquisition.ending import Executed

LATER = 1000
"""Milliseconds after a run's end until runs are listed anew: its record comes first."""

COMPARED = 2000
"""Milliseconds after which a run in progress is compared with the model anew."""

DRIVEN = ("force", "coil_current")
"""What is seen while the coil is driven by hand."""

WATCHED = ("V_C1", "V_C2", "V_K", "spikes")
"""What the monitor shows."""


class Screen(QObject):
    """Opens scenes and runs, and decides which source the lanes show.

    Attributes:
        ending: how the session's last run ended, in words.
    """

    changed = Signal()
    listed = Signal(object)
    scene_opened = Signal(str)
    """A scene stands in the form; its file, or its name where it ships."""

    def __init__(self, panels: Panels) -> None:
        super().__init__(panels.centre)
        self._panels = panels
        self.ending = ""
        self.results = RunResults(panels.review.results, panels.session, self)
        self.results.agreed.connect(self._agreed)
        self.results.fitted.connect(panels.centre.stack.show_laws)
        self._modelled: Source | None = None
        self._ended: Path | None = None
        self._records = records = Records(panels.session, self)
        records.loaded.connect(self._show_run)
        records.exchanged.connect(self._exchange)
        records.compared.connect(self._show_comparison)
        records.failed.connect(self.say)
        self.listed.connect(self._list)
        panels.review.results.step_chosen.connect(panels.centre.view.show_step)
        panels.centre.stack.threshold_asked.connect(self._count_from)
        runs = panels.review.runs
        runs.opened.connect(lambda entry: self.open_run(entry.folder))
        runs.again.connect(self._again)
        runs.compared.connect(records.compare)
        panels.centre.compare_bar.closed.connect(self.close_run)
        self.results.unopened.connect(self.say)
        panels.review.results.report_asked.connect(self.results.ask_report)
        panels.review.export.clicked.connect(
            lambda: self.results.open_folder(panels.session.out)
        )
        timer = QTimer(self)
        timer.timeout.connect(self.compare_live)
        timer.start(COMPARED)

    @property
    def run(self) -> Source | None:
        """A run from disk, or some compared; None while plan or live run are shown."""
        return self._records.shown

    @property
    def live(self) -> LiveSource | None:
        """The run in progress, the last one or the monitor, while that is shown."""
        return self._panels.session.source if self.run is None else None

    # --- asked by the user

    @property
    def _busy(self) -> bool:
        return self._panels.session.state.in_run

    def ask_scene(self) -> None:
        """Let the user choose a scene, and open it."""
        ask_file(
            self._panels.centre.window(),
            "Open a scene",
            lambda path: self.open_scene(str(path)),
            kinds="Scenes and protocols (*.toml *.py)",
        )

    def ask_run(self) -> None:
        """Let the user choose a run, and open it."""
        ask_file(
            self._panels.centre.window(),
            "Open a run",
            self.open_path,
            start=str(self._panels.session.out),
            folder=True,
        )

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
        new = [
            f"{key} {before[key]} → {value}"
            for key, value in self._panels.setup.form.texts().items()
            if before.get(key, value) != value
        ]
        said = f"Scene {name or 'demo'} loaded"
        self._panels.session.log.add(
            Severity.INFO, "scene", f"{said}: {', '.join(new)}" if new else said
        )
        if name is not None:  # else it stands in for one that could not be opened
            self._panels.centre.say("")
            self.scene_opened.emit(name)
        return True

    def run_scene(self, name: str) -> None:
        """Put a shipped scene into the form, and run it as soon as it is planned."""
        self.leave_run()
        if self.open_scene(name):
            self._panels.setup.start_when_planned()

    def open_point(self, path: Path) -> None:
        """Open a point of a study: its run, or its scene in the form and the lanes."""
        if path.is_dir():
            self.open_run(path)
        else:
            self.leave_run()
            self.open_scene(str(path))

    def open_run(self, folder: Path) -> None:
        """Open a run from disk in the same lanes; read away from this thread."""
        self._records.open(folder)

    def list_runs(self) -> None:
        """Read the run folder anew, away from this thread."""
        out = self._panels.session.out
        start(lambda: self.listed.emit(_runs_in(out)), "list runs")

    def close_run(self) -> None:
        """Go back from a run on disk to the session's last run, or to the plan."""
        self.leave_run()
        if self.results.folder != self._ended:
            self.results.clear()
        source, centre = self._panels.session.source, self._panels.centre
        if source is not None and centre.stack.source is not source:
            centre.show_source(source, self._lanes())
            if self._ended is not None:
                self._records.exchange(self._ended)
        self._panels.setup.plan_now()

    def leave_run(self) -> None:
        """Let go of what is from disk on screen."""
        self.results.forget()
        self._panels.review.runs.show_current()
        if self._records.leave():
            self._panels.centre.compare_bar.show_comparison(None)
            self._panels.session.opened = ()
        self._panels.centre.say("")

    def forget(self, folder: Path) -> None:
        """A run is no longer there to be gone back to."""
        if self._ended == folder:
            self._ended = None

    def say(self, problem: str) -> None:
        """Tell why something could not be opened, above the lanes and in the log."""
        self._panels.session.log.add(Severity.ERROR, "open", problem)
        self._panels.centre.say(problem)

    # --- told by the session

    def plan_arrived(self) -> None:
        """Show the plan in the lanes, unless a run is on screen."""
        session = self._panels.session
        expectation = session.plan.expectation
        if expectation is None or self._busy or self.run is not None:
            return
        if session.source is None:
            source = PlanSource(expectation.preview)
            self._panels.centre.show_source(source, self._lanes())
            self._show_steps(source, "")
            self.results.plan(fires=expectation.needs.detect_on is not None)

    def follow_run(self, source: LiveSource) -> None:
        """Show the run that begins."""
        self.leave_run()
        self._ended = None
        centre, session = self._panels.centre, self._panels.session
        centre.follow_source(source, self._lanes())
        if source is session.run.source:
            self.ending = ""
            expectation = session.run.expectation
            holds = expectation.preview.holds if expectation else []
            steps = sum(not hold.pause for hold in holds)
            searched = expectation is None or expectation.needs.detect_on is not None
            self.results.begin(steps, fires=searched)
            if session.run.folder is not None:
                self._panels.review.runs.show_current(session.run.folder)
            self.list_runs()
        else:
            self.results.clear()
        self.changed.emit()

    def trial_ended(self, outcome: Outcome) -> None:
        """Add a step to the results."""
        self.results.step(outcome, self._panels.session.source)

    def run_ended(self, done: Executed) -> None:
        """The run is on disk now."""
        self.ending = _ended(done.state, done.folder, done.spikes)
        stored = (done.folder / DATA).exists()  # not where it was deleted meanwhile
        if done.state is RunState.FAULTED and not stored:
            self.run_cut("Broke")
        source = self._panels.session.source
        if source is not None:
            self._panels.centre.view.set_now(source.reach, source.length)
        self.results.end(done, source)
        if stored:  # nor where it ended before the first sample
            self._ended = done.folder
            self._records.exchange(done.folder)
        QTimer.singleShot(LATER, self.list_runs)
        QTimer.singleShot(LATER, gc.collect)
        # by then the next run may go on, whose STOP would wait for it
        QTimer.singleShot(LATER, lambda: start(trim, "give back"))

    def run_cut(self, word: str) -> None:
        """The engine died or the run broke: its record may have to be recovered."""
        self.ending = f"{word} · {self._panels.session.run.name}"
        self.list_runs()

    def reported(self, folder: Path) -> None:
        """A report exists, and the twin has come to the end."""
        self.results.reported(folder, self.run or self._panels.session.source)

    def take_fetched(self) -> None:
        """Repaint where samples of a run on disk have been read."""
        if self.run is not None and self.run.take_fetched():
            if self.run.has_model and self._modelled is not self.run:
                self._modelled = self.run
                self.results.compare_with_model(self.run)
            self._panels.centre.refresh(self._lanes())

    def compare_live(self) -> None:
        """Compare the run in progress with the model, while probes are on the circuit.

        Also between two steps, so that the session knows how well they agree. Before
        the first the model has the force of a plan that has not begun.
        """
        session = self._panels.session
        begun = session.state is WindowState.RUNNING and session.run.trial is not None
        live = begun and session.run.probes == "circuit"
        if live and session.source is not None:
            self.results.compare_with_model(session.source)

    # --- inside

    def _agreed(self, agreement: Agreement | None) -> None:
        self._panels.session.run.agreement = agreement

    def _lanes(self) -> tuple[Lane, ...] | None:
        """The lanes of what is on screen; what is left out has none. None: no plan."""
        session = self._panels.session
        if session.monitor.alive:
            return lanes_for(WATCHED, twin=False)
        if self.live is not None and session.unkept == BY_HAND:
            return lanes_for(DRIVEN, twin=False)
        if self.run is not None:
            return lanes_for(self.run.signals, twin=self.run.has_model)
        expectation = session.plan_on_screen
        if expectation is None:
            return None
        needs, record = expectation.needs, expectation.record
        signals = {"force", *needs.stored}
        signals |= set(record.signals) & {"spikes", *AVERAGED}
        if needs.detect_on is not None:
            signals.add("spikes")
        if "coil_current" not in record.signals:
            signals.discard("coil_current")
        return lanes_for(signals, twin=bool(expectation.preview.traces))

    def _may_show(self, source: Source, what: str) -> bool:
        """Whether nothing is in progress; else `source` is let go."""
        if self._busy:
            source.close()
            self.say(f"A run is in progress; {what} when it has ended.")
            return False
        self.leave_run()
        self._records.shown = source
        return True

    def _show_run(self, source: RunSource) -> None:
        if not self._may_show(source, "old runs open"):
            return
        panels = self._panels
        panels.session.opened = (source.path.name,)
        panels.centre.view.clear_cursors()
        panels.centre.show_source(source, self._lanes())
        spikes = source.spikes.size if "spikes" in source.signals else None
        self.results.stored(source)
        status = str(source.info.get("status"))
        self._show_stored(source, _ended(status, source.path, spikes))
        self.changed.emit()

    def _exchange(self, source: RunSource) -> None:
        """Show the record in place of what was seen live; nothing else moves."""
        if self._busy or self.run is not None:
            source.close()
            return
        self._records.shown = source
        self._panels.centre.exchange_source(source, self._lanes())
        self.results.recorded(source)
        self._show_stored(source, self.ending)

    def _show_stored(self, source: RunSource, ending: str) -> None:
        self._panels.review.runs.show_current(source.path)
        self._show_steps(source, ending)

    def _show_steps(self, source: Source, said: str) -> None:
        """The steps of what is in the lanes, below them."""
        snapshot, reach = self._panels.session.snapshot(), source.reach
        self._panels.centre.progress.show_run(
            snapshot, source.holds, source.length, reach, None, said
        )

    def _show_comparison(self, comparison: Comparison) -> None:
        if not self._may_show(comparison, "runs are compared"):
            return
        names = tuple(member.name for member in comparison.members)
        self._panels.session.opened = names
        paths = [one.source.path for one in comparison.members]
        self._panels.review.runs.show_current(*filter(None, paths))
        self.results.compare()
        self._panels.centre.compare_bar.show_comparison(comparison)
        self._panels.centre.show_source(comparison, self._lanes())
        self._show_steps(comparison.first, f"Steps of {MARKS[0]} {names[0]}")
        self.changed.emit()

    def _count_from(self, level: float) -> None:
        """Put a threshold into the form, with a fifth of it as hysteresis as usual."""
        texts = {"threshold": level, "hysteresis": level / 5}
        detect = {key: show(round(value, 3), "V") for key, value in texts.items()}
        self._panels.setup.tables.form("detect").propose(detect)
        said = f"In the form: spikes are counted from {detect['threshold']} on"
        self._panels.session.log.add(Severity.INFO, "detect", said)

    def _queue(self, scene: str, title: str) -> None:
        problem = self._panels.session.enqueue_scene(scene, title)
        if problem:
            self.say(problem)

    def _again(self, entry: RunSummary) -> None:
        scene = str(entry.folder / "scene.toml")
        if self._busy:
            self._queue(scene, entry.title)
        else:
            self.close_run()
            self.open_scene(scene)

    def _list(self, found: list[RunSummary]) -> None:
        self._panels.review.runs.show_entries(found)
        newest = found[:-5:-1]
        self._panels.centre.empty.show_recent(
            [
                (f"{e.title} · {day(e.started)} · {e.status.capitalize()}", e.folder)
                for e in newest
            ]
        )


def _ended(status: str, folder: Path, spikes: int | None) -> str:
    """How a run ended: "Complete · 2026-11-23_demo · 5 spikes"."""
    return f"{status.capitalize()} · {folder.name} · {looked_for(spikes, 'spike')}"


def _runs_in(out: Path) -> list[RunSummary]:
    """The runs in a folder, oldest first; none where it is not made yet."""
    try:
        with Catalogue(out) as found:
            return found.runs()
    except RunFolderError:
        return []
