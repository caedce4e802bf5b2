"""The recorder in its own thread, so that a slow disk does not hold up the loop."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tactile_lab.bench import Block, Stream
from tactile_lab.errors import RecordingError
from tactile_lab.store.folder import RunFolder, Status
from tactile_lab.store.layout import Layout
from tactile_lab.store.recorder import CADENCE, Recorder
from tactile_lab.trial import Outcome

QUEUE_BYTES = 128_000_000
"""Samples that may wait for the disk: 0.5 s at 4 x 31.25 MS/s."""

RECORD_BYTES = 256
"""What a waiting record counts for."""


class RecorderThread:
    """Takes what `Recorder` takes, in order, and writes it in its own thread.

    Args:
        recorder: from now on used by this thread only.
        when_full: "wait" holds up the caller until there is room (simulated clock);
            "error" raises, because real time cannot wait.
        capacity: bytes that may wait.

    Raises:
        RecordingError: from every method: the queue is full, or writing has failed.
    """

    def __init__(
        self,
        recorder: Recorder,
        *,
        when_full: Literal["wait", "error"],
        capacity: int = QUEUE_BYTES,
    ) -> None:
        self._recorder = recorder
        self._waits = when_full == "wait"
        self._capacity = capacity
        self._queue: deque[tuple[Callable[[], None], int]] = deque()
        self._bytes = 0
        self._changed = threading.Condition()
        self._failure: BaseException | None = None
        self._closing = False
        self._queued = 0
        self._thread = threading.Thread(target=self._work, name="recorder", daemon=True)
        self._thread.start()

    @property
    def folder(self) -> RunFolder:
        """The run's folder."""
        return self._recorder.folder

    @property
    def layout(self) -> Layout:
        """What is stored."""
        return self._recorder.layout

    @property
    def waiting(self) -> float:
        """How full the queue is, 0 to 1."""
        return self._bytes / self._capacity

    @property
    def queued(self) -> int:
        """Samples per channel taken so far."""
        return self._queued

    def segment(self, stream: Stream, start: float) -> None:
        """See `Recorder.segment`."""
        self._put(partial(self._recorder.segment, stream, start))

    def append(self, block: Block) -> None:
        """See `Recorder.append`."""
        self._put(partial(self._recorder.append, block), block.codes.nbytes)
        self._queued += block.samples

    def gap(self, missing: int) -> None:
        """See `Recorder.gap`."""
        self._put(partial(self._recorder.gap, missing))

    def align(self, *, offset: float, drift: float, uncertainty: float) -> None:
        """See `Recorder.align`."""
        align = self._recorder.align
        self._put(partial(align, offset=offset, drift=drift, uncertainty=uncertainty))

    def spikes(self, times: NDArray[np.float64], found: NDArray[Any]) -> None:
        """See `Recorder.spikes`."""
        size = max(found.nbytes, RECORD_BYTES)
        self._put(partial(self._recorder.spikes, times, found), size)

    def current(
        self,
        time: float,
        setpoint: float,
        measured: float | None,
        ratio: float | None = None,
    ) -> None:
        """See `Recorder.current`."""
        self._put(partial(self._recorder.current, time, setpoint, measured, ratio))

    def field(self, time: float, field: float) -> None:
        """See `Recorder.field`."""
        self._put(partial(self._recorder.field, time, field))

    def event(self, time: float, kind: str, text: str) -> None:
        """See `Recorder.event`."""
        self._put(partial(self._recorder.event, time, kind, text))

    def outcome(self, outcome: Outcome) -> None:
        """See `Recorder.outcome`."""
        self._put(partial(self._recorder.outcome, outcome))

    def pause(self, start: float, end: float) -> None:
        """See `Recorder.pause`."""
        self._put(partial(self._recorder.pause, start, end))

    def close(
        self,
        status: Status,
        produced: Mapping[str, int] | int | None = None,
        **entries: Any,
    ) -> None:
        """Write all that waits, end the thread, close; see `Recorder.close`.

        A run whose recorder failed is closed as faulted, whatever `status` says, and
        the failure is raised.
        """
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join()
        if self._failure is not None:
            status = "faulted"
            entries.setdefault("reason", str(self._failure))
        self._recorder.close(status, produced, queued=self._queued, **entries)
        if self._failure is not None:
            raise self._failure

    def _put(self, write: Callable[[], None], size: int = RECORD_BYTES) -> None:
        with self._changed:
            # a lone block larger than the queue still has to pass
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
            self._queue.append((write, size))
            self._bytes += size
            self._changed.notify_all()

    def _fits(self, size: int) -> bool:
        return not self._queue or self._bytes + size <= self._capacity

    def _work(self) -> None:
        try:
            while (write := self._take()) is not None:
                write()
        except BaseException as failure:
            with self._changed:
                self._failure = failure
                self._queue.clear()
                self._changed.notify_all()

    def _take(self) -> Callable[[], None] | None:
        """The next thing to do; None once closed and empty."""
        with self._changed:
            self._changed.wait_for(lambda: self._queue or self._closing, CADENCE)
            if self._queue:
                write, size = self._queue.popleft()
                self._bytes -= size
                self._changed.notify_all()
                return write
            return None if self._closing else self._recorder.tick
