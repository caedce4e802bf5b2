"""Faults of a simulated PicoScope, and when they strike."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

Kind = Literal[
    "unplug",
    "silent",
    "stream_fails",
    "hang",
    "status",
    "gap",
    "late",
    "stall",
    "overrange",
    "supply_lost",
    "supply_connected",
    "undervoltage",
    "reset",
]


@dataclass(frozen=True, kw_only=True)
class ScopeFault:
    """One fault of the unit, struck once, when the first given condition holds.

    Kinds:
        unplug: the link is dead: every call answers NOT_RESPONDING.
        silent: the link is dead, but polls answer OK and bring nothing.
        stream_fails: streaming stops by itself: polls answer STREAMING_FAILED.
        hang: the call takes `duration` s, then the link is dead.
        status: the call answers `code`, `times` times, and does nothing.
        gap: the unit drops `samples` samples without a word.
        late: for `duration` s the newest `samples` samples do not come yet.
        stall: polls answer BUFFER_STALL.
        overrange: inputs `inputs` saturate for `duration` s.
        supply_lost, supply_connected, undervoltage: the power changes; the capture is
            aborted, and nothing works until the change is acknowledged.
        reset: the link is dead, but the unit can be opened again.

    Attributes:
        call: name of a function, with or without "ps3000a"; strikes as it is called.
        nth: which such call, from 1.
        time: clock time, s; strikes at the first call at or after it.
        sample: strikes once this many samples a channel were produced.
        code: PICO_STATUS for kind "status".
        times: how often, for kind "status".
        duration: s, for "hang", "late" and "overrange".
        samples: for "gap" and "late".
        inputs: for "overrange".
    """

    kind: Kind
    call: str | None = None
    nth: int = 1
    time: float | None = None
    sample: int | None = None
    code: int = 0
    times: int = 1
    duration: float = 5.0
    samples: int = 0
    inputs: tuple[str, ...] = ("A",)

    def due(self, call: str, count: int, now: float, produced: int) -> bool:
        """Whether it strikes at the `count`-th call of `call`, at `now` s."""
        if self.call is not None:
            wanted = self.call.removeprefix("ps3000a")
            return call.removeprefix("ps3000a") == wanted and count >= self.nth
        if self.time is not None:
            return now >= self.time
        return self.sample is not None and produced >= self.sample


@dataclass
class Schedule:
    """Faults that have not struck yet, and calls counted so far."""

    faults: list[ScopeFault] = field(default_factory=list)
    struck: list[ScopeFault] = field(default_factory=list)
    calls: dict[str, int] = field(default_factory=dict)

    def strike(self, call: str, now: float, produced: int) -> list[ScopeFault]:
        """Count a call and return the faults that strike at it."""
        count = self.calls[call] = self.calls.get(call, 0) + 1
        if not self.faults:
            return []
        due = [f for f in self.faults if f.due(call, count, now, produced)]
        for fault in due:
            self.faults.remove(fault)
        self.struck += due
        return due
