"""A serial teslameter; its dialect is a row of data."""

from __future__ import annotations

import math
import re

from drivers.serial_line.meter import SerialMeter, unit_of
from tactile_lab.bench import Reading
from tactile_lab.errors import BadReplyError, LimitError
from tactile_lab.instruments.meter_dialect import MULTIPLIERS, TeslameterDialect
from tactile_lab.quantity import show

MOST_READINGS = 4
"""Readings to take until two in a row have one multiplier."""

UNITS = {"t": 1.0, "mt": 1e-3, "ut": 1e-6, "g": 1e-4, "kg": 0.1, "mg": 1e-7}
"""Tesla of each unit that a meter may write there, in lower case."""


class Teslameter(SerialMeter[TeslameterDialect]):
    """A field meter behind a serial port."""

    what = "teslameter"
    _last_factor = 1.0

    def read(self) -> Reading:
        """Magnetic flux density, T.

        Raises:
            LimitError: the field exceeds the meter's range.
            BadReplyError: the answer is no number, twice, or in another unit.
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
            BadReplyError: no number, twice, or it shows another unit than the row's.
        """
        answer = self._wire.query(self.dialect.field)
        if re.search(self.dialect.overload, answer):
            raise LimitError(
                f"The field exceeds the teslameter's range (it answers {answer!r}). "
                "Choose a larger range or autorange."
            )
        self._refuse_other_unit(answer)
        value = self._wire.parsed(answer)
        return self._wire.number(self.dialect.field) if value is None else value

    def _refuse_other_unit(self, answer: str) -> None:
        """Where a unit stands behind the number, it must be the row's.

        Raises:
            BadReplyError: it is another.
        """
        tesla = UNITS.get(unit_of(answer) or "")
        if tesla is not None and not math.isclose(tesla, self.dialect.scale):
            raise BadReplyError(
                f"The teslameter answers {answer!r} where its dialect "
                f'"{self.dialect.id}" has units of {show(self.dialect.scale, "T")}. '
                "Set that unit at its front panel, or correct init or scale of its row."
            )

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
