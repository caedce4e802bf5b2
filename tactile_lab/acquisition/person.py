"""Waiting for a person who must do or read something at the bench."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

from tactile_lab.errors import RefusedError, TactileLabError

PLACES = {
    "ground": "Put the probes of V_C1, V_C2 and V_K on the circuit's ground (0 V).",
    "supply": "Put the probes of V_C1, V_C2 and V_K on the supply V_S.",
    "circuit": "Put the probes of V_C1, V_C2 and V_K back on their nodes.",
}

Ask = Callable[[str], object]
"""Tells a person what to do and returns when it is done; raises if it will not be."""

Question = Callable[[str], str]
"""Asks a person and returns what was typed; raises if nothing will be."""

T = TypeVar("T")


class Prompt(Generic[T]):
    """One thing a person is asked for, in a thread of its own."""

    def __init__(self, work: Callable[[], T]) -> None:
        self._failure: Exception | None = None
        self._result: list[T] = []
        self._thread = threading.Thread(
            target=self._wait, args=(work,), name="person", daemon=True
        )
        self._thread.start()

    @property
    def ended(self) -> bool:
        """Whether the person is done, or will not do it."""
        return not self._thread.is_alive()

    def ended_within(self, seconds: float) -> bool:
        """Whether it ended, after waiting at most so long in real time."""
        self._thread.join(seconds)
        return self.ended

    def result(self) -> T:
        """What came of it, once it has ended.

        Raises:
            RefusedError: asking failed.
        """
        if isinstance(self._failure, TactileLabError):
            raise self._failure
        if self._failure is not None:
            raise RefusedError(f"Nobody could be asked: {self._failure}.") from (
                self._failure
            )
        return self._result[0]

    def _wait(self, work: Callable[[], T]) -> None:
        try:
            self._result.append(work())
        except Exception as failure:
            self._failure = failure
