"""Using a bench from the terminal: signals end it safely, however often they come."""

from __future__ import annotations

import math
import os
import signal
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, suppress
from types import FrameType
from typing import TYPE_CHECKING, Any, TypeVar

import click

from tactile_lab.commands.terminal import ENDING, minded, warn

if TYPE_CHECKING:
    from tactile_lab.acquisition.ending import Ending
    from tactile_lab.engine.task import Task

INTERRUPTED = 130
"""Exit code of a program that was asked to end, by Ctrl-C or another program."""

STARTING = b"stopping before anything is opened; once more ends it at once\n"

OVERDUE = 5.0
"""Time after its coil was left by which a task has ended, usually, s."""

STUCK = (
    "The coil is left: {off} Its task has not ended in the {seconds:g} s since: a "
    "protocol, disk or scope does not come back, and is waited for. To end it at once, "
    "kill process {process} (kill -9); what was recorded is kept, and `tactile-lab "
    "recover` closes it."
)

E = TypeVar("E", bound="Ending")


def _nothing() -> None:
    return


class Signals:
    """Notes the signals that would end the program, from `with` on.

    A KeyboardInterrupt may be raised where it is swallowed, in a callback from C or in
    a user's file, and then the coil would be switched on all the same. What is noted is
    looked at between two steps; as one of them may compile for 20 s, a second signal
    ends the program at once as long as nothing is open.

    Args:
        acts: what signals of other names do while a task runs.

    Attributes:
        caught: their numbers, as they came.
        asked: reason of a stop that another program asked for; "" for none.
        ended: exit code of an end that a task was asked for; 0 for none. The task may
            have been complete already: what follows it is not begun all the same.
    """

    def __init__(self, acts: Mapping[str, Callable[[], None]] | None = None) -> None:
        self.caught: list[int] = []
        self.asked = ""
        self.ended = 0
        self.acts = acts or {}
        self.opened = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Signals:
        acts = [getattr(signal, name) for name in self.acts if hasattr(signal, name)]
        numbers = (*ENDING, *acts)
        self._before = {n: signal.signal(n, self._note) for n in numbers}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def ask(self, reason: str) -> None:
        """Another program wants what goes on ended, and nothing more begun."""
        self.asked = reason

    @property
    def ending(self) -> int:
        """128 and the signal that came, `INTERRUPTED` for a program; else 0."""
        if self.caught:
            return 128 + self.caught[0]
        return INTERRUPTED if self.asked else self.ended

    def look(self) -> None:
        """Leave the program if it is to end; nothing is open yet.

        Raises:
            click.exceptions.Exit: with the code of `ending`.
        """
        if self.ending:
            raise click.exceptions.Exit(self.ending)

    def _note(self, number: int, _: FrameType | None) -> None:
        self.caught.append(number)
        if self.opened or signal.Signals(number).name in self.acts:
            return
        if len(self.caught) > 1:
            os._exit(128 + self.caught[0])
        with suppress(OSError):
            os.write(2, STARTING)


def interrupted() -> AbstractContextManager[None]:
    """Within, each signal that ends a program raises KeyboardInterrupt."""
    return minded(dict.fromkeys(ENDING, signal.default_int_handler))


def run_attended(
    task: Task[E], signals: Signals, meanwhile: Callable[[], None] = _nothing
) -> E:
    """Run a task in a thread of its own while this one minds the signals.

    The first signal asks for a safe end, a second for one without ramp; no number of
    them ends the program before the coil's state has been verified or given up. Where
    `meanwhile` fails, because its terminal was closed, the task is ended as well.
    Where it does not end though the coil was left long ago, as a protocol may block,
    that is told, and how to end it.

    Args:
        task: about to run.
        signals: noted since before it was made; one that came already ends it before
            it opens anything.
        meanwhile: called every 50 ms.

    Raises:
        Exception: whatever the task raised.
    """
    ended: list[E] = []
    failed: list[BaseException] = []

    def mind() -> None:
        while signals.caught:
            number = signals.caught.pop(0)
            name = signal.Signals(number).name
            if name in signals.acts:
                signals.acts[name]()
            else:
                signals.ended = 128 + number
                task.stop(f"stopped by {name}", signal=number)
        if signals.asked:
            signals.ended = INTERRUPTED
            reason, signals.asked = signals.asked, ""
            task.stop(reason)

    def work() -> None:
        try:
            ended.append(task.run())
        except BaseException as error:
            failed.append(error)

    signals.opened = True
    mind()
    due = math.inf
    worker = threading.Thread(target=work, name="runner")
    worker.start()
    while worker.is_alive():
        worker.join(0.05)
        mind()
        if (off := task.coil_state.off) is None:
            due = time.monotonic() + OVERDUE
        elif time.monotonic() > due:
            warn(STUCK.format(off=off.text, seconds=OVERDUE, process=os.getpid()))
            due = math.inf
        try:
            meanwhile()
        except Exception as failure:
            task.stop(f"stopped as nobody watches any more: {failure}")
            meanwhile = _nothing
    if failed:
        raise failed[0]
    return ended[0]
