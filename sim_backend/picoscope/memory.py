"""Block mode of a simulated PicoScope: its timebases, its memory, one capture."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sim_backend.picoscope.codes import (
    BUSY,
    FULL_SCALE,
    INVALID_CHANNEL,
    INVALID_PARAMETER,
    INVALID_TIMEBASE,
    OK,
    SHIFT,
    TOO_MANY_SAMPLES,
)
from sim_backend.plant.scope_source import Acquisition, Codes, Input, SampleSource
from sim_backend.usbtmc.triggered_record import Edge, TriggeredRecord
from tactile_lab.clock import Clock

_RISING, _FALLING = 2, 3


@dataclass(frozen=True)
class SimpleTrigger:
    """Arguments of ps3000aSetSimpleTrigger."""

    channel: int
    threshold: int
    direction: int
    automatic: float


class Memory:
    """What block mode stores.

    Args:
        samples: capacity shared by the enabled inputs.
    """

    def __init__(self, source: SampleSource, clock: Clock, samples: int) -> None:
        self.trigger: SimpleTrigger | None = None
        self.segments = 1
        self._source = source
        self._clock = clock
        self._samples = samples
        self._record: TriggeredRecord | None = None
        self._numbers: tuple[int, ...] = ()

    def set_trigger(
        self, enabled: bool, channel: int, threshold: int, direction: int, auto_ms: int
    ) -> int:
        """Set or switch off the simple edge trigger."""
        if not enabled:
            self.trigger = None
            return OK
        if direction not in (_RISING, _FALLING):
            return INVALID_PARAMETER
        automatic = auto_ms / 1e3 if auto_ms else math.inf
        self.trigger = SimpleTrigger(channel, threshold, direction, automatic)
        return OK

    def capacity(self, inputs: int) -> int:
        """Samples per input in one segment."""
        shared = 1 << (max(inputs, 1) - 1).bit_length()
        return self._samples // shared // self.segments

    def interval(self, timebase: int, inputs: int) -> float | None:
        """Sample interval of a timebase, s; None where it is too fast."""
        fastest = (inputs - 1).bit_length() if inputs else 0
        if timebase < fastest:
            return None
        return 2.0**timebase / 1e9 if timebase < 3 else (timebase - 2) / 125e6

    def run(
        self, settings: Mapping[int, Input], before: int, after: int, timebase: int
    ) -> int:
        """Arm one capture."""
        interval = self.interval(timebase, len(settings))
        if interval is None:
            return INVALID_TIMEBASE
        if before + after > self.capacity(len(settings)):
            return TOO_MANY_SAMPLES
        if before + after <= 0:
            return INVALID_PARAMETER
        self._numbers = tuple(sorted(settings))
        inputs = tuple(settings[number] for number in self._numbers)
        edge: Edge | None = None
        forced: int | None = before
        if self.trigger is not None:
            if self.trigger.channel not in settings:
                return INVALID_CHANNEL
            row = self._numbers.index(self.trigger.channel)
            rising = self.trigger.direction == _RISING
            edge = Edge(row, self.trigger.threshold, rising)
            wait = self.trigger.automatic / interval
            forced = before + int(wait) if math.isfinite(wait) else None
        now = self._clock.now()
        acquisition = Acquisition(inputs, interval, now, FULL_SCALE, SHIFT)
        self._record = TriggeredRecord(
            self._source, acquisition,
            before=before, after=after, edge=edge, forced_at=forced,
        )  # fmt: skip
        return OK

    def ready(self) -> bool:
        """Whether the capture is complete by now."""
        record = self._record
        if record is None:
            return False
        elapsed = self._clock.now() - record.acquisition.started
        return record.advance(math.floor(elapsed / record.acquisition.interval + 1e-6))

    def values(self) -> tuple[int, dict[int, Codes], int]:
        """Status, codes by input number, and overflow bits."""
        if self._record is None or not self.ready():
            return BUSY, {}, 0
        codes, over = self._record.codes()
        rows = {n: np.ascontiguousarray(codes[i]) for i, n in enumerate(self._numbers)}
        bits = sum(1 << n for n, o in zip(self._numbers, over, strict=True) if o)
        return OK, rows, bits

    def forget(self) -> None:
        """Abort the capture."""
        self._record = None
