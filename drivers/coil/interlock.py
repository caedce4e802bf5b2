"""What protects a coil in software: limits, heat, read-back, resistance, and the latch.

Only hardware is a real interlock; these catch mistakes, not broken electronics.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace

from drivers.coil.guard import Guard
from tactile_lab.bench import COPPER, CoilLimits
from tactile_lab.current_list import CurrentList
from tactile_lab.errors import InterlockError, LimitError
from tactile_lab.instruments.serial_dialect import CoilDialect
from tactile_lab.quantity import show

DEVIATION = 0.010
"""Smallest difference between set and measured current that counts, A."""

DEVIATION_SHARE = 0.02
"""The same as a share of the set-point."""

DEVIATING_READINGS = 3
"""Readings in a row that must deviate before it trips."""

THERMOMETER_CURRENT = 0.2
"""Smallest current at which voltage over current tells the temperature, A."""

WARM, HOT, LOOSE, SHORTED = 1.15, 1.24, 2.0, 0.7
"""Ratios to the cold resistance: warns, trips, open lead, shorted turns."""

ALIKE = 0.05
"""Part by which two looks at a cold coil may differ: one wrong digit is more."""

NO_RESISTANCE = 0.05
"""Resistance below which there is no coil, Ohm."""

STEADY = 0.1
"""Time after a change of the set-point from which read-back must agree, s."""

MOVED = 0.3
"""Time by which a measured current may lag behind a set-point that moves, s."""

LAG = 0.02
"""Time by which the measured current may lag behind a list, s."""

LIST = (
    "The source plays a list that gives",
    "the list did not start or was cut short, or the circuit is open. Check the front "
    "panel and the leads",
)
GENERATOR = (
    "The scope's generator asks for",
    "it did not start, its lead to the source's analogue input is loose, the gain in "
    "[coil.generator] is another, or the circuit is open. Check the leads, and the "
    "source's analogue input",
)
"""What is said of a current that is not what is played: what plays, and what to do."""

THERMOMETER_EVERY = 1.0
"""Time between two looks at the coil's resistance, s."""


def narrowed(limits: CoilLimits, row: CoilDialect) -> CoilLimits:
    """The limits of coil and user, or the model's where those are narrower."""
    return replace(
        limits,
        current=min(limits.current, row.current),
        compliance=min(limits.compliance, row.voltage),
    )


