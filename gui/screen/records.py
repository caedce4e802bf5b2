"""Runs read from disk with the model beside them, away from the window's thread."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from gui.lanes.compare import Comparison
from gui.lanes.source import Member, Source
from gui.review.run_card import differing
from gui.session.session import Session
from tactile_lab.engine.engine import Reply
from tactile_lab.engine.events import ModelPart
from tactile_lab.engine.jobs import model_of_run
from tactile_lab.engine.threads import start
from tactile_lab.errors import TactileLabError
from tactile_lab.store.summary import RunSummary

if TYPE_CHECKING:
    from gui.lanes.stored import RunSource


class Records(QObject):
    """Reads runs, and has the engine solve and sample the model beside them.

    Attributes:
        loaded: a run was read; its model follows.
        exchanged: the run that has ended was read, and its model has come too.
        compared: a `Comparison` was read.
        failed: why a run was not read, or has no model.
        shown: what is from disk on screen; set by whoever shows it.
    """

    loaded = Signal(object)
    exchanged = Signal(object)
    compared = Signal(object)
    failed = Signal(str)
    _read = Signal(object, bool)

    def __init__(self, session: Session, parent: QObject) -> None:
        super().__init__(parent)
        self._session = session
        self.shown: Source | None = None
        self._ended: RunSource | None = None
        self._awaited: Path | None = None
        self._asked: Path | None = None
        self._read.connect(self._arrived)

    def open(self, folder: Path) -> None:
        """Read a run, to be shown as soon as possible, unless another is asked for."""
        self._asked = folder
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

    def leave(self) -> bool:
        """Let go of what is shown and what is awaited; whether anything was shown."""
        self.forget()
        shown, self.shown = self.shown, None
        if shown is not None:
            shown.close()
        return shown is not None

    def compare(self, chosen: Sequence[RunSummary]) -> None:
        """Read two or three runs, to be compared."""
        self._asked = None

        def work() -> None:
            from gui.lanes.stored import RunSource

            members: list[Member] = []
            try:
                told = differing(chosen[:3])
                for entry, apart in zip(chosen[:3], told, strict=True):
                    source = RunSource(entry.folder)
                    clock = entry.folder.name[11:17]
                    name = ":".join(clock[k : k + 2] for k in (0, 2, 4))
                    words = " · ".join(filter(None, (entry.scene, apart)))
                    members.append(Member(f"{name} {words}".strip(), source))
            except (TactileLabError, OSError) as error:
                for member in members:
                    member.source.close()
                self.failed.emit(str(error))
                return
            self.compared.emit(Comparison(members))

        start(work, "compare", finishes=True)

    def _load(self, folder: Path, *, ended: bool) -> None:
        def work() -> None:
            from gui.lanes.stored import RunSource

            try:
                source = RunSource(folder)
            except (TactileLabError, OSError) as error:
                self.failed.emit(str(error))
                return
            self._read.emit(source, ended)

        start(work, "open run", finishes=True)

    def _arrived(self, source: RunSource, ended: bool) -> None:
        if source.path != (self._awaited if ended else self._asked):
            source.close()
            return
        if ended:
            self._ended = source
        else:
            self.loaded.emit(source)
        folder = source.path
        # the model alone has one voltage for a whole run
        if source.sets_voltages or not source.has_sensor:
            self._modelled(folder, Reply(None))
            return
        desk = self._session.desk
        desk.ask(lambda reply: self._modelled(folder, reply), model_of_run, folder)

    def _modelled(self, folder: Path, reply: Reply[ModelPart]) -> None:
        ended = self._ended
        if ended is not None and ended.path == folder:
            self._ended = self._awaited = None
            self._add(ended, reply)
            self.exchanged.emit(ended)
        elif (shown := self._shown(folder)) is not None:
            self._add(shown, reply)

    def _add(self, source: RunSource, reply: Reply[ModelPart]) -> None:
        if reply.value is None and reply.problem:
            name = source.path.name
            self.failed.emit(f"No model beside {name}: {reply.problem}")
        elif reply.value is not None:
            source.add_twin(reply.value, partial(self._look, source.path))

    def _look(self, folder: Path, start: float, end: float, count: int) -> None:
        """Have a part of the model sampled closely."""

        def seen(reply: Reply[ModelPart]) -> None:
            shown = self._shown(folder)
            if shown is not None and reply.value is not None:
                shown.add_twin_part(reply.value)

        self._session.desk.ask(seen, model_of_run, folder, start, end, count)

    def _shown(self, folder: Path) -> RunSource | None:
        """The run on screen, if it is that in `folder`."""
        from gui.lanes.stored import RunSource

        shown = self.shown
        return shown if isinstance(shown, RunSource) and shown.path == folder else None
