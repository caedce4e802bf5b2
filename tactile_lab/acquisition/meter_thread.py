"""The thread of a teslameter or thermometer: a reading now and then."""

from __future__ import annotations

import math
from collections import deque

from tactile_lab.acquisition.instrument_thread import InstrumentThread, drained
from tactile_lab.bench import Meter, Reading
from tactile_lab.clock import Clock
from tactile_lab.errors import InstrumentError
from tactile_lab.quantity import count, show

READ_FIELD, READ_TEMPERATURE = 0.1, 0.5
"""Seconds between readings; a slower instrument gives them as fast as it can."""


class MeterThread(InstrumentThread):
    """Owns one instrument that reads one quantity.

    Args:
        name: of the instrument.
        meter: to read.
        clock: the bench's time.
        every: time between readings, s.

    Attributes:
        undated: answers that were not kept: they took so much longer than others that
            nobody knows of which moment they are, as where the computer halted.
    """

    def __init__(self, name: str, meter: Meter, clock: Clock, every: float) -> None:
        super().__init__(name, clock)
        self.meter = meter
        self._every = every
        self.undated, self._least = 0, math.inf
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
            asked = self.clock.now()
            reading = self.meter.read()
            took = self.clock.now() - asked
            self._least = min(self._least, took)
            # of twice the time: a meter that changes its range is asked again
            if took > 2 * self._least + self._every:
                self.undated += 1
            else:
                self._readings.append(reading)
            self.clock.wait_for(lambda: self._leaving, asked + self._every)

    @property
    def doubt(self) -> str:
        """What is to be said of answers that were not kept; "" where all were."""
        if not self.undated:
            return ""
        return (
            f"{self.name}: {count(self.undated, 'answer')} took over "
            f"{show(2 * self._least + self._every, 's', 2)}, "
            f"others {show(self._least, 's', 2)}: nobody knows of which moment they "
            "are, and they are not kept. Relieve this computer, or check the link."
        )

    def make_safe_and_close(self) -> None:
        """Close the meter."""
        try:
            if self.opened and self.failure is None:
                self.settings_after = self.meter.settings()
            self.meter.close()
        except InstrumentError as failure:
            self.failure = self.failure or failure
