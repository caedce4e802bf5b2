"""The engine: a process that drives benches and solves models for whoever looks.

A window, a script or a notebook asks through one pipe (`engine.link`). In a process of
its own nothing the engine does takes time from a frame, and a window that dies takes
no run with it: when the pipe's other end is gone, each task is stopped, its coil
verified off and its record completed, before the process ends.

What is asked is a function with its arguments, carried out here: to begin a task, to
say something to it, or to answer a question. Nothing asked is waited on: a STOP is read
at once and goes straight to the coil, past whatever was said before it and is not done.
"""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing.connection import Connection
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from tactile_lab.acquisition.ending import Ending
from tactile_lab.acquisition.events import CoilCurrent, Event, RunState
from tactile_lab.bench import OffReport
from tactile_lab.engine.events import Begun, Ended, PersonAsked, Samples, TaskEvent
from tactile_lab.engine.memory import give_back, share_heap
from tactile_lab.engine.threads import start
from tactile_lab.errors import RefusedError, TactileLabError

if TYPE_CHECKING:
    from tactile_lab.acquisition.live_model import LiveModel
    from tactile_lab.engine.task import Task

T = TypeVar("T")
Act = Callable[..., Any]

QUIET = 2.0
"""Pause, s, in which what ended tasks have left is looked for."""

LEAVE = 60.0
"""Longest wait for tasks to end after the pipe's other end has gone, s."""

LAST = 1.0
"""Longest wait for what is just sent to it, s: it may be full, and nobody reads."""

MOST_TASKS, MOST_QUESTIONS = 8, 64
"""Tasks that may be begun and not yet ended, one of which has the instruments; and
questions that may wait for their answers. Each has threads of its own: whoever asks for
more asks by mistake, as a script does that never waits for an end."""

LOOK = 0.1
"""Time between two looks at whether what waits for the instruments was stopped, s."""

EVERY, AT_LEAST = 0.03, 0.2
"""Time between two looks at the newest samples and at the coil, and after which they
are told although nothing changed, s."""

SLICE, BEHIND = 0.3, 0.15
"""Time between two slices of the model beside a run, and how far it stays behind the
samples, s: the host hears of a set-point only after the samples that it moved."""


@dataclass(frozen=True, eq=False)
class Reply(Generic[T]):
    """The answer to a question.

    Attributes:
        value: what came of it; None where nothing did.
        problem: why nothing came of it, "" if something did.
        lost: the engine died over it.
    """

    value: T | None
    problem: str = ""
    lost: bool = False


