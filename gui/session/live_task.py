"""A run, the monitor or manual control in the engine, as the window follows it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec

from PySide6.QtCore import QObject

from gui.session.heard import Heard
from gui.session.log import Log
from gui.session.status import Status
from tactile_lab.acquisition.ending import CoilState, Ending
from tactile_lab.acquisition.events import Streaming
from tactile_lab.engine.engine import ServedTask
from tactile_lab.engine.events import Begun, Ended, Samples, TaskEvent
from tactile_lab.engine.link import Link, RemoteTask

if TYPE_CHECKING:
    from tactile_lab.engine.task import Task

P = ParamSpec("P")


class LiveTask(QObject):
    """One task at a time, from its beginning to its end; nothing here blocks.

    Attributes:
        task: in the engine; None between two.
        coil: its state, as told last; None before the first word and after the end.
        heard: of it; None where it cannot switch anything on: before it has begun, and
            after the end.
        answered: role -> when that instrument was heard; none before its first word.
    """

    def __init__(self, link: Link, status: Status, log: Log) -> None:
        super().__init__()
        self._link, self._status, self._log = link, status, log
        self.task: RemoteTask | None = None
        self.coil: CoilState | None = None
        self.heard: Heard | None = None
        self.answered: dict[str, Heard] = {}

    @property
    def alive(self) -> bool:
        """Whether it may still hold instruments."""
        return self.task is not None

    def stop(self, reason: str) -> None:
        """Switch the coil off and end; returns at once."""
        if self.task is not None:
            self.task.stop(reason)

    def say(
        self,
        act: Callable[Concatenate[ServedTask, P], None],
        *arguments: P.args,
        **named: P.kwargs,
    ) -> None:
        """Have one of `engine.commands` done to the task, if there is one."""
        if self.task is not None:
            self.task.say(act, *arguments, **named)

    def take(self, event: TaskEvent) -> None:
        """Take what the task told."""
        if isinstance(event, Ended):
            self.task = self.coil = self.heard = None
            self.has_ended(event.ending)
            return
        if isinstance(event, Begun | Samples):
            self.heard = self.heard or Heard()
            self.heard.word()
        if isinstance(event, Streaming):
            scope = self.answered.setdefault("scope", Heard())
            (scope.go_on if event.on else scope.pause)()
        if isinstance(event, Samples):
            self.coil = event.coil
            if event.bins:
                self._answers("scope")
        self.hear(event)

    def _begin(
        self,
        act: Callable[Concatenate[ServedTask, P], Task[Any]],
        *arguments: P.args,
        **named: P.kwargs,
    ) -> None:
        self.coil = self.heard = None
        self.answered = {}
        self.task = self._link.begin(self.take, act, *arguments, **named)

    def _answers(self, role: str) -> None:
        """An instrument has said something just now."""
        if role in self.answered:
            self.answered[role].word()
        else:
            self.answered[role] = Heard()

    @abstractmethod
    def hear(self, event: TaskEvent) -> None:
        """The task told something; it goes on."""

    @abstractmethod
    def has_ended(self, ending: Ending) -> None:
        """The task has ended."""
