"""What the results tell of the run on screen: its steps, fits, report and loss."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from gui.lanes.live import LiveSource
from gui.lanes.source import Source
from gui.on_desktop import open_on_desktop
from gui.review.conclusion import conclusion_of
from gui.review.results import ResultsView
from gui.session.fit import Fit, FitInput, fit_input, fit_steps
from gui.session.session import Session
from gui.session.steps import facts_of, loss_text, of_outcome, of_run
from tactile_lab.acquisition.events import RunState
from tactile_lab.engine.engine import Reply
from tactile_lab.errors import RunFolderError
from tactile_lab.measurement import MeasuredTrial
from tactile_lab.store.folder import DATA, REPORT
from tactile_lab.trial import Outcome

if TYPE_CHECKING:
    from gui.lanes.stored import RunSource
    from tactile_lab.acquisition.ending import Executed


class RunResults(QObject):
    """Collects steps, has them fitted, and keeps the results view up to date.

    Fits are made by the session's desk: in a thread of this process, they would take
    more from the frames than their own time. One is on its way at a time; the newest
    counts.

    Attributes:
        steps: what each of them gave.
        folder: of the run on screen; None before it is on disk.
    """

    agreed = Signal(object)
    """How well the model follows now: an `Agreement`, or None if nobody knows."""

    fitted = Signal(object)
    """The laws of the rate that were fitted: traces in Hz."""

    unopened = Signal(str)
    """Why a report or a folder could not be opened."""

    def __init__(self, view: ResultsView, session: Session, parent: QObject) -> None:
        super().__init__(parent)
        self.steps: list[MeasuredTrial] = []
        self.folder: Path | None = None
        self._view = view
        self._whole = False
        self._elsewhere = False
        self._total = 0
        self._desk, self._run = session.desk, session.run
        self._asked = 0
        self._fits = False
        self._next: tuple[tuple[MeasuredTrial, ...], FitInput] | None = None

    def begin(self, steps: int, *, fires: bool) -> None:
        """A run of so many steps begins.

        Args:
            steps: how many.
            fires: whether its spikes are looked for.
        """
        self._empty(steps, fires=fires, running=True)

    def plan(self, *, fires: bool) -> None:
        """A run is planned, and none is on screen."""
        self._view.show_kind(fires=fires)

    def clear(self) -> None:
        """Of what is on screen there is nothing to tell: it is no run."""
        self._empty(0, fires=True, running=False)

    def compare(self) -> None:
        """Several runs are on screen: what each gave is told when it is alone."""
        self.clear()
        self._view.show_kind(fires=False, several=True)

    def step(self, outcome: Outcome, source: LiveSource | None) -> None:
        """A step has ended."""
        self._elsewhere |= outcome.trial.probes != "circuit"
        middle = outcome.start + outcome.trial.length / 2
        why_not = "" if source is None else source.why_unrated(middle, middle)
        found = of_outcome(outcome, why_not)
        if found is not None:
            self.steps.append(found)
        self._show(running=True)
        self._fit(source)
        if source is not None:
            self._view.show_loop(source.loop)

    def end(self, done: Executed, source: LiveSource | None) -> None:
        """The run is on disk now."""
        self.folder = done.folder
        self._whole = done.state is RunState.COMPLETE
        self._show(running=False)
        self._fit(source)
        bare = source is not None and not source.sampled
        facts = [
            f"<b>{done.folder.name}</b>",
            done.off.text.partition(" | ")[0],
            "" if bare else loss_text(done.loss),
        ]
        self._view.show_facts("<br>".join(filter(None, facts)))
        self._offer_report()

    def reported(self, folder: Path, source: Source | None) -> None:
        """The run's report is written, and the model has come to the end."""
        if folder == self.folder:
            self._fit(source)
            self._offer_report()
            self._conclude(folder)

    def stored(self, source: RunSource) -> None:
        """A run from disk is on screen."""
        self.steps, self.folder = of_run(source), source.path
        self._whole = source.info.get("status") == "complete"
        self._elsewhere = source.moves_probes
        self._view.show_kind(fires="spikes" in source.signals)
        self._show(running=False)
        self._show_fit(None)  # those of the run before
        self._fit(source)
        self._view.show_loop(source.loop)
        self._view.show_facts(facts_of(source))
        self._view.show_statements(())
        self._offer_report()
        if (source.path / REPORT).exists():
            self._conclude(source.path)

    def recorded(self, source: RunSource) -> None:
        """The record of the last run is there, which is on screen, or again.

        Its times are those of the report. Live, they are by the host's clock, and only
        what has come to its end is told: not a step that was cut short.
        """
        if source.path != self.folder:
            self.stored(source)
        elif len(found := of_run(source)) >= len(self.steps):
            self.steps = found
            self._show(running=False)
            self._fit(source)

    def compare_with_model(self, source: Source) -> None:
        """The run, or the model beside it, has come further."""
        self._fit(source)

    def forget(self) -> None:
        """The run is no longer on screen; a fit on its way no longer counts."""
        self._asked += 1
        self._next = None
        self.agreed.emit(None)
        self.fitted.emit([])

    def _empty(self, steps: int, *, fires: bool, running: bool) -> None:
        self.steps, self.folder, self._whole = [], None, False
        self._elsewhere = False
        self._total = steps
        self._view.show_kind(fires=fires)
        self._view.show_facts("")
        self._offer_report()
        self._view.show_statements(())
        self._show(running=running)
        self._fit(None)

    def _show_fit(self, found: Fit | None) -> None:
        self._view.show_fit(found)
        self.fitted.emit([one.law for one in found.rates] if found else [])
        self.agreed.emit(None if found is None else found.agreement)

    def _fit(self, source: Source | None) -> None:
        """Fit the steps, and compare the run with the model beside it.

        With the probes elsewhere for a while there is nothing to compare.
        """
        self._asked += 1
        if source is None or self._elsewhere or len(source.members) > 1:
            self._next = None
            self._show_fit(None)
            return
        self._next = tuple(self.steps), fit_input(source)
        self._fit_next()

    def _fit_next(self) -> None:
        """Have the newest fit made, unless one is on its way."""
        if self._fits or self._next is None:
            return
        (steps, seen), self._next = self._next, None
        self._fits, asked = True, self._asked
        self._desk.ask(lambda reply: self._fitted(asked, reply), fit_steps, steps, seen)

    def _fitted(self, asked: int, reply: Reply[Fit]) -> None:
        self._fits = False
        if asked == self._asked:
            self._show_fit(reply.value)
        self._fit_next()

    def ask_report(self) -> None:
        """Open the report of the run on screen in the browser; write a missing one."""
        if self.folder is None:
            return
        if (self.folder / REPORT).exists():
            self._open(self.folder / REPORT)
        else:
            self._run.write_report(self.folder)
            self._offer_report()

    def _offer_report(self) -> None:
        """Say whether the run on screen has a report, and offer what can be done."""
        folder = self.folder
        if folder is None or not (folder / DATA).exists():
            self._view.show_report("")
        elif (folder / REPORT).exists():
            self._view.show_report("Open report")
        elif folder in self._run.reporting:
            self._view.show_report("Writing the report …", ready=False)
        else:
            self._view.show_report("Write report")

    def open_folder(self, out: Path) -> None:
        """Open the folder of the run on screen, else that of all runs."""
        self._open(self.folder or out)

    def _open(self, path: Path) -> None:
        if problem := open_on_desktop(path):
            self.unopened.emit(problem)

    def _conclude(self, folder: Path) -> None:
        try:
            found = conclusion_of(folder)
            self._view.show_statements(found.statements, found.tables, found.plots)
        except RunFolderError:
            self._view.show_statements(())  # reports of former versions have none

    def _show(self, *, running: bool) -> None:
        self._view.show_steps(
            self.steps, total=self._total, running=running, whole=self._whole
        )
