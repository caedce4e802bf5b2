"""The window's end of the pipe to the engine, and a run there as the window sees it."""

from __future__ import annotations

import multiprocessing
import threading
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING

from gui.session.commands import (
    Command,
    ErrandDone,
    Leave,
    RecordWatch,
    StartRun,
    StartWatch,
    StopRun,
    TakeNote,
)
from gui.session.messages import Gone, Lost, Samples, Told
from gui.session.request import Request
from gui.session.threads import start

if TYPE_CHECKING:
    from multiprocessing.process import BaseProcess

    from tactile_lab.acquisition.ending import CoilState

Inbox = SimpleQueue[Told]


class RunAfar:
    """A run in the engine.

    Attributes:
        coil: as told last; None before the first word.
    """

    def __init__(self, link: Link, number: int, inbox: Inbox) -> None:
        self._link, self._number, self._inbox = link, number, inbox
        self._gone = threading.Event()
        self.coil: CoilState | None = None

    def stop(self, reason: str) -> None:
        """Switch the coil off and end the run; returns at once."""
        self._link.ask(StopRun(self._number, reason))

    def note(self, text: str, at: float) -> None:
        """Put a note into the run's log, stamped with its time, s."""
        self._link.ask(TakeNote(self._number, text, at))

    def record(self, out: Path, notes: Mapping[str, str]) -> None:
        """Keep the last minute of a watch as a run; `Recorded` tells the result."""
        self._link.ask(RecordWatch(self._number, out, dict(notes)))

    def errand_done(self) -> None:
        """The person has done what the run waits for."""
        self._link.ask(ErrandDone(self._number))

    @property
    def alive(self) -> bool:
        """Whether the run may still hold instruments."""
        return not self._gone.is_set()

    def join(self, timeout: float) -> bool:
        """Wait for the end, at most `timeout` s; whether it came."""
        return self._gone.wait(timeout)

    def hear(self, told: Told) -> None:
        """Something came from this run; called by the reading thread."""
        if isinstance(told, Samples):
            self.coil = told.coil
        if isinstance(told, Gone):
            self._gone.set()
        self._inbox.put(told)

    def lose(self) -> bool:
        """The engine has ended; whether this run had not."""
        had = self.alive
        self._gone.set()
        return had


class Link:
    """Starts the engine when it is first needed, and again where it has died.

    Args:
        inbox: where everything that belongs to no run is put.
        separate: in a process of its own; else in a thread, for tests that reach into
            the simulated far ends.
        realtime: pace a simulated bench by the wall clock.
    """

    def __init__(
        self, inbox: Inbox, *, separate: bool = True, realtime: bool = True
    ) -> None:
        self._inbox, self._separate, self._realtime = inbox, separate, realtime
        self._pipe: Connection | None = None
        self._process: BaseProcess | threading.Thread | None = None
        self._runs: dict[int, RunAfar] = {}
        self._last = 0
        self._lock = threading.Lock()
        self._closing = False

    def run(
        self,
        request: Request,
        out: Path,
        inbox: Inbox,
        notes: Mapping[str, str] | None = None,
        *,
        report: bool = True,
    ) -> RunAfar:
        """Start a run; what it tells is put into `inbox`."""
        kept = dict(notes or {})
        return self._begin(
            lambda number: StartRun(number, request, out, kept, report), inbox
        )

    def watch(self, request: Request, inbox: Inbox) -> RunAfar:
        """Start to watch; what it tells is put into `inbox`."""
        return self._begin(lambda number: StartWatch(number, request), inbox)

    def _begin(self, command: Callable[[int], Command], inbox: Inbox) -> RunAfar:
        with self._lock:
            self._last += 1
            made = RunAfar(self, self._last, inbox)
            pipe = self._pipe or self._open()
            self._runs[self._last] = made
            _send(pipe, command(self._last))
        return made

    def ask(self, command: Command) -> None:
        """Send a command; returns at once. A dead engine is told as `Lost`."""
        with self._lock:
            if self._pipe is not None:
                _send(self._pipe, command)
            elif not isinstance(
                command, StopRun | TakeNote | ErrandDone | Leave | RecordWatch
            ):
                _send(self._open(), command)

    @property
    def pid(self) -> int | None:
        """The engine's process id; None while it has no process."""
        return getattr(self._process, "pid", None)

    @property
    def alive(self) -> bool:
        """Whether the engine works."""
        return self._process is not None and self._process.is_alive()

    def close(self, timeout: float = 10.0) -> None:
        """Let the engine end and wait for that, at most `timeout` s."""
        self._closing = True
        self.ask(Leave())
        if self._process is not None:
            self._process.join(timeout)

    def _open(self) -> Connection:
        from gui.session import engine

        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        if self._separate:
            self._process = context.Process(
                target=engine.main, args=(theirs, self._realtime), daemon=True
            )
            # daemonic: a window that ends without `close` still sends it SIGTERM
            self._process.start()
            theirs.close()
        else:
            served = engine.Engine(theirs, realtime=self._realtime)
            self._process = start(served.serve, "engine")
        self._pipe = ours
        start(lambda: self._read(ours), "link")
        return ours

    def _read(self, pipe: Connection) -> None:
        why = "The pipe to it ended"
        try:
            while True:
                number, told = pipe.recv()
                run = self._runs.get(number)
                if run is None:
                    self._inbox.put(told)
                    continue
                run.hear(told)
                if not run.alive:
                    del self._runs[number]
        except (EOFError, OSError):
            pass
        except Exception as error:  # what a user's own protocol sends may not unpickle
            why = f"{type(error).__name__}: {error}"
        with self._lock:
            pipe.close()
            self._pipe = None
            driving = any([run.lose() for run in self._runs.values()])
            self._runs.clear()
        if not self._closing:
            self._inbox.put(Lost(why, driving))


def _send(pipe: Connection, command: Command) -> None:
    try:
        pipe.send(command)
    except OSError:
        pass  # the reading thread sees the end of the pipe too, and tells
