"""Asking a run to stop, and noticing that nobody is in charge any more."""

from __future__ import annotations

from dataclasses import dataclass

from tactile_lab.clock import Clock
from tactile_lab.errors import InterlockError

LEASE = 2.0
"""Seconds the coil stays live without a sign of life from the deciding loop."""


@dataclass
class StopRequest:
    """Set once, from any thread, never taken back.

    Attributes:
        reason: why, for a person; None while nobody asked.
        signal: number of the POSIX signal behind it, if one was.
    """

    clock: Clock
    reason: str | None = None
    signal: int | None = None

    @property
    def requested(self) -> bool:
        """Whether anybody asked to stop."""
        return self.reason is not None

    def __call__(self, reason: str, *, signal: int | None = None) -> None:
        """Ask to stop; the first who asks is remembered."""
        if self.reason is None:
            self.reason, self.signal = reason, signal
        self.clock.notify()


class Lease:
    """A sign of life, which the coil thread watches.

    Args:
        clock: of the coil.
        holder: who shows it, and where to look if he does not, for a person.
    """

    def __init__(
        self,
        clock: Clock,
        holder: tuple[str, str] = (
            "The deciding loop",
            "a stuck disk or scope, or for what the protocol does between two trials",
        ),
    ) -> None:
        self._clock = clock
        self._holder = holder
        self._until: float | None = None

    def renew(self) -> None:
        """Show life; the first renewal starts the lease."""
        self._until = self._clock.now() + LEASE

    def end(self) -> None:
        """Stop watching: the loop ended in good order."""
        self._until = None

    def check(self) -> None:
        """Nothing, as long as it holds.

        Raises:
            InterlockError: its holder has shown no life for longer than the lease.
        """
        if self._until is not None and self._clock.now() > self._until:
            who, where = self._holder
            raise InterlockError(
                f"{who} gave no sign of life for longer than its lease of "
                f"{LEASE:g} s; the coil was switched off. Look for {where}."
            )
