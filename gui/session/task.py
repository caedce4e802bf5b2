"""What the engine does in a thread of its own until it ends or is stopped."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Protocol

from gui.session.messages import Gone, Told
from gui.session.threads import start


class Stoppable(Protocol):
    """What a STOP goes to; it returns at once."""

    def stop(self, reason: str) -> None:
        """Switch off and end."""
        ...


class Task(ABC):
    """A run, a watch, or a coil by hand.

    STOP reaches it from any thread without waiting, also before there is anything to
    stop. Whatever happens, the window hears `Gone` at the end.

    Args:
        name: of its thread.
        tell: tells the window, from any thread.
    """

    def __init__(self, name: str, tell: Callable[[Told], None]) -> None:
        self._name, self._tell = name, tell
        self._stops: Stoppable | None = None
        self._reason: str | None = None
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Start its thread."""
        self._thread = start(self._main, self._name)

    def stop(self, reason: str) -> None:
        """Switch off and end it; returns at once."""
        with self._lock:
            self._reason = self._reason or reason
            stops = self._stops
        if stops is not None:
            stops.stop(reason)

    @property
    def alive(self) -> bool:
        """Whether it has not ended yet."""
        return self._thread is not None and self._thread.is_alive()

    def join(self, timeout: float) -> None:
        """Wait for the end, at most `timeout` s."""
        if self._thread is not None:
            self._thread.join(timeout)

    def _stopped_by(self, stops: Stoppable) -> bool:
        """From now on STOP goes there; whether one has come before, which it gets."""
        with self._lock:
            self._stops = stops
            reason = self._reason
        if reason is not None:
            stops.stop(reason)
        return reason is not None

    @abstractmethod
    def _work(self) -> None:
        """Do it, to the end."""

    def _main(self) -> None:
        try:
            self._work()
        finally:
            self._tell(Gone())
