"""All that is ever said to a current source, in any dialect, each with its read-back.

The way out, `switch_off`, tries every step and raises nothing.
"""

from __future__ import annotations

import math
import statistics

from drivers.serial_line.failures import gathered
from drivers.serial_line.source_wire import RECONNECT, VERIFICATIONS, SourceWire
from tactile_lab.bench import Lowered, OffReport
from tactile_lab.errors import BadReplyError, TactileLabError
from tactile_lab.instruments.serial_dialect import MARGIN, CoilDialect
from tactile_lab.quantity import show

CONNECT_QUERIES = 20
"""Harmless queries that measure the update interval."""

OFF_CURRENT = 0.005
"""Largest current that counts as none, A."""

LONGEST_RAMP = 0.5
"""Longest time the steps of a ramp may add up to, s; a larger current ramps faster."""

SHORTEST_REST, LONGEST_REST = 0.005, 0.2
"""Time from an answer to the next step of a ramp, s; the guard wants a heartbeat."""

CATCH_UP = 0.05
"""Time after a late set-point, s, that one step may make up for at the slew limit."""

SETTLE = 0.02
"""Time the current has to die away before it is read back, s."""

UNKNOWN = "OUTPUT STATE UNKNOWN: switch the coil source off at the instrument. "

DOUBT = (
    " It did not confirm every line, so its set-point may not be 0 A: look before you "
    "switch it on by hand."
)


class CoilWire(SourceWire[CoilDialect]):
    """A conversation with a current source."""

    def set_current(self, current: float) -> None:
        """Command the set-point, A, and check that it was taken."""
        self.command(self.dialect.set_line(current))

    def set_compliance(self, voltage: float) -> None:
        """Command the compliance, V, and check by read-back.

        Raises:
            RefusedError: another value is read back.
        """
        self.command(self.dialect.limit_line(voltage))
        self.confirm("compliance", self.compliance, voltage, 0.01 * voltage + 0.01)

    def set_zero(self) -> None:
        """Command 0 A and check by read-back.

        Raises:
            RefusedError: another value is read back.
        """
        self.set_current(0.0)
        self.confirm("current", self.setpoint, 0.0, 2 * self.dialect.grain)

    def current_when_off(self) -> float:
        """Current with the output off, A: measured where the model then measures.

        Raises:
            BadReplyError: no number.
        """
        return self.current() if self.dialect.measures_when_off else self.setpoint()

    def known_setpoint(self, read: float) -> float:
        """Set-point, A, given what `current_when_off` just read."""
        return self.setpoint() if self.dialect.measures_when_off else read

    def measured_interval(self) -> float:
        """Time of a verified set-point with margin, s, from queries as long as one."""
        row, wire = self.dialect, self.link.wire
        lines = row.verified(row.set_query)
        times, characters = [], 0
        for _ in range(CONNECT_QUERIES):
            begun = self.link.now
            answers = [self.query(line) for line in lines]
            times.append(self.link.now - begun)
            characters = sum(map(len, lines)) + sum(map(len, answers))
            if not all(answers):
                raise BadReplyError(f"An answer to {row.set_query!r} was empty.")
        wanted = sum(len(line) for line in row.verified(row.set_line(-row.current)))
        wanted += len('0,"No error"') if row.error else 0
        longer = max(0, wanted - characters) * wire.character_time
        return MARGIN * (statistics.median(times) + longer)

    def switch_off(
        self,
        *,
        setpoint: float | None,
        rested: float,
        slew: float,
        exchange: float,
        ramp: bool,
    ) -> OffReport:
        """Bring the source to 0 A and output off, and say whether that was verified.

        Args:
            setpoint: last known, A; None when unknown.
            rested: time since it was taken, s.
            slew: of the ramp, A/s.
            exchange: typical time of a verified set-point, s.
            ramp: False goes to 0 A at once.
        """
        trouble: list[str] = []
        fall: list[Lowered] = []
        if not self.reconnected(trouble, RECONNECT):
            return OffReport(False, None, UNKNOWN + gathered(trouble))
        if ramp and setpoint != 0.0:
            self._ramp_down(setpoint, rested, slew, exchange, trouble, fall)
        row = self.dialect
        zero = (*row.stop_lines, row.set_line(0.0))
        current: float | None = None
        disobeys = False
        for left in reversed(range(VERIFICATIONS)):
            if not self.reconnected(trouble, RECONNECT):
                break
            if disobeys:  # somebody may have put it under its front panel's control
                self.offer(row.optional)
            asked = self.link.now
            if taken := self.insist(zero, trouble):
                fall.append(Lowered(asked, self.link.now, self.acted, 0.0))
            taken = self.insist(row.off, trouble) and taken
            self.link.pause(SETTLE)
            try:
                on = self.output_is_on()
                current = self.current_when_off()
                # a line may be refused for another reason than its set-point
                taken = taken or abs(self.known_setpoint(current)) <= OFF_CURRENT
            except TactileLabError as reason:
                trouble.append(f"read-back: {reason}")
                continue
            if not on and abs(current) <= OFF_CURRENT:
                if left and not taken:
                    continue  # off, but the set-point may be another than 0 A
                text = f"Output off, {show(current, 'A')} read back."
                text += "" if taken else DOUBT
                text = f"{text} {self.link.moved}".strip()
                return OffReport(True, current, text, tuple(fall))
            disobeys, state = True, "on" if on else "off"
            trouble.append(f"read-back: output {state}, {show(current, 'A')}")
        text = UNKNOWN + gathered(trouble)
        return OffReport(False, current, text, tuple(fall))

    def _taken_over(self, fall: list[Lowered]) -> float:
        """Set-point to ramp down from, A, once a list that may be playing ended."""
        if self.dialect.list is None:
            return self.standing()
        # a wrong digit is set next; of two looks at what moves the smaller harms least
        flowing = min(self.current(), self.current(), key=abs)
        sent = self.link.now
        self.set_current(flowing)
        for line in self.dialect.stop_lines:  # the last ends it
            sent = self.link.now
            self.command(line)
        fall.append(Lowered(sent, self.link.now, self.acted, flowing))
        return flowing

    def _ramp_down(
        self,
        setpoint: float | None,
        rested: float,
        slew: float,
        exchange: float,
        trouble: list[str],
        fall: list[Lowered],
    ) -> None:
        """Steps until 0 A is one step away, at the slew limit; ended by a failure.

        A step is as large as the time since the last one was answered allows. The
        source took that one before it answered, so no delay on the way can bring two
        steps closer together at the source than the limit allows. Resting for four
        exchanges makes the whole ramp take a quarter longer than its nominal time, for
        two, where that is more than a step may make up for, half as long again. After
        a hold the first step is taken at once.
        """
        try:
            current = self._taken_over(fall) if setpoint is None else setpoint
            slew = max(slew, abs(current) / LONGEST_RAMP)
            answered = self.link.now - (0.0 if setpoint is None else rested)
            while True:
                rest = max(2 * exchange, min(4 * exchange, CATCH_UP), SHORTEST_REST)
                rest = min(rest, LONGEST_REST)
                answered = max(answered, self.link.now - rest)
                self.link.sleep_until(answered + min(rest, abs(current) / slew))
                sent = self.link.now
                left = abs(current) - slew * (sent - answered)
                if left < self.dialect.grain:
                    return  # 0 A is what comes next anyway
                current = math.copysign(left, current)
                self.set_current(current)
                answered = self.link.now
                fall.append(Lowered(sent, answered, self.acted, current))
                exchange = answered - sent
        except TactileLabError as reason:
            trouble.append(f"ramp: {reason}")