class Engine:
    """Serves one pipe.

    What comes through it is (number, how, act, arguments, named ones): `how` is
    `begin`, `say`, `stop` or `ask`, `act` a function, or why to stop, and all that is
    told of it carries its number. None means that the other end goes.

    Args:
        pipe: to whoever looks.
        realtime: pace a simulated bench by the wall clock.
        alone: in a process of its own, whose memory it gives back.

    Attributes:
        tasks: by number; those that have ended go when another begins, or in a pause.
        instruments: held by whoever uses them: a task waits while somebody asks who
            is there.
    """

    def __init__(
        self, pipe: Connection, *, realtime: bool = True, alone: bool = False
    ) -> None:
        self._pipe, self.realtime, self._alone = pipe, realtime, alone
        self._sending = threading.Lock()
        self.tasks: dict[int, ServedTask] = {}
        self.instruments = threading.Lock()
        self._said: SimpleQueue[tuple[ServedTask, Callable[[], None]] | None]
        self._said = SimpleQueue()
        self._questions = threading.BoundedSemaphore(MOST_QUESTIONS)

    def serve(self) -> None:
        """Do what is asked until the other end has gone; then leave every coil off."""
        said = start(self._do_said, "said")
        try:
            while (asked := self._next()) is not None:
                number, how, act, arguments, named = asked
                how(self, number, act, *arguments, **named)
        except (EOFError, OSError):
            pass
        finally:
            for task in self.tasks.values():
                task.stop("The window has gone")
            for task in self.tasks.values():
                task.thread.join(LEAVE)
            self._said.put(None)
            said.join(LEAVE)
            # not under an answer that is just sent, which would break on it
            sent = self._sending.acquire(timeout=LAST)
            self._pipe.close()
            if sent:
                self._sending.release()

    def _next(self) -> Any:
        """What is asked next; memory is given back where nobody asks for a while."""
        while self._alone and not self._pipe.poll(QUIET):
            self._forget_ended()
            if not self.tasks:
                give_back()
                break
        return self._pipe.recv()

    def _forget_ended(self) -> None:
        self.tasks = {n: t for n, t in self.tasks.items() if t.thread.is_alive()}

    def begin(self, number: int, act: Act, *arguments: Any, **named: Any) -> None:
        """Have `act(served, ...)` make a task, and run it in a thread of its own."""
        self._forget_ended()
        if len(self.tasks) >= MOST_TASKS:
            words = (
                f"{MOST_TASKS} tasks have been begun and have not ended; one has the "
                "instruments, the others wait for them. Wait until one has ended, or "
                "stop one."
            )
            self.tell(number, Ended(Ending.refused(words)))
            return
        self.tasks[number] = ServedTask(
            lambda served: act(served, *arguments, **named),
            lambda told: self.tell(number, told),
            realtime=self.realtime,
            instruments=self.instruments,
        )

    def say(self, number: int, act: Act, *arguments: Any, **named: Any) -> None:
        """Have `act(served, ...)` done to a task; one that has ended hears nothing."""
        if number in self.tasks:
            task = self.tasks[number]
            self._said.put((task, partial(act, task, *arguments, **named)))

    def stop(self, number: int, reason: str) -> None:
        """Switch off and end a task, now."""
        if number in self.tasks:
            self.tasks[number].stop(reason)

    def _do_said(self) -> None:
        """Do what is said in its order, in a thread of its own: a note may take long.

        Its disk may be slow, and a STOP behind it would wait as long. A task that did
        not do what it was told does not go on.
        """
        while (said := self._said.get()) is not None:
            task, act = said
            try:
                act()
            except Exception as error:
                what = f"{type(error).__name__}: {error}"
                task.stop(f"What was asked of it meanwhile broke. {what}")

    def ask(self, number: int, act: Act, *arguments: Any, **named: Any) -> None:
        """Have `act(engine, ...)` worked out beside everything else, and reply."""
        work = partial(act, self, *arguments, **named)

        def answer() -> None:
            try:
                reply = _reply(work)
            finally:
                self._questions.release()
            self.tell(number, reply)

        if self._questions.acquire(blocking=False):
            start(answer, act.__name__)
        else:
            words = f"{MOST_QUESTIONS} questions wait for their answers already."
            self.tell(number, Reply(None, f"{words} Wait for some of them."))

    def tell(self, number: int, told: TaskEvent | Reply[Any]) -> None:
        """Tell the other end; one that has gone hears nothing."""
        with self._sending:
            try:
                self._pipe.send((number, told))
            except OSError:
                pass  # `serve` sees the end of the pipe and stops every task


