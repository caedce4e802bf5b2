"""What can be said to a current source, each with its read-back, in any dialect."""

from __future__ import annotations

import re
import statistics

from drivers.serial_line.conversation import Conversation
from tactile_lab.clock import Clock
from tactile_lab.errors import BadReplyError, RefusedError
from tactile_lab.instruments.serial_dialect import MARGIN, CoilDialect

CONNECT_QUERIES = 20
"""Harmless queries that measure the update interval."""


class CoilWire:
    """The verbs of a current source.

    Args:
        talk: the conversation, in the row's dialect.
        row: the dialect.
        clock: time that exchanges are measured in.
    """

    def __init__(self, talk: Conversation, row: CoilDialect, clock: Clock) -> None:
        self.talk = talk
        self.row = row
        self._clock = clock

    def set_current(self, current: float) -> None:
        """Command the set-point, A, and check that it was taken."""
        self.talk.command(self.row.set_line(current))

    def set_compliance(self, voltage: float) -> None:
        """Command the compliance, V, and check by read-back.

        Raises:
            RefusedError: another value is read back.
        """
        self.talk.command(self.row.limit_line(voltage))
        self._confirm(
            "compliance", self.row.limit_query, voltage, 0.01 * voltage + 0.01
        )

    def set_zero(self) -> None:
        """Command 0 A and check by read-back.

        Raises:
            RefusedError: another value is read back.
        """
        self.set_current(0.0)
        self._confirm("current", self.row.set_query, 0.0, 2 * 10.0**-self.row.digits)

    def switch_on(self) -> None:
        """Output on, checked by read-back.

        Raises:
            RefusedError: it stays off.
        """
        for line in self.row.on:
            self.talk.command(line)
        if not self.output_is_on():
            raise RefusedError("The source did not switch its output on.")

    def output_is_on(self) -> bool:
        """Whether the output is on, read back.

        Raises:
            BadReplyError: the answer says neither on nor off, twice.
        """
        answer = ""
        for _ in range(2):
            answer = self.talk.query(self.row.on_query)
            if re.search(self.row.on_match, answer):
                return True
            if re.search(self.row.off_match, answer):
                return False
            self.talk.link.resynchronise()
        raise BadReplyError(
            f"The answer {answer!r} to {self.row.on_query!r} says neither on nor off."
        )

    def setpoint(self) -> float:
        """Set-point read back, A."""
        return self.talk.number(self.row.set_query)

    def compliance(self) -> float:
        """Compliance read back, V."""
        return self.talk.number(self.row.limit_query)

    def current(self) -> float:
        """Measured current, A."""
        return self.talk.number(self.row.measure_current, self.row.current_match)

    def voltage(self) -> float:
        """Measured voltage, V."""
        return self.talk.number(self.row.measure_voltage, self.row.voltage_match)

    def current_when_off(self) -> float:
        """Current with the output off, A: measured where the model then measures.

        Raises:
            BadReplyError: no number.
        """
        return self.current() if self.row.measures_when_off else self.setpoint()

    def known_setpoint(self, read: float) -> float:
        """Set-point, A, given what `current_when_off` just read."""
        return self.setpoint() if self.row.measures_when_off else read

    def measured_interval(self) -> float:
        """Time of a verified set-point with margin, s, from queries as long as one."""
        row, wire = self.row, self.talk.link.wire
        lines = row.verified(row.set_query)
        times, characters = [], 0
        for _ in range(CONNECT_QUERIES):
            begun = self._clock.now()
            answers = [self.talk.ask(line) for line in lines]
            times.append(self._clock.now() - begun)
            characters = sum(map(len, lines)) + sum(map(len, answers))
            if not all(answers):
                raise BadReplyError(f"An answer to {row.set_query!r} was empty.")
        wanted = sum(len(line) for line in row.verified(row.set_line(-row.current)))
        wanted += len('0,"No error"') if row.error else 0
        longer = max(0, wanted - characters) * wire.character_time
        return MARGIN * (statistics.median(times) + longer)

    def _confirm(self, what: str, query: str, wanted: float, within: float) -> None:
        found = self.talk.number(query)
        if abs(found - wanted) > within:
            raise RefusedError(
                f"The source reports a {what} of {found:g} after being set to "
                f"{wanted:g}; the output stays off. Check its own limits."
            )
