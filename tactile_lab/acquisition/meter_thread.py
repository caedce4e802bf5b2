"""The teslameter's thread: a reading now and then, as fast as the meter allows."""

from __future__ import annotations

from collections import deque

from tactile_lab.acquisition.instrument_thread import InstrumentThread, drained
from tactile_lab.bench import FieldMeter, Reading
from tactile_lab.clock import Clock
from tactile_lab.errors import InstrumentError

READ_EVERY = 0.1
"""Seconds between readings."""


class MeterThread(InstrumentThread):
    """Owns the teslameter."""

    def __init__(self, meter: FieldMeter, clock: Clock) -> None:
        super().__init__("field meter", clock)
        self.meter = meter
        self._readings: deque[Reading] = deque()

    def take_readings(self) -> list[Reading]:
        """Readings since this was last asked; times on the bench's clock."""
        return drained(self._readings)

    def open(self) -> None:
        """Open the meter."""
        self.meter.open()
        self.settings = {"identity": self.meter.identity, **self.meter.settings()}

    def work(self) -> None:
        """Read until told to leave."""
        while not self._leaving:
            due = self.clock.now() + READ_EVERY
            self._readings.append(self.meter.read())
            self.clock.wait_for(lambda: self._leaving, due)

    def make_safe_and_close(self) -> None:
        """Close the meter."""
        try:
            if self.opened and self.failure is None:
                self.settings_after = self.meter.settings()
            self.meter.close()
        except InstrumentError as failure:
            self.failure = self.failure or failure
