"""A serial instrument that reads one quantity: opened, set up, its settings, closed."""

from __future__ import annotations

import re
from typing import ClassVar, TypeVar

from drivers.serial_line.conversation import Conversation
from drivers.serial_line.instrument import SerialInstrument
from drivers.serial_line.link import SerialLink, Spy
from tactile_lab.clock import Clock
from tactile_lab.instruments.meter_dialect import MeterDialect

M = TypeVar("M", bound=MeterDialect)

UNIT = re.compile(r"[\d.]\s*([A-Za-z]+)\s*$")
"""What stands behind the number of an answer."""


def unit_of(answer: str) -> str | None:
    """The unit behind the number of an answer, in lower case; None without one."""
    shown = UNIT.search(answer)
    return None if shown is None else shown[1].lower()


class SerialMeter(SerialInstrument[Conversation[M]]):
    """What a teslameter and a thermometer behind a serial port have in common.

    Args:
        dialect: how the model speaks.
        port: address for pyserial.
        clock: the bench's time.
        baud: instead of the row's.
        spy: told of every byte, or None.
    """

    what: ClassVar[str]

    def __init__(
        self,
        dialect: M,
        port: str,
        clock: Clock,
        *,
        baud: int | None = None,
        spy: Spy | None = None,
    ) -> None:
        self.dialect = dialect
        wire, ask = dialect.serial.at(baud), dialect.identify
        link = SerialLink(port, wire, clock, what=self.what, identify=ask, spy=spy)
        self._clock = clock
        super().__init__(Conversation(link, dialect))

    @property
    def interval(self) -> float:
        """Shortest time between two readings, s."""
        return self.dialect.interval

    def open(self) -> None:
        """Connect, identify, set it up, and read back that the settings were taken.

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

    def settings(self) -> dict[str, str]:
        """Settings read back, for the run's record."""
        asked = {k: self._wire.query(line) for k, line in self.dialect.report.items()}
        return self._known | asked

    def close(self) -> None:
        """Let go of the port; idempotent."""
        self._let_go()
