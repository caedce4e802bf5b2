"""Time is injected: a real clock for instruments, a computed one for simulations.

Threads that act in time *take part* in a clock (``with clock.taking_part("scope")``)
and block only through it. On the simulated clock one taking-part thread runs at a
time and time jumps to the next wake-up when all of them wait, so a simulation runs as
fast as it computes and repeats exactly, however the operating system schedules.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Protocol
from weakref import WeakSet

Predicate = Callable[[], bool]

WITH_SLEEP: int | None = getattr(time, "CLOCK_BOOTTIME", None)
"""Linux's clock that goes on while the computer sleeps: `time.monotonic` stops."""


def steady() -> float:
    """Time by a clock that nobody sets, s; where the system has it, sleep included."""
    return time.monotonic() if WITH_SLEEP is None else time.clock_gettime(WITH_SLEEP)


class Clock(Protocol):
    """What every thread that acts in time may ask of time."""

    @property
    def simulated(self) -> bool:
        """Whether time is computed rather than lived through."""
        ...

    def now(self) -> float:
        """Seconds since the clock was made."""
        ...

    def sleep_until(self, when: float) -> None:
        """Return at `when` s (at once if that is past)."""
        ...

    def wait_for(self, ready: Predicate, until: float | None = None) -> bool:
        """Wait until `ready()` is true or the clock shows `until` s; return `ready()`.

        `ready` must be quick and free of side effects; it is asked again after each
        `notify` and, on the simulated clock, whenever another thread has run.
        """
        ...

    def notify(self) -> None:
        """Have all waiting threads ask their predicate again (from any thread)."""
        ...

    @contextmanager
    def taking_part(self, name: str) -> Iterator[None]:
        """Take part in this clock from the calling thread for the block's length."""
        ...

    def start(self, thread: threading.Thread) -> None:
        """Start a thread that takes part; time does not pass before it does."""
        ...


class RealClock:
    """Time of this computer that nobody sets; what it slept through has passed.

    So a run notices that its current stood meanwhile, and ends.
    """

    simulated = False

    def __init__(self) -> None:
        self._origin = steady()
        self._changed = threading.Condition()

    def now(self) -> float:
        """Seconds since the clock was made."""
        return steady() - self._origin

    def sleep_until(self, when: float) -> None:
        """Return at `when` s."""
        remaining = when - self.now()
        if remaining > 0:
            time.sleep(remaining)

    def wait_for(self, ready: Predicate, until: float | None = None) -> bool:
        """Wait for `ready()`, at most until the clock shows `until` s."""
        with self._changed:
            timeout = None if until is None else max(0.0, until - self.now())
            return self._changed.wait_for(ready, timeout)

    def notify(self) -> None:
        """Have all waiting threads ask their predicate again."""
        with self._changed:
            self._changed.notify_all()

    @contextmanager
    def taking_part(self, name: str) -> Iterator[None]:
        """Real threads need no turn: time passes for all of them."""
        yield

    def start(self, thread: threading.Thread) -> None:
        """Start a thread."""
        thread.start()


@dataclass(eq=False)
class _Participant:
    name: str
    turn: threading.Condition
    wake: float | None = None
    ready: Predicate | None = None
    waiting: bool = False
    runs: bool = False


@dataclass
class SimulatedClock:
    """Time that passes only when every taking-part thread waits.

    The turn goes to the first participant (in joining order) whose predicate holds,
    else to the earliest wake-up; ties go to the one that joined first. A thread that
    holds the turn may block on real things (a full queue): then simulated time waits.
    Threads that do not take part may call `now` and `notify`, and `wait_for`, which
    then waits in real time for what the others do.
    """

    simulated = True
    _now: float = 0.0
    _lock: threading.RLock = field(default_factory=threading.RLock)
    _participants: list[_Participant] = field(default_factory=list)
    _running: _Participant | None = None
    _mine: threading.local = field(default_factory=threading.local)
    _outside: threading.Condition = field(init=False)
    _joined: WeakSet[threading.Thread] = field(default_factory=WeakSet)

    def __post_init__(self) -> None:
        self._outside = threading.Condition(self._lock)

    def now(self) -> float:
        """Simulated seconds since the start."""
        return self._now

    def sleep_until(self, when: float) -> None:
        """Give the turn away until `when` s."""
        if when > self._now:
            self._wait(when, None)

    def wait_for(self, ready: Predicate, until: float | None = None) -> bool:
        """Give the turn away until `ready()` or until `until` s."""
        if ready():
            return True
        if until is not None and until <= self._now:
            return False
        if getattr(self._mine, "participant", None) is None:
            with self._outside:
                self._outside.wait_for(
                    lambda: ready() or (until is not None and until <= self._now)
                )
            return ready()
        self._wait(until, ready)
        return ready()

    def notify(self) -> None:
        """Have waiting threads ask again; starts the turn if nobody holds it."""
        with self._lock:
            self._outside.notify_all()
            if self._running is None:
                self._pass_turn()

    @contextmanager
    def taking_part(self, name: str) -> Iterator[None]:
        """Join, get the turn when it comes, leave at the end of the block."""
        me = _Participant(name, threading.Condition(self._lock))
        if getattr(self._mine, "participant", None) is not None:
            raise RuntimeError(f"This thread takes part already; {name} may not nest.")
        self._mine.participant = me
        with self._lock:
            self._participants.append(me)
            me.waiting, me.wake = True, self._now
            self._joined.add(threading.current_thread())
            self._outside.notify_all()
            if self._running is None:
                self._pass_turn()
            me.turn.wait_for(lambda: me.runs)
        try:
            yield
        finally:
            self._mine.participant = None
            with self._lock:
                self._participants.remove(me)
                self._running = None
                self._pass_turn()

    def start(self, thread: threading.Thread) -> None:
        """Start a thread that takes part, and return once it has joined.

        On a busy computer it may come to that late: waiting for nobody yet, time would
        jump past whatever it was started for.
        """
        thread.start()
        with self._outside:
            self._outside.wait_for(lambda: thread in self._joined)

    def _wait(self, wake: float | None, ready: Predicate | None) -> None:
        me: _Participant | None = getattr(self._mine, "participant", None)
        if me is None:
            raise RuntimeError("Only a thread that takes part may wait for a time.")
        with self._lock:
            me.waiting, me.runs, me.wake, me.ready = True, False, wake, ready
            self._running = None
            self._pass_turn()
            me.turn.wait_for(lambda: me.runs)

    def _pass_turn(self) -> None:
        """Choose who runs next; called with the lock held and nobody running."""
        self._outside.notify_all()
        waiting = [p for p in self._participants if p.waiting]
        chosen = next((p for p in waiting if p.ready is not None and p.ready()), None)
        if chosen is None:
            timed = [(p.wake, p) for p in waiting if p.wake is not None]
            if not timed:
                return
            wake, chosen = min(timed, key=lambda one: one[0])
            self._now = max(self._now, wake)
        chosen.waiting, chosen.wake, chosen.ready = False, None, None
        chosen.runs = True
        self._running = chosen
        chosen.turn.notify_all()
