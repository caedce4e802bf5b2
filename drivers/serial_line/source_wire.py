"""A conversation with a source: its output, set-point, compliance, measurements."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TypeVar

from drivers.serial_line.conversation import Conversation
from tactile_lab.errors import BadReplyError, NoReplyError, RefusedError
from tactile_lab.instruments.serial_dialect import SourceDialect

S = TypeVar("S", bound=SourceDialect)

RECONNECT = 1.0
"""How long to try to open a lost port again before each attempt to leave safely, s."""

VERIFICATIONS = 3
"""Times the state to leave it in is commanded and read back before giving up."""

MOST_LOOKS = 4
"""Times a set-point is asked for until two answers in a row agree."""

REHEARSED = 0.01
"""Set-point, A or V, that shows whether a row is right while the output is off."""

NOT_UNDERSTOOD = r"^\s*-1\d\d\b"
"""SCPI's errors of a line that an instrument does not know or cannot read."""


class SourceWire(Conversation[S]):
    """What is said to every source, of a current or of a voltage."""

    def switch_on(self) -> None:
        """Output on, checked by read-back.

        Raises:
            RefusedError: it stays off.
        """
        for line in self.dialect.on:
            self.command(line)
        if not self.output_is_on():
            raise RefusedError("The source did not switch its output on.")

    def output_is_on(self) -> bool:
        """Whether the output is on, read back.

        Raises:
            BadReplyError: the answer says neither on nor off, twice.
        """
        answer = ""
        for _ in range(2):
            answer = self.query(self.dialect.on_query)
            if re.search(self.dialect.on_match, answer):
                return True
            if re.search(self.dialect.off_match, answer):
                return False
            self.link.resynchronise()
        raise BadReplyError(
            f"The answer {answer!r} to {self.dialect.on_query!r} says neither on nor "
            "off."
        )

    def output_is_surely_off(self) -> bool:
        """Whether the output is off, which two answers say: one may have a wrong digit.

        Raises:
            BadReplyError: an answer says neither on nor off, twice.
        """
        return not (self.output_is_on() or self.output_is_on())

    def setpoint(self) -> float:
        """Set-point read back, A or V."""
        return self.number(self.dialect.set_query) * self.dialect.set_unit

    def standing(self) -> float:
        """Set-point that the next step starts from, A or V: two answers agree on it.

        Raises:
            BadReplyError: no two in a row do.
        """
        seen = [self.setpoint()]
        while len(seen) < MOST_LOOKS:
            seen.append(self.setpoint())
            if seen[-1] == seen[-2]:  # a wrong digit would be set next
                return seen[-1]
        link = self.link
        raise BadReplyError(
            f"The {link.what} at {link.port} answers {self.dialect.set_query!r} with "
            f"another set-point each time: {', '.join(f'{one:g}' for one in seen)}. "
            "Check its cable, and that nobody turns its knobs."
        )

    def compliance(self) -> float:
        """Compliance read back, V or A."""
        return self.number(self.dialect.limit_query) * self.dialect.limit_unit

    def current(self) -> float:
        """Measured current, A."""
        row = self.dialect
        return self.number(row.measure_current, row.current_match) * row.current_unit

    def voltage(self) -> float:
        """Measured voltage, V."""
        row = self.dialect
        return self.number(row.measure_voltage, row.voltage_match) * row.voltage_unit

    def measured(self) -> tuple[float, Callable[[], float]]:
        """Measured current, A, and what gives the voltage, V, measured with it.

        The voltage is a question of its own only where no answer holds both.
        """
        row = self.dialect
        if row.measure_voltage != row.measure_current:
            return self.current(), self.voltage
        answer = self.query(row.measure_current)
        current = self.parsed(answer, row.current_match)
        voltage = self.parsed(answer, row.voltage_match)
        if current is None or voltage is None:
            return self.current(), self.voltage
        volts = voltage * row.voltage_unit
        return current * row.current_unit, lambda: volts

    def confirm(
        self, what: str, read: Callable[[], float], wanted: float, within: float
    ) -> None:
        """Read back that a setting was taken.

        Raises:
            RefusedError: another value is read back.
        """
        found = read()
        if abs(found - wanted) > within:
            raise RefusedError(
                f"The source reports a {what} of {found:g} after being set to "
                f"{wanted:g}; the output stays off. Check its own limits, and the "
                f'lines of its dialect "{self.dialect.id}".'
            )

    def rehearse(self) -> list[str]:
        """Try with the output off what a run says with it on: is a row understood?

        The set-point goes to `REHEARSED` and back.

        Returns:
            Lines that can be tried with the output on alone.

        Raises:
            RefusedError: a line is not understood, or another set-point read back.
            BadReplyError: what is measured is no number.
        """
        row = self.dialect
        for value in (REHEARSED, 0.0):
            self.command(row.set_line(value))
            self.confirm("set-point", self.setpoint, value, REHEARSED / 2)
        untried = [*row.on]
        for line, pattern in (
            (row.measure_voltage, row.voltage_match),
            (row.measure_current, row.current_match),
        ):
            if self._tells(line):
                self.number(line, pattern)
            elif line not in untried:
                untried.append(line)
        return untried

    def _tells(self, line: str) -> bool:
        """Whether it answers what it measures while its output is off.

        Raises:
            RefusedError: it does not know the question.
        """
        try:
            self.link.query(line)
            return True
        except (NoReplyError, BadReplyError):
            self.link.resynchronise()
            for error in self._empty_errors(self.link.query):
                if re.search(NOT_UNDERSTOOD, error):
                    raise RefusedError(
                        f"The {self.dialect.role} does not understand {line!r} of its "
                        f'dialect "{self.dialect.id}": {error}.'
                    ) from None
            return False
