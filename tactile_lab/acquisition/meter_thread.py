"""The thread of a teslameter or thermometer: a reading now and then."""

from __future__ import annotations

from collections import deque

from tactile_lab.acquisition.instrument_thread import InstrumentThread, drained
from tactile_lab.bench import Meter, Reading
from tactile_lab.clock import Clock
from tactile_lab.errors import InstrumentError

READ_FIELD, READ_TEMPERATURE = 0.1, 0.5
"""Seconds between readings; a slower instrument gives them as fast as it can."""


class MeterThread(InstrumentThread):
    """Owns one instrument that reads one quantity.

    Args:
        name: of the instrument.
        meter: to read.
        clock: the bench's time.
        every: time between readings, s.
    """

    def __init__(self, name: str, meter: Meter, clock: Clock, every: float) -> None:
        super().__init__(name, clock)
        self.meter = meter
        self._every = every
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
            due = self.clock.now() + self._every
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
