"""The pipe to the engine, from the side of a window, a script or a notebook.

from tactile_lab.engine.commands import begin_run
from tactile_lab.engine.link import Link
from tactile_lab.engine.request import Request

with Link() as link:
    for event in link.follow(begin_run, Request("demo"), Path("runs"), {}):
        print(event)                     # Begun, Samples, ... to Ended
"""

from __future__ import annotations

import multiprocessing
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar

from tactile_lab.acquisition.ending import Ending
from tactile_lab.acquisition.events import RunState
from tactile_lab.bench import OffReport
from tactile_lab.engine.engine import Act, Engine, Reply, ServedTask, main
from tactile_lab.engine.events import Ended, TaskEvent
from tactile_lab.engine.process import EngineProcess
from tactile_lab.engine.threads import start
from tactile_lab.instruments.guard_log import left_by_guard

if TYPE_CHECKING:
    from tactile_lab.engine.task import Task

T = TypeVar("T")
P = ParamSpec("P")
Hear = Callable[[TaskEvent], None]


class RemoteTask:
    """A task in the engine. Iterating gives its events, up to `Ended`.

    Args:
        number: names it in the engine.
        send: sends an act with its arguments to it, as `Engine` is to take it.
        hear: takes its events when the link is polled; None: they are iterated over.
    """

    def __init__(
        self, number: int, send: Callable[..., None], hear: Hear | None = None
    ) -> None:
        self.number, self._send, self.hear = number, send, hear
        self._events: SimpleQueue[TaskEvent] = SimpleQueue()
        self._ended = threading.Event()

    def say(
        self,
        act: Callable[Concatenate[ServedTask, P], None],
        *arguments: P.args,
        **named: P.kwargs,
    ) -> None:
        """Have one of `engine.commands` done to it; returns at once."""
        self._send(Engine.say, act, *arguments, **named)

    def stop(self, reason: str) -> None:
        """Switch the coil off and end; returns at once."""
        self._send(Engine.stop, reason)

    @property
    def alive(self) -> bool:
        """Whether it may still hold instruments."""
        return not self._ended.is_set()

    def join(self, timeout: float) -> bool:
        """Wait for the end, at most `timeout` s; whether it came."""
        return self._ended.wait(timeout)

    def take(self, event: TaskEvent) -> None:
        """An event came; called by the thread that reads the pipe."""
        if isinstance(event, Ended):
            self._ended.set()
        if self.hear is None:
            self._events.put(event)

    def __iter__(self) -> Iterator[TaskEvent]:
        """Its events as they come."""
        while True:
            event = self._events.get()
            yield event
            if isinstance(event, Ended):
                return


