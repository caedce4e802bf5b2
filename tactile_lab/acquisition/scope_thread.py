"""The scope's thread: polls the stream and hands over every block, in order."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from tactile_lab.acquisition.instrument_thread import InstrumentThread, drained
from tactile_lab.clock import Clock
from tactile_lab.errors import InstrumentError, RecordingError
from tactile_lab.scope import CLOCK_ERROR, Block, Channel, Scope, Stream

QUEUE = 256
"""Blocks that may wait for the deciding loop."""

LATE = 1.0
"""How long to wait for what was sampled before a stream is to end, s."""


class ScopeThread(InstrumentThread):
    """Owns the scope.

    The queue to the deciding loop is bounded. When it is full, real time cannot wait,
    so the run stops with an error and keeps what it has; the simulated clock waits.
    """

    def __init__(self, scope: Scope, clock: Clock) -> None:
        super().__init__("scope", clock)
        self.scope = scope
        self.stream: Stream | None = None
        self.polled_until = float("-inf")
        self._queue: deque[Block] = deque()
        self._wanted: tuple[tuple[Channel, ...], float] | None = None
        self._halt = False
        self._due: float | None = None
        self._lag = self._reached = math.inf
        self._jobs: deque[Callable[[], None]] = deque()
        self.before_close: Callable[[], None] | None = None

    def do(self, job: Callable[[], None]) -> None:
        """Ask for `job` to be done in the scope's thread, between two polls."""
        self._jobs.append(job)
        self.clock.notify()

    def stream_from(self, channels: Sequence[Channel], interval: float) -> None:
        """Ask for a stream; `stream` is set once it runs."""
        self._wanted = (tuple(channels), interval)
        self.clock.notify()

    def halt(self) -> None:
        """Ask for the stream to stop; `stream` is None once it has."""
        self._halt = True
        self.clock.notify()

    def poll_at(self, when: float) -> None:
        """Ask for one poll exactly at clock time `when`, s, beside the regular ones."""
        self._due = when
        self.clock.notify()

    def take(self) -> Block | None:
        """The oldest block not taken yet."""
        block = self._queue.popleft() if self._queue else None
        if block is not None and len(self._queue) == QUEUE - 1:
            self.clock.notify()
        return block

    @property
    def silent(self) -> float:
        """Time since its driver last came back from a poll, s; 0 where none is due."""
        stream = self.stream
        if stream is None or not stream.gapless:  # a whole record may take long
            return 0.0
        return self.clock.now() - max(self.polled_until, stream.started)

    @property
    def waiting(self) -> int:
        """Blocks not taken yet."""
        return len(self._queue)

    @property
    def ahead(self) -> int:
        """Samples per channel not taken yet."""
        return sum(block.samples for block in tuple(self._queue))

    def look_ahead(self, row: int) -> NDArray[np.int16]:
        """A copy of the codes in one row of all blocks not taken yet."""
        return np.concatenate([block.codes[row] for block in tuple(self._queue)])

    def open(self) -> None:
        """Open the scope."""
        self.scope.open()
        self.settings = {"identity": self.scope.identity, **self.scope.settings()}

    def work(self) -> None:
        """Poll while a stream runs, until told to leave."""
        poll = 0.0
        while not self._leaving:
            now = self.clock.now()
            if self._halt:
                self.end_stream()
            for job in drained(self._jobs):
                job()
                self.clock.notify()
            if self._wanted is not None and self.stream is None:
                self.stream = self.scope.start(*self._wanted)
                self.settings.update(self.scope.settings())
                self._wanted, self._lag = None, math.inf
                self._reached = self.stream.started
                self.clock.notify()
                poll = self.clock.now() + self.scope.poll_interval
            due = self._due is not None and now >= self._due
            if self.stream is not None and (due or now >= poll):
                self._poll()
                if due:
                    self._due = None
                if now >= poll:
                    poll = now + self.scope.poll_interval
            self.clock.wait_for(self._called, self._wake(poll))
        if self.stream is not None:
            self._poll_last(self.stream)

    def make_safe_and_close(self) -> None:
        """Stop the stream and close."""
        try:
            try:
                if self.before_close is not None and self.opened:
                    self.before_close()
                self.scope.stop()
                if self.opened and self.failure is None:
                    self.settings_after = self.scope.settings()
            finally:
                self.scope.close()
        except InstrumentError as failure:
            self.failure = self.failure or failure
        self.stream = None

    def _called(self) -> bool:
        if self._leaving or self._halt or self._jobs:
            return True
        if self._wanted is not None and self.stream is None:
            return True
        return self._due is not None and self._due <= self.clock.now()

    def _wake(self, poll: float) -> float | None:
        if self.stream is None:
            return None
        return poll if self._due is None else min(poll, self._due)

    def end_stream(self, *, at_once: bool = False) -> None:
        """Hand over the last samples and stop; only in the scope's thread.

        Args:
            at_once: without those that are late.
        """
        if self.stream is not None:
            if at_once:
                self._poll()
            else:
                self._poll_last(self.stream)
            self.scope.stop()
        self.stream, self._halt, self._due = None, False, None
        self.clock.notify()

    def _poll_last(self, stream: Stream) -> None:
        """Poll until all that was sampled by now has come, however late it is.

        A scope that stops drops what it still holds, and no count would tell of it.
        """
        asked = self.clock.now()
        lag = self._lag + CLOCK_ERROR * (asked - self._reached) + stream.interval
        self._poll()
        while stream.gapless and self._reached < asked - lag and not self._jobs:
            if self.clock.now() >= asked + LATE:
                return  # the stop tells what is missing
            self.clock.sleep_until(self.clock.now() + self.scope.poll_interval)
            self._poll()

    def _poll(self) -> None:
        asked = self.clock.now()
        block = self.scope.poll()
        if block is not None:
            self._note_lag(block)
            self._hand_over(block)
        self.polled_until = asked
        self.clock.notify()

    def _note_lag(self, block: Block) -> None:
        """Follow the least lag of the samples, as far as two clocks may part."""
        if self.stream is None:
            return
        before = self._reached
        self._reached = (
            self.stream.started + (block.first + block.samples) * self.stream.interval
        )
        parted = CLOCK_ERROR * (self._reached - before)
        self._lag = min(self._lag + parted, block.received - self._reached)

    def _hand_over(self, block: Block) -> None:
        if len(self._queue) >= QUEUE:
            if not self.clock.simulated:
                raise RecordingError(
                    f"{QUEUE} blocks of samples wait to be processed: this "
                    "computer does not keep up with the sample rate. Lower "
                    "record.sample_rate or record fewer channels."
                )
            self.clock.wait_for(lambda: self._leaving or len(self._queue) < QUEUE)
        self._queue.append(block)
