"""When an instrument or a task was heard last, and whether its word is overdue."""

from __future__ import annotations

from time import monotonic

DUE = 1.0
"""Silence, s, up to which the last word of an instrument says how it is now."""


class Heard:
    """Words of a task, or of one instrument while a task uses it, from its first on.

    One that is slow, as a scope that reads records is, has been silent before: its
    word is overdue after twice its longest silence so far.

    Attributes:
        pauses: as planned, and is not due to say anything.
    """

    def __init__(self) -> None:
        self._last = monotonic()
        self._longest = 0.0
        self.pauses = False

    def pause(self) -> None:
        """Nothing is due from it until it goes on."""
        self.pauses = True

    def go_on(self) -> None:
        """Its next word is due: how long the pause was says nothing of it."""
        self.pauses = False
        self._last = monotonic()

    def word(self) -> None:
        """It said something again just now."""
        if not self.pauses:
            self._longest = max(self._longest, self.silent)
        self._last = monotonic()

    @property
    def silent(self) -> float:
        """How long it has said nothing, s."""
        return monotonic() - self._last

    @property
    def overdue(self) -> bool:
        """Whether its last word does not say any more how it is."""
        return not self.pauses and self.silent > max(DUE, 2 * self._longest)
