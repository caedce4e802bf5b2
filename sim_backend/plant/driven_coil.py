"""A coil that a current source drives: what every simulated world has in common."""

from __future__ import annotations

import math
import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterable

from sim_backend.plant.electromagnet import Electromagnet
from tactile_lab.errors import ParameterError


class DrivenCoil(ABC):
    """Set-points and output of the source, current and voltage of the coil.

    Safe for all threads: one lock is around everything.

    Attributes:
        gain: current that the source adds for a voltage at its analogue input, A/V; 0
            where none is wired.
        lag: by which it follows that voltage, s.
    """

    def __init__(self, electromagnet: Electromagnet) -> None:
        self._lock = threading.Lock()
        self._electromagnet = electromagnet
        self._setpoint = 0.0
        self._on = False
        self.gain = 0.0
        self.lag = 0.0
        self._analogue = 0.0
        self._coming: deque[tuple[float, float]] = deque()

    def set_current(self, time: float, amperes: float) -> None:
        """Let the source's set-point be `amperes` from `time` s on.

        Raises:
            ParameterError: not finite.
        """
        if not math.isfinite(amperes):
            raise ParameterError(f"The set-point {amperes} A must be finite.")
        with self._lock:
            self._reach(time)
            self._setpoint = amperes
            self._command(time)

    def analogue_input(self, voltages: Iterable[tuple[float, float]]) -> None:
        """Voltages at the source's analogue input from now on: from when (s), and V.

        Those that were still to come are forgotten.
        """
        with self._lock:
            if self.gain:
                self._coming = deque((time + self.lag, v) for time, v in voltages)

    def _reach(self, time: float) -> None:
        """Let the voltages act that come until `time` s; called with the lock held."""
        while self._coming and self._coming[0][0] <= time:
            when, self._analogue = self._coming.popleft()
            self._command(when)

    def output(self, time: float, on: bool) -> None:
        """Switch the source's output at `time` s; off, it drives 0 A."""
        with self._lock:
            self._reach(time)
            self._on = on
            self._command(time)

    def coil_current(self, time: float) -> float:
        """Current through the coil at `time` s, A."""
        with self._lock:
            self._reach(time)
            return self._electromagnet.current(time)

    def coil_voltage(self, time: float) -> float:
        """Voltage at the coil's terminals at `time` s, V."""
        with self._lock:
            self._reach(time)
            return self._electromagnet.voltage(time)

    @abstractmethod
    def field(self, time: float) -> float:
        """Flux density at the probe at `time` s, T."""

    @property
    def _driven(self) -> float:
        """Current the source regulates to, A."""
        return self._setpoint + self.gain * self._analogue if self._on else 0.0

    @abstractmethod
    def _command(self, time: float) -> None:
        """Set-point or output changed at `time` s; called with the lock held."""
