"""What the deciding loop writes down; the store implements it."""

from __future__ import annotations

from typing import Protocol

from tactile_lab.acquisition.intake import Sink
from tactile_lab.trial import Outcome


class Journal(Sink, Protocol):
    """The record of one run, written as it happens; times on the run's axis, s."""

    def current(
        self,
        time: float,
        setpoint: float,
        measured: float | None,
        ratio: float | None = None,
    ) -> None:
        """A set-point as applied, A; read-back and resistance over cold, if known."""
        ...

    def field(self, time: float, field: float) -> None:
        """A teslameter reading, T."""
        ...

    def align(self, *, offset: float, drift: float, uncertainty: float) -> None:
        """Correct the running segment's times by `offset` s and `drift` s/s."""
        ...

    def event(self, time: float, kind: str, text: str) -> None:
        """Something happened."""
        ...

    def outcome(self, outcome: Outcome) -> None:
        """A trial ended."""
        ...

    def pause(self, start: float, end: float) -> None:
        """A planned pause: nothing was streamed from `start` to `end` s; no gap."""
        ...
