"""A serial teslameter; its dialect is a row of data."""

from __future__ import annotations

import re

from drivers.serial_line.meter import SerialMeter
from tactile_lab.bench import Reading
from tactile_lab.errors import BadReplyError, LimitError
from tactile_lab.instruments.meter_dialect import MULTIPLIERS, TeslameterDialect

MOST_READINGS = 4
"""Readings to take until two in a row have one multiplier."""


class Teslameter(SerialMeter[TeslameterDialect]):
    """A field meter behind a serial port."""

    what = "teslameter"
    _last_factor = 1.0

    def read(self) -> Reading:
        """Magnetic flux density, T.

        Raises:
            LimitError: the field exceeds the meter's range.
            BadReplyError: the answer is no number, twice.
        """
        for _ in range(MOST_READINGS):
            value, factor = self._value(), self._factor()
            # the range may have changed between the two answers
            if factor == self._last_factor:
                return Reading(self._clock.now(), value * factor * self.dialect.scale)
            self._last_factor = factor
        raise BadReplyError(
            "The teslameter changes its multiplier from reading to reading. Fix its "
            "range at its front panel, or keep the field steady."
        )

    def _value(self) -> float:
        """What the meter shows, in its unit.

        Raises:
            LimitError: the field exceeds its range.
        """
        answer = self._wire.query(self.dialect.field)
        if re.search(self.dialect.overload, answer):
            raise LimitError(
                f"The field exceeds the teslameter's range (it answers {answer!r}). "
                "Choose a larger range or autorange."
            )
        value = self._wire.parsed(answer)
        return self._wire.number(self.dialect.field) if value is None else value

    def _factor(self) -> float:
        """Factor by the prefix letter of the row's multiplier query, or 1.

        An empty line is an answer to it. One that was left on the wire is found out:
        the next is another.
        """
        query = self.dialect.multiplier
        if query is None:
            return 1.0
        letter = self._wire.query(query, blank=True).lower()
        if not letter:
            letter = self._wire.query(query, blank=True).lower()
        if letter not in MULTIPLIERS:
            raise BadReplyError(f"The teslameter's multiplier {letter!r} is unknown.")
        return MULTIPLIERS[letter]
