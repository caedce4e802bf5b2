"""Runs read from disk with the model beside them, away from the window's thread."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from gui.session.messages import Twins, TwinSeen
from gui.session.session import Session
from gui.session.threads import start
from tactile_lab.errors import TactileLabError

if TYPE_CHECKING:
    from gui.lanes.stored import RunSource


class Records(QObject):
    """Reads runs, and has the engine solve and sample the model beside them.

    Attributes:
        loaded: a run was read; its model follows.
        exchanged: the run that has ended was read, and its model has come too.
        failed: why a run was not read, or has no model.
        shown: the run on screen, if it is from disk; set by whoever shows it.
    """

    loaded = Signal(object)
    exchanged = Signal(object)
    failed = Signal(str)
    _read = Signal(object, bool)

    def __init__(self, session: Session, parent: QObject) -> None:
        super().__init__(parent)
        self._session = session
        self.shown: RunSource | None = None
        self._ended: RunSource | None = None
        self._awaited: Path | None = None
        self._read.connect(self._arrived)
        session.twinned.connect(self._twinned)
        session.twin_seen.connect(self._seen)

    def open(self, folder: Path) -> None:
        """Read a run, to be shown as soon as possible."""
        self._load(folder, ended=False)

    def exchange(self, folder: Path) -> None:
        """Read the run that has ended, to be shown in place of what was seen live."""
        self.forget()
        self._awaited = folder
        self._load(folder, ended=True)

    def forget(self) -> None:
        """Nobody waits for the run that has ended any more."""
        self._awaited = None
        if self._ended is not None:
            self._ended.close()
            self._ended = None

    def _load(self, folder: Path, *, ended: bool) -> None:
        def work() -> None:
            from gui.lanes.stored import RunSource

            try:
                source = RunSource(folder)
            except (TactileLabError, OSError) as error:
                self.failed.emit(str(error))
                return
            self._read.emit(source, ended)

        start(work, "open run")

    def _arrived(self, source: RunSource, ended: bool) -> None:
        if not ended:
            self.loaded.emit(source)
        elif source.path == self._awaited:
            self._ended = source
        else:
            source.close()
            return
        self._session.make_twin(source.path)

    def _twinned(self, told: Twins) -> None:
        ended = self._ended
        if ended is not None and ended.path == told.folder:
            self._ended = self._awaited = None
            self._add(ended, told)
            self.exchanged.emit(ended)
        elif self.shown is not None and self.shown.path == told.folder:
            self._add(self.shown, told)

    def _add(self, source: RunSource, told: Twins) -> None:
        folder, look = told.folder, self._session.look_at_twin
        if told.whole is None:
            self.failed.emit(told.problem)
        else:
            source.add_twin(told.whole, lambda *part: look(folder, *part))

    def _seen(self, told: TwinSeen) -> None:
        if self.shown is not None and self.shown.path == told.folder:
            self.shown.add_twin_part(told.part)
