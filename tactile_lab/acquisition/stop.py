"""Asking a run to stop, and noticing that nobody is in charge any more."""

from __future__ import annotations

from dataclasses import dataclass

from tactile_lab.clock import Clock

LEASE = 2.0
"""Seconds the coil stays live without a sign of life from the deciding loop."""


@dataclass
class StopRequest:
    """Set once, from any thread, never taken back.

    Attributes:
        reason: why, for a person; None while nobody asked.
        signal: number of the POSIX signal behind it, if one was.
        hurry: switch off at once, without the ramp (a second Ctrl-C).
    """

    clock: Clock
    reason: str | None = None
    signal: int | None = None
    hurry: bool = False

    @property
    def requested(self) -> bool:
        """Whether anybody asked to stop."""
        return self.reason is not None

    def __call__(self, reason: str, *, signal: int | None = None) -> None:
        """Ask to stop; asking again means hurry."""
        if self.reason is None:
            self.reason, self.signal = reason, signal
        else:
            self.hurry = True
        self.clock.notify()


class Lease:
    """The deciding loop's sign of life, which the coil thread watches."""

    def __init__(self, clock: Clock, length: float = LEASE) -> None:
        self._clock = clock
        self._length = length
        self._until: float | None = None

    def renew(self) -> None:
        """Show life; the first renewal starts the lease."""
        self._until = self._clock.now() + self._length

    def end(self) -> None:
        """Stop watching: the loop ended in good order."""
        self._until = None

    @property
    def expired(self) -> bool:
        """Whether the loop has shown no life for longer than the lease."""
        return self._until is not None and self._clock.now() > self._until
