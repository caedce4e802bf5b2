"""What can be done with runs on disk besides showing them: notes, recovery, tidying."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import QFile, QObject
from PySide6.QtWidgets import QWidget

from gui.dialogs.about_run import AboutRun
from gui.dialogs.confirm import Confirm
from gui.screen.panels import Panels
from gui.screen.screen import Screen
from gui.session.log import Severity
from tactile_lab.engine.engine import Reply
from tactile_lab.engine.jobs import recover_run
from tactile_lab.errors import TactileLabError
from tactile_lab.store.folder import is_live
from tactile_lab.store.remarks import add_note, change_remarks
from tactile_lab.store.summary import RunSummary


class RunActions(QObject):
    """Notes, recovery, stars, deletion, and the card with all about a run.

    Args:
        window: its cards cover.
        panels: with the list of runs and the field for notes.
        screen: shows what has changed.
    """

    def __init__(self, window: QWidget, panels: Panels, screen: Screen) -> None:
        super().__init__(window)
        self._panels, self._screen = panels, screen
        self.card = AboutRun(window, panels.theme)
        self.confirm = Confirm(window, panels.theme)
        self.card.saved.connect(self._said)
        runs = panels.review.runs
        runs.about_asked.connect(lambda entry: self.card.show_run(entry.folder))
        runs.recovered.connect(self.recover)
        runs.starred.connect(self.star)
        runs.deleted.connect(self.delete)
        runs.refresh_asked.connect(screen.list_runs)
        panels.centre.log.noted.connect(self.note)

    @property
    def _folder(self) -> Path | None:
        """Of the run on screen, also while its record is still being opened."""
        run, session = self._screen.run, self._panels.session
        if run is not None:
            return run.path
        ended = session.source is not None and session.source is session.run.source
        return session.run.folder if ended else None

    @property
    def note_goes_to(self) -> str:
        """Where a note that is typed now is kept, for the field's hint."""
        if self._panels.session.state.in_run:
            return "Note on the run in progress …  (N)"
        if self._folder is not None:
            return "Note on the run on screen …  (N)"
        return "Note for the next run …  (N)"

    def note(self, text: str) -> None:
        """Keep a note: with the run in progress, the one on screen, or the next."""
        session, folder = self._panels.session, self._folder
        if session.state.in_run or folder is None:
            session.note(text)
            return
        cursors = self._panels.centre.view.cursors
        at = None if cursors is None else cursors[0]
        try:
            add_note(folder, text, at)
        except TactileLabError as error:
            self._screen.say(f"The note was not kept: {error}")
            self._panels.centre.log.note.setText(text)
            return
        where = "" if at is None else f" at cursor A, {at:.3f} s"
        session.log.add(Severity.NOTE, "note", f"{text} ({folder.name}{where})")
        self._said(folder)

    def about_shown(self) -> None:
        """Open the card for the run on screen, or for the last one."""
        if self._folder is None:
            self._screen.say("No run is on screen; choose one in Runs.")
        else:
            self.card.show_run(self._folder)

    def recover(self, entry: RunSummary) -> None:
        """Make a run whole that was cut short, then report and show it."""
        session = self._panels.session
        session.log.add(Severity.INFO, "store", f"Recovering {entry.name} …")
        session.desk.ask(
            lambda reply: self._recovered(entry.folder, reply),
            recover_run,
            entry.folder,
        )

    def star(self, entry: RunSummary) -> None:
        """Give a run a star, or take it away."""
        try:
            change_remarks(
                entry.folder, lambda said: replace(said, starred=not said.starred)
            )
        except TactileLabError as error:
            self._screen.say(str(error))
        self._screen.list_runs()

    def delete(self, entry: RunSummary) -> None:
        """Ask, and put a run's folder into the desktop's waste basket."""
        self.confirm.ask(
            f"Delete {entry.title or entry.name}?",
            f"The folder <b>{entry.name}</b> goes into the desktop's waste basket, "
            "with its samples, report and notes.",
            "Delete",
            lambda: self._delete(entry.folder),
        )

    def _delete(self, folder: Path) -> None:
        run = self._screen.run
        if run is not None and any(one.source.path == folder for one in run.members):
            self._screen.leave_run()
            self._screen.forget(folder)
        if is_live(folder):
            self._screen.say(f"{folder.name} is still being recorded.")
        elif QFile.moveToTrash(str(folder)):
            said = f"{folder.name} is in the waste basket"
            self._panels.session.log.add(Severity.INFO, "store", said)
            self._panels.centre.say("")  # of a run that could not be deleted
        else:
            self._screen.say(
                f"{folder} was not deleted: the desktop offers no waste basket for it. "
                "Remove the folder by hand."
            )
        self._screen.list_runs()

    def _recovered(self, folder: Path, reply: Reply[str]) -> None:
        session = self._panels.session
        if reply.value is None:
            self._screen.say(f"{folder.name} was not recovered: {reply.problem}")
            return
        session.log.add(Severity.GOOD, "store", f"{folder.name}: {reply.value}")
        session.run.report(folder)
        self._screen.list_runs()
        if not session.state.in_run:
            self._screen.open_run(folder)

    def _said(self, folder: Path) -> None:
        """Somebody said something of a run: list, lanes and report show it."""
        self._panels.session.run.renew_report(folder)
        self._screen.list_runs()
        run = self._screen.run
        if run is not None and run.path == folder:
            run.read_notes()
            self._panels.centre.stack.refresh()
