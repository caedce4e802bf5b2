"""The window's end of the pipe to the engine, and a run there as the window sees it."""

from __future__ import annotations

import multiprocessing
import threading
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING, TypeVar

from gui.session.commands import (
    CheckBench,
    Command,
    ErrandDone,
    FitSteps,
    Leave,
    LookAtTwin,
    MakePlan,
    MakeTwin,
    ReadField,
    RecordWatch,
    RenewLease,
    SetCoil,
    StartRun,
    StartWatch,
    StopRun,
    TakeCoil,
    TakeNote,
)
from gui.session.messages import CoilByHand, Gone, Lost, Samples, Told
from gui.session.request import Request
from gui.session.threads import start

if TYPE_CHECKING:
    from multiprocessing.process import BaseProcess

    from tactile_lab.acquisition.ending import CoilState

Inbox = SimpleQueue[Told]

OPENING = (MakePlan, CheckBench, MakeTwin, LookAtTwin, FitSteps, ReadField)
"""What an engine is started for; the rest concerns something in one that has died."""


class Afar:
    """Something in the engine that holds instruments.

    Attributes:
        coil: as told last; None before the first word.
    """

    def __init__(self, link: Link, number: int, inbox: Inbox) -> None:
        self._link, self._number, self._inbox = link, number, inbox
        self._gone = threading.Event()
        self.coil: CoilState | None = None

    def stop(self, reason: str) -> None:
        """Switch the coil off and end; returns at once."""
        self._link.ask(StopRun(self._number, reason))

    @property
    def alive(self) -> bool:
        """Whether it may still hold instruments."""
        return not self._gone.is_set()

    def join(self, timeout: float) -> bool:
        """Wait for the end, at most `timeout` s; whether it came."""
        return self._gone.wait(timeout)

    def hear(self, told: Told) -> None:
        """Something came from it; called by the reading thread."""
        if isinstance(told, Samples | CoilByHand):
            self.coil = told.coil
        if isinstance(told, Gone):
            self._gone.set()
        self._inbox.put(told)

    def lose(self) -> bool:
        """The engine has ended; whether this had not."""
        had = self.alive
        self._gone.set()
        return had


class RunAfar(Afar):
    """A run, or a watch, in the engine."""

    def note(self, text: str, at: float) -> None:
        """Put a note into the run's log, stamped with its time, s."""
        self._link.ask(TakeNote(self._number, text, at))

    def record(self, out: Path, notes: Mapping[str, str]) -> None:
        """Keep the last minute of a watch as a run; `Recorded` tells the result."""
        self._link.ask(RecordWatch(self._number, out, dict(notes)))

    def errand_done(self, answer: str) -> None:
        """The person has done what the run waits for, and typed `answer`."""
        self._link.ask(ErrandDone(self._number, answer))


class HandAfar(Afar):
    """A coil that the engine drives by hand; `CoilByHand` tells its state.

    Attributes:
        asked: current that it was asked to hold last, A.
        opened: the source has answered.
    """

    asked = 0.0
    opened = False

    def hear(self, told: Told) -> None:
        """Something came from it; called by the reading thread."""
        if isinstance(told, CoilByHand):
            self.opened = told.opened
        super().hear(told)

    def hold(self, current: float) -> None:
        """Go to `current`, A, as fast as the slew limit lets it, and stay."""
        self.asked = current
        self._link.ask(SetCoil(self._number, current))

    def renew(self) -> None:
        """Show that the window lives; without it the coil goes off after 2 s."""
        self._link.ask(RenewLease(self._number))

    def read_field(self, request: Request) -> None:
        """Read the field of the bench that the coil belongs to."""
        self._link.ask(ReadField(self._number, request))


SomeAfar = TypeVar("SomeAfar", bound=Afar)


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
        self._runs: dict[int, Afar] = {}
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
            RunAfar, inbox, lambda number: StartRun(number, request, out, kept, report)
        )

    def watch(self, request: Request, inbox: Inbox) -> RunAfar:
        """Start to watch; what it tells is put into `inbox`."""
        return self._begin(RunAfar, inbox, lambda number: StartWatch(number, request))

    def take_coil(self, request: Request, inbox: Inbox) -> HandAfar:
        """Open the coil source to drive it by hand; `inbox` is told its state."""
        return self._begin(HandAfar, inbox, lambda number: TakeCoil(number, request))

    def _begin(
        self, kind: type[SomeAfar], inbox: Inbox, command: Callable[[int], Command]
    ) -> SomeAfar:
        with self._lock:
            self._last += 1
            made = kind(self, self._last, inbox)
            pipe = self._pipe or self._open()
            self._runs[self._last] = made
            _send(pipe, command(self._last))
        return made

    def ask(self, command: Command) -> None:
        """Send a command; returns at once. A dead engine is told as `Lost`."""
        with self._lock:
            if self._pipe is not None:
                _send(self._pipe, command)
            elif isinstance(command, OPENING):
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