class ServedTask:
    """A task in a thread of its own, told through the pipe from `Begun` to `Ended`.

    Args:
        make: makes the task, or raises because it is refused.
        tell: tells the other end, from any thread.
        realtime: pace a simulated bench by the wall clock.
        instruments: held while it uses them.

    Attributes:
        task: None until it is made.
        model: follows it; None where nothing is modelled.
        answers: what a person typed.
    """

    def __init__(
        self,
        make: Callable[[ServedTask], Task[Any]],
        tell: Callable[[TaskEvent], None],
        *,
        realtime: bool,
        instruments: threading.Lock,
    ) -> None:
        self._make, self._tell, self.realtime = make, tell, realtime
        self._instruments = instruments
        self.task: Task[Any] | None = None
        self.model: LiveModel | None = None
        self.answers: SimpleQueue[str] = SimpleQueue()
        self._said: list[Callable[[Any], None]] = []
        self._stopped: str | None = None
        self._lock = threading.Lock()
        self.thread = start(self._main, "task")

    def to_task(self, act: Callable[[Any], None]) -> None:
        """Have something done to the task: now, or as soon as it is made."""
        with self._lock:
            if self.task is None:
                self._said.append(act)
            else:
                act(self.task)

    def stop(self, reason: str) -> None:
        """Switch off and end it; returns at once, and waits for no lock."""
        self._stopped = reason
        if self.task is not None:
            self.task.stop(reason)

    def emit(self, event: Event) -> None:
        """The task tells something."""
        if self.model is not None and isinstance(event, CoilCurrent):
            self.model.add(event.acted, event.amperes)
        self._tell(event)

    def ask(self, text: str) -> str:
        """Have the other end ask a person to do something; what was typed.

        Raises:
            RefusedError: the run ended meanwhile.
        """
        return self._await(PersonAsked(text))

    def ask_field(self, text: str) -> str:
        """Have a person read the teslameter at the current that flows."""
        doubt, _, question = text.rpartition("\n")
        task = self.task
        current = None if task is None else task.coil_state.setpoint
        return self._await(PersonAsked(question, current or 0.0, doubt))

    def _await(self, asked: PersonAsked) -> str:
        self._tell(asked)
        while self.thread.is_alive():
            try:
                return self.answers.get(timeout=0.2)
            except Empty:
                pass
        raise RefusedError("The run has ended; nobody needs to answer.")

    def _main(self) -> None:
        ending = Ending(RunState.FAULTED, OffReport(False, None, "not verified"))
        try:
            ending = self._carry_out()
        finally:
            # an error may hold anything; its words are in the reason
            self._tell(Ended(replace(ending, failure=None)))

    def _carry_out(self) -> Ending:
        """Wait for the instruments, and only then make what uses them, and run it."""
        while not self._instruments.acquire(timeout=LOOK):
            if self._stopped is not None:
                return Ending.refused(f"It had not begun: {self._stopped}.")
        try:
            return self._make_and_run()
        finally:
            self._instruments.release()

    def _make_and_run(self) -> Ending:
        from tactile_lab.model.equations import shortest_interval

        try:
            task = self._make(self)
        except (TactileLabError, OSError) as error:
            return Ending.refused(str(error))
        except Exception as error:  # a protocol of the user's own may raise anything
            what = f"{type(error).__name__}: {error}"
            return Ending.refused(f"It broke before it began. {what}")
        with self._lock:
            self.task = task
            for act in self._said:
                act(task)
        if self._stopped is not None:  # before there was a task that could hear it
            task.stop(self._stopped)
        folder = getattr(task, "folder", None)
        magnet, coil = task.scene.bench.magnet, task.bench.coil
        self._tell(
            Begun(
                folder=None if folder is None else folder.path,
                limits=None if coil is None else coil.limits,
                newtons_per_ampere=magnet.newtons_per_ampere,
                critical_V_C1=task.scene.circuit.critical_V_C1,
                simulated=task.scene.bench.simulated,
                counted=task.counted,
                shortest_interval=shortest_interval(task.scene.circuit),
            )
        )
        return self._run(task)

    def _run(self, task: Task[Any]) -> Ending:
        over = threading.Event()
        beside = [start(lambda: self._tell_samples(task, over), "samples")]
        if self.model is not None:
            follow = self.model
            beside.append(start(lambda: self._tell_model(follow, task, over), "model"))
        try:
            ending: Ending = task.run()
        except BaseException as error:
            off = task.coil_state.off or OffReport(False, None, "not verified")
            what = f"It broke. {type(error).__name__}: {error}"
            ending = Ending(RunState.FAULTED, off, what)
        over.set()
        for thread in beside:
            thread.join()
        return ending

    def _tell_samples(self, task: Task[Any], over: threading.Event) -> None:
        """Tell samples and the coil's state as they come, to the very last."""
        live, seen, last, said = task.live, 0, None, 0.0
        ended = False
        while not ended:
            ended = over.wait(EVERY)
            coil = task.coil_state
            seen, bins = live.fresh(seen)
            late = time.monotonic() - said > AT_LEAST
            if bins or coil != last or late:
                self._tell(Samples(bins, coil))
                last, said = coil, time.monotonic()

    def _tell_model(
        self, model: LiveModel, task: Task[Any], over: threading.Event
    ) -> None:
        """Advance the model behind the samples, slice by slice, and to their end."""
        from tactile_lab.engine.model_parts import live_part

        ended = False
        while not ended:
            ended = over.wait(SLICE)
            part = live_part(model, task.live.reach - (0.0 if ended else BEHIND))
            if part is not None:
                self._tell(part)


def _reply(work: Callable[[], T]) -> Reply[T]:
    try:
        return Reply(work())
    except (TactileLabError, OSError) as error:
        return Reply(None, str(error))
    except Exception as error:  # code of the user's own may raise anything
        return Reply(None, f"It broke. {type(error).__name__}: {error}")


def main(pipe: Connection, realtime: bool = True) -> None:
    """Serve in a process of its own.

    Ctrl-C and a closed terminal reach the window too, which decides; SIGTERM ends as
    the window's end does.
    """
    for name in ("SIGINT", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _leave)
    share_heap()
    Engine(pipe, realtime=realtime, alone=True).serve()


def _leave(number: int, frame: object) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise EOFError
