"""Writes in a thread of its own, so that a slow disk does not hold up the loop."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import Literal

from tactile_lab.errors import RecordingError

QUEUE_BYTES = 128_000_000
"""Samples that may wait for the disk: 0.5 s at 4 x 31.25 MS/s."""

Write = Callable[[], None]
WhenFull = Literal["wait", "error"]


class WriteQueue:
    """Does what it is given, in order.

    Args:
        idle: done whenever nothing has come for `pause` s.
        pause: s.
        when_full: "wait" holds up the caller until there is room (simulated clock);
            "error" raises, because real time cannot wait.
        capacity: bytes that may wait.
    """

    def __init__(
        self,
        idle: Write,
        pause: float,
        *,
        when_full: WhenFull,
        capacity: int = QUEUE_BYTES,
    ) -> None:
        self._idle, self._pause = idle, pause
        self._waits = when_full == "wait"
        self._capacity = capacity
        self._writes: deque[tuple[Write, int]] = deque()
        self._bytes = 0
        self._changed = threading.Condition()
        self._failure: BaseException | None = None
        self._closing = False
        self._thread = threading.Thread(target=self._work, name="recorder", daemon=True)
        self._thread.start()

    def put(self, write: Write, size: int) -> None:
        """Have `write` done, for which `size` bytes wait.

        Raises:
            RecordingError: there is no room.
            BaseException: what an earlier write raised.
        """
        with self._changed:
            if self._waits:
                self._changed.wait_for(
                    lambda: self._fits(size) or self._failure is not None
                )
            if self._failure is not None:
                raise self._failure
            if not self._fits(size):
                raise RecordingError(
                    f"{self._bytes / 1e6:.0f} MB of samples wait for the disk (limit "
                    f"{self._capacity / 1e6:.0f} MB): it does not keep up. Lower "
                    "record.sample_rate, record fewer signals or use a faster disk."
                )
            self._writes.append((write, size))
            self._bytes += size
            self._changed.notify_all()

    def close(self) -> BaseException | None:
        """Do what waits and end the thread; what a write raised, if one did."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join()
        return self._failure

    def _fits(self, size: int) -> bool:
        # a lone block larger than the queue still has to pass
        return not self._writes or self._bytes + size <= self._capacity

    def _work(self) -> None:
        try:
            while (write := self._take()) is not None:
                write()
        except BaseException as failure:
            with self._changed:
                self._failure = failure
                self._writes.clear()
                self._changed.notify_all()

    def _take(self) -> Write | None:
        """The next thing to do; None once closed and empty."""
        with self._changed:
            self._changed.wait_for(lambda: self._writes or self._closing, self._pause)
            if self._writes:
                write, size = self._writes.popleft()
                self._bytes -= size
                self._changed.notify_all()
                return write
            return None if self._closing else self._idle
