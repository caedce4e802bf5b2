"""What the deciding loop writes down; the store implements it."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.scope import Block, Stream
from tactile_lab.trial import Outcome, Trial
from tactile_lab.voltage_source import HeldVoltage


class Journal(Protocol):
    """The record of one run, written as it happens; times on the run's axis, s."""

    def segment(self, stream: Stream, start: float) -> None:
        """A stream starts; its first sample is at `start` s on the run's axis."""
        ...

    def append(self, block: Block) -> None:
        """Store a block; waits or raises RecordingError when the queue is full."""
        ...

    def gap(self, missing: int) -> None:
        """A stream ended so many samples after the last that came."""
        return

    def spikes(self, times: FloatArray, found: NDArray[np.void]) -> None:
        """Store detected spikes with their times on the run's axis."""
        ...

    def current(
        self,
        time: float,
        setpoint: float,
        measured: float | None,
        ratio: float | None = None,
        *,
        listed: int = 0,
        asked: float | None = None,
        acted: float | None = None,
    ) -> None:
        """A set-point as applied, A; read-back and resistance over cold, if known.

        `listed`: 0, or for a point of a list what told when that began:
        `tactile_lab.store.applied.BY_SAMPLES` or `BY_HOST`. `asked`: when the source
        was told to, s; `acted`: when it is taken to have done so.
        """
        return

    def field(self, time: float, field: float) -> None:
        """A teslameter reading, T."""
        ...

    def temperature(self, time: float, kelvin: float) -> None:
        """A reading of the sensor's temperature, K."""
        return

    def voltage(self, name: str, held: HeldVoltage) -> None:
        """What the source of the circuit's voltage `name` was read back to hold."""
        return

    def align(self, *, offset: float, drift: float, uncertainty: float) -> None:
        """Correct the running segment's times by `offset` s and `drift` s/s."""
        return

    def event(self, time: float, kind: str, text: str) -> None:
        """Something happened."""
        ...

    def begun(self, index: int, trial: Trial, start: float) -> None:
        """Trial number `index` begins at `start` s; it may never end."""
        return

    def outcome(self, outcome: Outcome) -> None:
        """The trial that began last has ended."""
        return

    def pause(self, start: float, end: float) -> None:
        """A planned pause: nothing was streamed from `start` to `end` s; no gap."""
        return
