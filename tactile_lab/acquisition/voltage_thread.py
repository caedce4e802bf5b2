"""A voltage source's thread: ramps to what is wanted, and reads back what it holds.

A stop leaves it where it is until the coil is off; then it goes to rest.
"""

from __future__ import annotations

from collections import deque

from tactile_lab.acquisition.instrument_thread import InstrumentThread, drained
from tactile_lab.acquisition.stop import StopRequest
from tactile_lab.clock import Clock
from tactile_lab.errors import TactileLabError
from tactile_lab.voltage_source import HeldVoltage, RestReport, VoltageSource

READ_EVERY = 0.2
"""Seconds between readings."""

STEP_EVERY = 0.05
"""Seconds between two steps of a ramp."""


class VoltageThread(InstrumentThread):
    """Owns the source of one voltage.

    Attributes:
        wanted: what it is to hold, V; None before `hold`.
        left: how it was left; None while it is in use.
    """

    def __init__(
        self, voltage: str, source: VoltageSource, clock: Clock, stop: StopRequest
    ) -> None:
        super().__init__(f"source of {voltage}", clock)
        self.voltage, self.source, self._stop = voltage, source, stop
        self.left: RestReport | None = None
        self.wanted: float | None = None
        self._reached: float | None = None
        self._readings: deque[HeldVoltage] = deque()

    def hold(self, volts: float) -> None:
        """Have it go to `volts`, V, and stay there."""
        self.wanted = volts
        self.clock.notify()

    @property
    def stands(self) -> bool:
        """Whether its set-point is what is wanted."""
        return self.wanted is None or self._reached == self.wanted

    def take_readings(self) -> list[HeldVoltage]:
        """Readings since this was last asked; times on the bench's clock."""
        return drained(self._readings)

    def open(self) -> None:
        """Open the source; it holds what it held."""
        self.source.open()
        self.settings = self.source.settings()

    def work(self) -> None:
        """Hold what is wanted, and read it back, until told to leave."""
        while not self._leaving:
            began, wanted = self.clock.now(), self.wanted
            due = began + READ_EVERY
            if wanted is not None and wanted == self._reached:
                self._readings.append(self.source.read())
            elif wanted is not None and not self._stop.requested:
                if self.source.step_to(wanted):
                    self._reached = wanted
                    self.clock.notify()
                answered = self.clock.now()
                # a step is as large as the time since the answer before it allows
                due = max(began + STEP_EVERY, answered + (answered - began))
            self._rest_until(due, wanted)

    def make_safe_and_close(self) -> None:
        """Take it to rest and close it."""
        try:
            if self.opened and self.failure is None:
                self.settings_after = self.source.settings()
        except TactileLabError as failure:
            self.failure = failure
        self.left = self.source.go_to_rest()
        try:
            self.source.close()
        except TactileLabError as failure:
            self.failure = self.failure or failure

    def _rest_until(self, due: float, wanted: float | None) -> None:
        """Wait until clock time `due`, s, or until there is something else to do."""
        self.clock.wait_for(lambda: self._leaving or self.wanted != wanted, due)
