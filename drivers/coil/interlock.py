"""The interlock of a coil source: everything that may trip it, and the latch."""

from __future__ import annotations

import math
from collections.abc import Callable

from drivers.coil.guard import Watch
from drivers.coil.supervision import (
    THERMOMETER_CURRENT,
    HeatBudget,
    ReadbackCheck,
    Thermometer,
)
from tactile_lab.bench import CoilLimits
from tactile_lab.errors import InterlockError

STEADY = 0.1
"""Time after a change of the set-point from which read-back must agree, s."""

THERMOMETER_EVERY = 1.0
"""Time between two looks at the coil's resistance, s."""


class Interlock:
    """Watches a source and says why it must be switched off; stays tripped.

    Args:
        limits: in force.
        time: clock time now, s.
        guard: the guard process, or None.
        warn: told once of each thing that is not yet a reason to stop.
    """

    def __init__(
        self,
        limits: CoilLimits,
        time: float,
        guard: Watch | None,
        warn: Callable[[str], None],
    ) -> None:
        self.heat = HeatBudget(limits, time)
        self.thermometer = Thermometer(limits.resistance)
        self.tripped: str | None = None
        self._limits = limits
        self._guard = guard
        self._warn = warn
        self._readback = ReadbackCheck()
        self._setpoint: float | None = None
        self._changed = time
        self._looked = -math.inf

    def flows(self, time: float, setpoint: float | None, *, on: bool) -> None:
        """From `time` (s) on the set-point is `setpoint` (A), None if unknown."""
        if setpoint != self._setpoint:
            self._changed = time
            self._readback = ReadbackCheck()
        self._setpoint = setpoint
        if setpoint is not None:
            self.heat.flow(time, setpoint if on else 0.0)

    def refuse_when_tripped(self) -> None:
        """Refuse to go on before someone has looked.

        Raises:
            InterlockError: tripped and not acknowledged.
        """
        if self.tripped is not None:
            raise InterlockError(f"{self.tripped} Acknowledge it to go on.")

    def acknowledge(self) -> None:
        """Unlatch; heat used remains."""
        self.tripped = None
        self._readback = ReadbackCheck()

    def before_setting(self, time: float) -> str | None:
        """Why the current must stop at `time` s, or None."""
        if self._guard is not None and self._guard.lost is not None:
            return f"The guard process is gone ({self._guard.lost})."
        return self.heat.complaint(time)

    def after_reading(
        self, time: float, measured: float, voltage: Callable[[], float]
    ) -> str | None:
        """Why the current must stop once `measured` A were read, or None.

        `voltage` is asked, in V, when the resistance is due to be looked at.
        """
        if self._setpoint is None or time - self._changed <= STEADY:
            return None
        why = self._readback.complaint(
            self._setpoint, measured, self._limits.compliance
        )
        due = time - self._looked >= THERMOMETER_EVERY
        if why is not None or not due or abs(measured) < THERMOMETER_CURRENT:
            return why
        self._looked = time
        why = self.thermometer.complaint(voltage(), measured)
        if self.thermometer.warning is not None:
            self._warn(self.thermometer.warning)
        return why
