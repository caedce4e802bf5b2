"""Using a bench from the terminal: signals end it safely, however often they come."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from tactile_lab.acquisition.ending import Ending
    from tactile_lab.engine.task import Task

ENDING = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")

E = TypeVar("E", bound="Ending")


def _nothing() -> None:
    return


@contextmanager
def interrupted() -> Iterator[None]:
    """Within, each signal that ends a program raises KeyboardInterrupt."""
    numbers = [getattr(signal, n) for n in ENDING if hasattr(signal, n)]
    before = {n: signal.signal(n, signal.default_int_handler) for n in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def run_attended(
    task: Task[E],
    meanwhile: Callable[[], None] = _nothing,
    acts: Mapping[str, Callable[[], None]] | None = None,
) -> E:
    """Run a task in a thread of its own while this one minds the signals.

    The first signal asks for a safe end, a second for one without ramp; no number of
    them ends the program before the coil's state has been verified or given up. Where
    `meanwhile` fails, because its terminal was closed, the task is ended as well.

    Args:
        task: about to run.
        meanwhile: called every 50 ms.
        acts: what signals of other names do.

    Raises:
        Exception: whatever the task raised.
    """
    ended: list[E] = []
    failed: list[BaseException] = []

    def work() -> None:
        try:
            ended.append(task.run())
        except BaseException as error:
            failed.append(error)

    worker = threading.Thread(target=work, name="runner")
    caught: list[int] = []
    acts = acts or {}
    numbers = [getattr(signal, n) for n in (*ENDING, *acts) if hasattr(signal, n)]
    before = {n: signal.signal(n, lambda got, _: caught.append(got)) for n in numbers}
    try:
        worker.start()
        while worker.is_alive():
            worker.join(0.05)
            while caught:
                number = caught.pop(0)
                name = signal.Signals(number).name
                if name in acts:
                    acts[name]()
                else:
                    task.stop(f"stopped by {name}", signal=number)
            try:
                meanwhile()
            except Exception as failure:
                task.stop(f"stopped as nobody watches any more: {failure}")
                meanwhile = _nothing
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if failed:
        raise failed[0]
    return ended[0]
