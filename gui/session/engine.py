"""The engine: the process that drives benches and solves models for the window.

In a process of its own nothing it does takes time from a frame, and a window that dies
takes no run with it: when the pipe's other end is gone, each run is stopped, its coil
verified off and its record completed, before the process ends.

It knows no Qt. Commands come through one pipe and are never waited on: a STOP is read
at once and goes straight to the coil's thread.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING

from gui.session.checking import check_bench
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
from gui.session.hand import Hand, read_field
from gui.session.looking import Looking
from gui.session.messages import Fitted, Planned, Told, Twins, TwinSeen
from gui.session.request import Request
from gui.session.running import Running
from gui.session.task import Task
from gui.session.threads import start
from tactile_lab.errors import TactileLabError

if TYPE_CHECKING:
    from gui.session.whole_twin import WholeTwin

LEAVE = 60.0
"""Longest wait for runs to end after the window has gone, s."""


class Engine:
    """Serves one window.

    Args:
        pipe: to the window.
        realtime: pace a simulated bench by the wall clock.
    """

    def __init__(self, pipe: Connection, *, realtime: bool = True) -> None:
        self._pipe, self._realtime = pipe, realtime
        self._sending = threading.Lock()
        self._runs: dict[int, Task] = {}
        self._twin: WholeTwin | None = None
        self._solving = threading.Lock()

    def serve(self) -> None:
        """Do what is asked until the window has gone; then leave every coil off."""
        try:
            while not isinstance(command := self._pipe.recv(), Leave):
                self._do(command)
        except (EOFError, OSError):
            pass
        finally:
            self._end()

    def _end(self) -> None:
        for run in self._runs.values():
            run.stop("The window has gone")
        for run in self._runs.values():
            run.join(LEAVE)
        self._pipe.close()

    def _do(self, command: Command) -> None:
        match command:
            case StartRun(run=number):
                tell = self._teller(number)
                self._begin(number, Running(command, tell, realtime=self._realtime))
            case StartWatch(run=number):
                self._begin(number, Looking(command, self._teller(number)))
            case RecordWatch(run=number):
                watch = self._runs.get(number)
                if isinstance(watch, Looking):
                    watch.record(command)
            case StopRun(run=number, reason=reason):
                if number in self._runs:
                    self._runs[number].stop(reason)
            case TakeNote(run=number, text=text, time=at):
                if isinstance(run := self._runs.get(number), Running):
                    run.note(text, at)
            case ErrandDone(run=number, answer=answer):
                if isinstance(run := self._runs.get(number), Running):
                    run.errand_done(answer)
            case TakeCoil(run=number):
                self._begin(number, Hand(command, self._teller(number)))
            case SetCoil(run=number, current=current):
                if isinstance(hand := self._runs.get(number), Hand):
                    hand.hold(current)
            case RenewLease(run=number):
                if isinstance(hand := self._runs.get(number), Hand):
                    hand.renew()
            case ReadField(run=number, request=request):
                found = self._runs.get(number)
                held = found if isinstance(found, Hand) else None
                start(lambda: self.tell(0, read_field(request, held)), "read field")
            case MakePlan(serial=serial, request=request):
                start(lambda: self.tell(0, _planned(serial, request)), "plan")
            case CheckBench(request=request):
                start(lambda: self._check(request), "check")
            case FitSteps():
                start(lambda: self.tell(0, _fitted(command)), "fit")
            case MakeTwin(folder=folder) | LookAtTwin(folder=folder):
                start(lambda: self._tell_twin(command, folder), "twin of a run")

    def _begin(self, number: int, run: Task) -> None:
        self._runs = {n: r for n, r in self._runs.items() if r.alive}
        self._runs[number] = run
        run.start()

    def _check(self, request: Request) -> None:
        self.tell(0, check_bench(request, realtime=self._realtime))

    def _tell_twin(self, asked: MakeTwin | LookAtTwin, folder: Path) -> None:
        """Solve the model beside a run, unless it was the last; tell what is asked."""
        try:
            with self._solving:
                twin = self._twin
                if twin is None or twin.folder != folder:
                    from gui.session.whole_twin import WholeTwin

                    self._twin = twin = WholeTwin(folder)
            if isinstance(asked, MakeTwin):
                told: Told = Twins(folder, twin.whole(), "")
            else:
                part = twin.part(asked.start, asked.end, asked.bins)
                told = TwinSeen(folder, part)
        except (TactileLabError, OSError) as error:
            told = Twins(folder, None, f"No model beside {folder.name}: {error}")
        self.tell(0, told)

    def _teller(self, number: int) -> Callable[[Told], None]:
        return lambda told: self.tell(number, told)

    def tell(self, number: int, told: Told) -> None:
        """Tell the window; run 0 is none. A window that has gone hears nothing."""
        with self._sending:
            try:
                self._pipe.send((number, told))
            except OSError:
                pass  # `serve` sees the end of the pipe and stops every run


def main(pipe: Connection, realtime: bool = True) -> None:
    """Serve in a process of its own.

    Ctrl-C and a closed terminal reach the window too, which decides; SIGTERM ends as
    the window's end does.
    """
    for name in ("SIGINT", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _leave)
    Engine(pipe, realtime=realtime).serve()


def _leave(number: int, frame: object) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise EOFError


def _fitted(asked: FitSteps) -> Fitted:
    from gui.session.fit import fit

    try:
        return Fitted(asked.serial, fit(asked.steps, asked.seen))
    except (TactileLabError, ValueError, ArithmeticError):
        return Fitted(asked.serial, None)


def _planned(serial: int, request: Request) -> Planned:
    from gui.session.expect import expect

    found = None
    try:
        found, problem = expect(request.load()), ""
    except (TactileLabError, OSError) as error:
        problem = str(error)
    except Exception as error:  # a protocol of the user's own may raise anything
        problem = f"The plan broke: {type(error).__name__}: {error}"
    return Planned(serial, request, found, problem)