def check_current(current: float, limits: CoilLimits, row: CoilDialect) -> None:
    """Refuse a current (A) that may never be set.

    Raises:
        LimitError: not finite, beyond the limit, or of a sign the source cannot give.
    """
    if not math.isfinite(current):
        raise LimitError(f"A coil current of {current} A cannot be set.")
    if abs(current) > limits.current * (1 + 1e-9):
        raise LimitError(
            f"A coil current of {show(current, 'A')} exceeds the limit of "
            f"{show(limits.current, 'A')}. Ask for less, or for a coil and "
            "source that allow more."
        )
    if current < 0 and row.polarity == "positive":
        raise LimitError(
            f"{row.title} cannot reverse its current, so "
            f"{show(current, 'A')} is refused. Ask for a force of the other sign, "
            "or use a four-quadrant source."
        )


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
        guard: Guard | None,
        warn: Callable[[str], None],
    ) -> None:
        self.heat = HeatBudget(limits, time)
        self.thermometer = WindingThermometer(limits.resistance)
        self.tripped: str | None = None
        self._limits = limits
        self._guard = guard
        self._warn = warn
        self._readback = ReadbackCheck()
        self._setpoint: float | None = None
        self._moves: deque[tuple[float, float]] = deque()
        """Known set-points and from when on, of the last `MOVED` s; s and A."""
        self._list: tuple[CurrentList, float, float] | None = None
        self._player = LIST
        self._changed = time
        self._looked = -math.inf

    def flows(self, time: float, setpoint: float | None, *, on: bool) -> None:
        """From `time` (s) on the set-point is `setpoint` (A), None if unknown.

        What deviated before still counts: of a short hold one reading comes.
        """
        if setpoint != self._setpoint:
            self._changed = time
        if not on:
            self._readback = ReadbackCheck()
        self._setpoint, self._list = setpoint, None
        if setpoint is None or not on:
            self._moves.clear()
        if setpoint is not None:
            self._moves.append((time, setpoint))
            while len(self._moves) > 1 and self._moves[1][0] <= time - MOVED:
                self._moves.popleft()
            self.heat.flow(time, setpoint if on else 0.0)

    def plays(
        self,
        points: CurrentList,
        earliest: float,
        latest: float,
        player: tuple[str, str] = LIST,
    ) -> None:
        """A list has begun between `earliest` and `latest` s; counts all its heat."""
        self.flows(latest, None, on=True)
        self._player = player
        self._list = points, earliest, latest
        self.heat.spend_list(points, earliest)

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
        return self._unguarded() or self.heat.complaint(time)

    def after_reading(self, asked: float, time: float, measured: float) -> str | None:
        """Why the current must stop once `measured` A were read, or None.

        It was measured between `asked` and `time` s.
        """
        if (unguarded := self._unguarded()) is not None:
            return unguarded
        if self._list is not None:
            points, earliest, latest = self._list
            within = points.between(asked - latest - LAG, time - earliest)
            return self._readback.list_complaint(within, measured, self._player)
        if self._setpoint is None:
            return None
        near = self._setpoint if self._rests(time) else self._moved_to(measured)
        return self._readback.complaint(near, measured, self._limits.compliance)

    def resistance_due(self, time: float, measured: float) -> bool:
        """Whether the resistance is to be looked at, `measured` A flowing at `time` s.

        Not while the current moves, nor where what flows is not known beforehand.
        """
        if self._setpoint is None or not self._rests(time):
            return False
        due = time - self._looked >= THERMOMETER_EVERY
        return due and abs(measured) >= THERMOMETER_CURRENT

    def after_look(self, time: float, voltage: float, measured: float) -> str | None:
        """Why the current must stop with that voltage, V, and current, A, or None."""
        self._looked = time
        why = self.thermometer.complaint(voltage, measured)
        if self.thermometer.warning is not None:
            self._warn(self.thermometer.warning)
        return why

    def _rests(self, time: float) -> bool:
        return time - self._changed > STEADY

    def _moved_to(self, measured: float) -> float:
        """The nearest to what was measured, A, of what was passed in `MOVED` s."""
        passed = [setpoint for _, setpoint in self._moves]
        return min(max(measured, min(passed)), max(passed))

    def _unguarded(self) -> str | None:
        if self._guard is None or self._guard.lost is None:
            return None
        return f"The guard process is gone ({self._guard.lost})."


class HeatBudget:
    """Leaky integral of I² above the continuous current.

    Above the continuous current it grows by I² - I_continuous² (A² s a second); below,
    it falls with the recovery time constant.

    Args:
        limits: continuous current, budget and recovery.
        time: clock time now, s.
    """

    def __init__(self, limits: CoilLimits, time: float) -> None:
        self._limits = limits
        self._time = time
        self._current = 0.0
        self._used = 0.0

    def flow(self, time: float, current: float) -> None:
        """From `time` (s) on `current` (A) flows."""
        self._used = self.used(time)
        self._time = max(time, self._time)
        self._current = current

    def used(self, time: float) -> float:
        """Heat in the budget at `time`, A² s."""
        passed = max(0.0, time - self._time)
        excess = self._current**2 - self._limits.continuous**2
        if excess > 0:
            return self._used + excess * passed
        return self._used * math.exp(-passed / self._limits.recovery)

    def refuse_list(self, points: CurrentList, time: float) -> None:
        """Refuse a list of currents that would use too much.

        Raises:
            LimitError: it would.
        """
        if (why := copy(self).spend_list(points, time)) is not None:
            raise LimitError(f"With this list: {why}")

    def spend_list(self, points: CurrentList, time: float) -> str | None:
        """Count a list of currents from `time` s on, all of it at once.

        Returns:
            Why the current would have to stop on the way, or None.
        """
        starts = [*(time + points.starts).tolist(), time + points.duration]
        why = None
        for start, current in zip(
            starts, [*points.currents.tolist(), 0.0], strict=True
        ):
            self.flow(start, current)
            why = why or self.complaint(start)
        return why

    def complaint(self, time: float) -> str | None:
        """Why the current must stop, or None."""
        used = self.used(time)
        if used <= self._limits.heat:
            return None
        return (
            f"The coil has used {used:.1f} A² s of its heat budget of "
            f"{self._limits.heat:g} A² s above {show(self._limits.continuous, 'A')}. "
            "Let it cool, then acknowledge."
        )