class Link:
    """Starts the engine when it is first needed, and again where it has died.

    Args:
        separate: in a process of its own; else in a thread, for tests that reach into
            the simulated far ends.
        realtime: pace a simulated bench by the wall clock.
        lost: told why where the engine has died, when the link is polled.
        rest: time, s, after which an engine of which nothing is asked ends, when the
            link is polled; what is asked next starts another. None keeps it.
        behind: it is asked for nothing that holds instruments: on a busy computer it
            comes after who does.
    """

    def __init__(
        self,
        *,
        separate: bool = True,
        realtime: bool = True,
        lost: Callable[[str], None] = lambda why: None,
        rest: float | None = None,
        behind: bool = False,
    ) -> None:
        self._behind = behind
        self._rest, self._used = rest, time.monotonic()
        self._separate, self._realtime, self._lost = separate, realtime, lost
        self._pipe: Connection | None = None
        self._outbox: SimpleQueue[bytes | None]  # of the pipe that is open
        self._process: EngineProcess | threading.Thread | None = None
        self._tasks: dict[int, RemoteTask] = {}
        self._asked: dict[int, Callable[[Reply[Any]], None]] = {}
        self._inbox: SimpleQueue[tuple[Callable[[Any], None], Any]] = SimpleQueue()
        self._last = 0
        self._lock = threading.Lock()
        self._closing = False

    def begin(
        self,
        hear: Hear | None,
        act: Callable[Concatenate[ServedTask, P], Task[Any]],
        *arguments: P.args,
        **named: P.kwargs,
    ) -> RemoteTask:
        """Begin a task.

        Args:
            hear: takes its events when the link is polled; None: they are iterated
                over.
            act: one of `engine.commands` that makes a task.
            *arguments: of that.
            **named: of that, too.
        """
        with self._lock:
            number = self._number()
            task = RemoteTask(number, partial(self._send, number), hear)
            self._tasks[number] = task
            self._write((number, Engine.begin, act, arguments, named))
        return task

    def follow(
        self,
        act: Callable[Concatenate[ServedTask, P], Task[Any]],
        *arguments: P.args,
        **named: P.kwargs,
    ) -> RemoteTask:
        """Begin a task whose events are iterated over."""
        return self.begin(None, act, *arguments, **named)

    def ask(
        self,
        then: Callable[[Reply[T]], None],
        act: Callable[Concatenate[Engine, P], T],
        *arguments: P.args,
        **named: P.kwargs,
    ) -> None:
        """Have one of `engine.jobs` answered; `then` takes the reply when polled."""
        with self._lock:
            number = self._number()
            self._asked[number] = then
            self._write((number, Engine.ask, act, arguments, named))

    def poll(self) -> bool:
        """Hand over all that came since, in the calling thread; whether any did."""
        came = False
        while True:
            try:
                take, told = self._inbox.get_nowait()
            except Empty:
                break
            came = True
            take(told)
        if self._rest is not None and time.monotonic() - self._used > self._rest:
            self._let_rest()
        return came

    @property
    def idle(self) -> bool:
        """Whether all that came was handed over."""
        return self._inbox.empty()

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
        with self._lock:
            self._write(None)
        if self._process is not None:
            self._process.join(timeout)

    def __enter__(self) -> Link:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def open(self) -> None:
        """Start the engine, which else what is asked first does; returns at once."""
        with self._lock:
            self._number()

    def _let_rest(self) -> None:
        """Have an engine end that has nothing to do."""
        with self._lock:
            if self._tasks or self._asked or self._process is None:
                return
            self._write(None)
            start(self._process.join, "rest")  # else it would stay as a zombie
            self._pipe = self._process = None

    def _number(self) -> int:
        """A number for what is asked next, and an engine to ask."""
        self._used = time.monotonic()
        if self._pipe is None:
            self._open()
        self._last += 1
        return self._last

    def _send(
        self, number: int, how: Act, act: Act | str, *arguments: Any, **named: Any
    ) -> None:
        with self._lock:
            self._write((number, how, act, arguments, named))

    def _write(self, asked: object) -> None:
        """Have it sent; a pipe is full where an engine starts, and holds up nobody."""
        if self._pipe is not None:
            self._outbox.put(bytes(ForkingPickler.dumps(asked)))
            if asked is None:
                self._outbox.put(None)

    def _open(self) -> None:
        self._pipe, theirs = multiprocessing.Pipe()
        if self._separate:
            self._process = EngineProcess(
                main, theirs, realtime=self._realtime, behind=self._behind
            )
        else:
            served = Engine(theirs, realtime=self._realtime)
            self._process = start(served.serve, "engine")
        self._outbox = SimpleQueue()
        ours, outbox, sending = self._pipe, self._outbox, threading.Lock()
        start(lambda: _pass_on(outbox, ours, sending), "link out")
        start(lambda: self._read(ours, outbox, sending), "link")

    def _read(
        self,
        pipe: Connection,
        outbox: SimpleQueue[bytes | None],
        sending: threading.Lock,
    ) -> None:
        why = "The pipe to it ended"
        try:
            while True:
                self._take(*pipe.recv())
        except (EOFError, OSError):
            pass
        except Exception as error:  # what a user's own protocol sends may not unpickle
            why = f"{type(error).__name__}: {error}"
        outbox.put(None)
        with self._lock:
            with sending:
                pipe.close()
            if pipe is not self._pipe:
                return  # it was let rest
            self._pipe = None
            tasks, asked = list(self._tasks), list(self._asked)
        if not self._closing:
            self._inbox.put((self._lost, why))
        off = self.pid and left_by_guard(self.pid)
        off = off or OffReport(False, None, "not verified")
        for number in tasks:
            self._take(number, Ended(Ending(RunState.LOST, off, why)))
        for number in asked:
            self._take(number, Reply(None, f"The engine ended: {why}", lost=True))

    def _take(self, number: int, told: Any) -> None:
        self._used = time.monotonic()
        if isinstance(told, Reply):
            self._inbox.put((self._asked.pop(number), told))
        elif (task := self._tasks.get(number)) is not None:
            if isinstance(told, Ended):
                del self._tasks[number]
            if task.hear is not None:
                self._inbox.put((task.hear, told))
            task.take(told)


def _pass_on(
    outbox: SimpleQueue[bytes | None], pipe: Connection, sending: threading.Lock
) -> None:
    """Send what is asked of an engine, until None or the end of its pipe."""
    try:
        while (asked := outbox.get()) is not None:
            with sending:
                pipe.send_bytes(asked)
    except OSError:
        pass  # the reading thread sees the end of the pipe too, and tells
