"""A serial teslameter; its dialect is a row of data."""

from __future__ import annotations

import re

from drivers.serial_line.conversation import Conversation
from drivers.serial_line.instrument import SerialInstrument
from drivers.serial_line.link import SerialLink, Spy
from tactile_lab.bench import Reading
from tactile_lab.clock import Clock
from tactile_lab.errors import BadReplyError, LimitError
from tactile_lab.instruments.serial_dialect import MULTIPLIERS, MeterDialect

MOST_READINGS = 4
"""Readings to take until two in a row have one multiplier."""


class Teslameter(SerialInstrument[Conversation[MeterDialect]]):
    """A field meter behind a serial port.

    Args:
        dialect: how the model speaks.
        port: address for pyserial.
        clock: the bench's time.
        baud: instead of the row's.
        spy: told of every byte, or None.
    """

    def __init__(
        self,
        dialect: MeterDialect,
        port: str,
        clock: Clock,
        *,
        baud: int | None = None,
        spy: Spy | None = None,
    ) -> None:
        self.dialect = dialect
        wire = dialect.serial.at(baud)
        link = SerialLink(
            port, wire, clock, what="teslameter", identify=dialect.identify, spy=spy
        )
        self._clock = clock
        super().__init__(Conversation(link, dialect))
        self._last_factor = 1.0

    @property
    def interval(self) -> float:
        """Shortest time between two readings, s."""
        return self.dialect.interval

    def open(self) -> None:
        """Connect, identify, set unit and range, and read back that they were taken.

        Raises:
            NotFoundError, NoReplyError, LinkLostError: the port or what is behind it.
            BadReplyError: another instrument answers, or it does not take its settings.
        """
        try:
            self._wire.connect()
            self._wire.set_up("its readings could be in another unit")
        except BaseException:
            self._wire.link.close()
            raise

    def look(self) -> str:
        """Who answers: asked and closed, nothing is set.

        Raises:
            InstrumentError: the port or what is behind it, as `open`.
        """
        with self._met():
            return self.identity

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

    def settings(self) -> dict[str, str]:
        """Settings read back, for the run's record."""
        link = self._wire.link
        known = {
            "identity": self.identity,
            "dialect": self.dialect.id,
            "port": link.port,
            "baud": str(link.wire.baud),
        }
        asked = {k: self._wire.query(line) for k, line in self.dialect.report.items()}
        return known | asked

    def close(self) -> None:
        """Let go of the port; idempotent."""
        self._let_go()

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
