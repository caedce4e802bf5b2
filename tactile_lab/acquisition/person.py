"""Waiting for a person who must do something at the bench before a trial."""

from __future__ import annotations

import threading
from collections.abc import Callable

from tactile_lab.errors import RefusedError

PLACES = {
    "ground": "Put the probes of V_C1, V_C2 and V_K on the circuit's ground (0 V).",
    "supply": "Put the probes of V_C1, V_C2 and V_K on the supply V_S.",
    "circuit": "Put the probes of V_C1, V_C2 and V_K back on their nodes.",
}

Ask = Callable[[str], None]
"""Tells a person what to do and returns when it is done; raises if it will not be."""


class Errand:
    """One thing a person is asked to do, in a thread of its own.

    Args:
        ask: tells the person and waits.
        text: what to do.
    """

    def __init__(self, ask: Ask, text: str) -> None:
        self._failure: Exception | None = None
        self._thread = threading.Thread(
            target=self._wait, args=(ask, text), name="person", daemon=True
        )
        self._thread.start()

    @property
    def ended(self) -> bool:
        """Whether the person is done, or will not do it."""
        return not self._thread.is_alive()

    def check(self) -> None:
        """Say so where it was not done.

        Raises:
            RefusedError: asking failed.
        """
        if self._failure is not None:
            raise RefusedError(f"Nobody could be asked: {self._failure}.") from (
                self._failure
            )

    def _wait(self, ask: Ask, text: str) -> None:
        try:
            ask(text)
        except Exception as failure:
            self._failure = failure