@dataclass
class ReadbackCheck:
    """Trips when the measured current keeps differing from what is set."""

    deviating: int = 0

    def complaint(
        self, setpoint: float, measured: float, compliance: float
    ) -> str | None:
        """Why the current must stop, or None; A and V."""
        if not self._deviates((setpoint, setpoint), measured):
            return None
        if abs(measured) > abs(setpoint):
            why = (
                "it was set by hand, or its analogue input adds. Check its front panel"
            )
        else:
            why = (
                f"the circuit is open, the compliance of {show(compliance, 'V')} is "
                "too low, or it was switched off, reset or set by hand. Check leads, "
                "limit and front panel"
            )
        return (
            f"The source was set to {show(setpoint, 'A')} but {show(measured, 'A')} "
            f"flows, {self.deviating} readings in a row: {why}."
        )

    def list_complaint(
        self, within: tuple[float, float], measured: float, player: tuple[str, str]
    ) -> str | None:
        """Why a list that gives what lies `within` must stop, or None; A."""
        if not self._deviates(within, measured):
            return None
        told = " to ".join(show(current, "A") for current in dict.fromkeys(within))
        plays, check = player
        return (
            f"{plays} {told} now but {show(measured, 'A')} flows, {self.deviating} "
            f"readings in a row: {check}."
        )

    def _deviates(self, within: tuple[float, float], measured: float) -> bool:
        """Whether one reading too many lies outside what is expected, A."""
        low, high = within
        largest = max(abs(low), abs(high))
        allowed = max(DEVIATION_SHARE * largest, DEVIATION)
        if low - allowed <= measured <= high + allowed:
            if largest > allowed:  # no current agrees with whatever is wrong
                self.deviating = 0
            return False
        self.deviating += 1
        return self.deviating >= DEVIATING_READINGS


@dataclass
class WindingThermometer:
    """Temperature of the copper from its resistance, V/I at a steady current.

    Attributes:
        cold: resistance at 20 C, Ohm; where it was not given, the first reading that
            the next one agrees with.
        ratio: last resistance over `cold`; None until that is known.
        warning: told once, when the coil has become warm.
    """

    cold: float | None = None
    ratio: float | None = None
    warning: str | None = None
    _seen: float | None = None

    def complaint(self, voltage: float, current: float) -> str | None:
        """Why the current must stop, or None; V and A."""
        if abs(current) < THERMOMETER_CURRENT:
            return None
        resistance = abs(voltage / current)
        if resistance < NO_RESISTANCE:
            return (
                f"{show(current, 'A')} flow without voltage: the coil is shorted, or "
                "the source measures no voltage. Check leads and winding."
            )
        if self.cold is None:
            seen, self._seen = self._seen, resistance
            if seen is None or abs(resistance / seen - 1) > ALIKE:
                return None
            self.cold = seen
        self.ratio = ratio = resistance / self.cold
        told = f"{show(resistance, 'Ohm')}, {ratio:.2f} times its cold resistance"
        if ratio > LOOSE:
            return f"The coil has {told}: a lead is loose. Check the connections."
        if ratio < SHORTED:
            return f"The coil has {told}: turns are shorted. Check the winding."
        warmer = (ratio - 1) / COPPER
        if ratio > HOT:
            return f"The coil has {told}: some {warmer:.0f} K warmer. Let it cool."
        if ratio > WARM and self.warning is None:
            self.warning = (
                f"The coil has {told}: some {warmer:.0f} K warmer. It trips at {HOT}."
            )
        return None
