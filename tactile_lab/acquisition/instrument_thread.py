"""A thread that alone touches one instrument, from opening it to closing it."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections import deque
from typing import TypeVar

from tactile_lab.clock import Clock
from tactile_lab.errors import TactileLabError

T = TypeVar("T")


def drained(queue: deque[T]) -> list[T]:
    """All that `queue` holds, taken out of it, while its instrument may add more.

    Items are taken one by one: a list swapped for a new one would lose what a thread,
    which still holds the old, is just about to add.
    """
    return [queue.popleft() for _ in range(len(queue))]


class InstrumentThread(ABC):
    """Runs `work` in its own thread, as a participant of the clock.

    Whatever goes wrong there is kept in `failure` for the deciding loop to raise; the
    instrument is closed on every way out.

    Attributes:
        settings: identity and settings read back as the run began.
        settings_after: settings read back as it ended; empty where that failed.
    """

    def __init__(self, name: str, clock: Clock) -> None:
        self.name = name
        self.clock = clock
        self.failure: BaseException | None = None
        self.opened = False
        self.settings: dict[str, str] = {}
        self.settings_after: dict[str, str] = {}
        self._leaving = False
        self._thread = threading.Thread(target=self._main, name=name, daemon=True)
        self.ended = False

    def start(self) -> None:
        """Start the thread; it opens its instrument at once."""
        self.clock.start(self._thread)

    @property
    def settled(self) -> bool:
        """Whether opening has come to an end, good or bad."""
        return self.opened or self.ended

    def leave(self) -> None:
        """Ask the thread to close its instrument and end."""
        self._leaving = True
        self.clock.notify()

    def join(self, timeout: float | None = None) -> bool:
        """Wait in real time until the thread has ended; whether it has."""
        if self._thread.ident is not None:
            self._thread.join(timeout)
        return not self._thread.is_alive()

    def raise_failure(self) -> None:
        """Raise here what went wrong there."""
        if self.failure is not None:
            raise self.failure

    def _main(self) -> None:
        with self.clock.taking_part(self.name):
            try:
                self.open()
                self.opened = True
                self.clock.notify()
                self.work()
            except (TactileLabError, OSError, ArithmeticError, ValueError) as failure:
                self.failure = failure
            except BaseException as failure:
                self.failure = failure
                raise
            finally:
                self.make_safe_and_close()
                self.ended = True
        self.clock.notify()

    @abstractmethod
    def open(self) -> None:
        """Open the instrument."""

    @abstractmethod
    def work(self) -> None:
        """Serve the instrument until asked to leave."""

    @abstractmethod
    def make_safe_and_close(self) -> None:
        """Leave the instrument safe and close it; failures go to `failure`."""
