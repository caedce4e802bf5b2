"""A serial thermometer; its dialect is a row of data."""

from __future__ import annotations

import re

from drivers.serial_line.meter import SerialMeter
from tactile_lab.bench import Reading
from tactile_lab.errors import LimitError
from tactile_lab.instruments.meter_dialect import ThermometerDialect
from tactile_lab.quantity import show


class Thermometer(SerialMeter[ThermometerDialect]):
    """A thermometer behind a serial port, at one of its inputs.

    The row is one for an input: `ThermometerDialect.at`.
    """

    what = "thermometer"

    def read(self) -> Reading:
        """Temperature, K.

        Raises:
            LimitError: the instrument says that its sensor is open, shorted or beyond
                its range, or no temperature can be so low.
            BadReplyError: the answer is no number, twice.
        """
        row, wire = self.dialect, self._wire
        kelvin = wire.number(row.temperature) + row.zero
        now = self._clock.now()
        # asked after it: what the instrument answers to an open sensor is a number too
        if row.status is not None:
            status = wire.query(row.status)
            if re.search(row.status_ok, status) is None:
                raise self._no_reading(f"{row.status} answers {status!r}", kelvin)
        if kelvin <= 0:
            raise self._no_reading("no temperature is so low", kelvin)
        return Reading(now, kelvin)

    def _no_reading(self, why: str, kelvin: float) -> LimitError:
        where = f" at its input {name}" if (name := self.dialect.inputs[0]) else ""
        return LimitError(
            f"The thermometer's {show(kelvin, 'K')}{where} is no reading: {why}. "
            "Check that a sensor is connected there, its curve and its range, or name "
            "another input in [thermometer] of the bench file."
        )
