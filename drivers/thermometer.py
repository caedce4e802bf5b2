"""A serial thermometer; its dialect is a row of data."""

from __future__ import annotations

import re

from drivers.serial_line.meter import SerialMeter, unit_of
from tactile_lab.bench import Reading
from tactile_lab.errors import BadReplyError, LimitError
from tactile_lab.instruments.meter_dialect import ThermometerDialect
from tactile_lab.quantity import show

UNITS = {"k": (1.0, 0.0), "c": (1.0, 273.15), "f": (5 / 9, 459.67 * 5 / 9)}
"""Kelvin that a 1 more and a 0 are, of each unit behind a number, in lower case."""


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
            BadReplyError: the answer is no number, twice, or in an unknown unit.
        """
        row, wire = self.dialect, self._wire
        kelvin = self._kelvin()
        now = self._clock.now()
        # asked after it: what the instrument answers to an open sensor is a number too
        if row.status is not None:
            status = wire.query(row.status)
            if re.search(row.status_ok, status) is None:
                raise self._no_reading(f"{row.status} answers {status!r}", kelvin)
        if kelvin <= 0:
            raise self._no_reading("no temperature is so low", kelvin)
        return Reading(now, kelvin)

    def _kelvin(self) -> float:
        """What it shows, K: in the unit that it names, else in the row's.

        Raises:
            BadReplyError: no number, twice, or another unit.
        """
        value, answer = self._wire.number_in(self.dialect.temperature)
        unit = unit_of(answer)
        if unit is None:
            return value + self.dialect.zero
        if (known := UNITS.get(unit.removeprefix("deg"))) is None:
            raise BadReplyError(
                f"The thermometer answers {answer!r} to {self.dialect.temperature!r}: "
                "its unit is none of K, C and F. Set one of them at its front panel, "
                f'or by init of its dialect "{self.dialect.id}".'
            )
        return value * known[0] + known[1]

    def _no_reading(self, why: str, kelvin: float) -> LimitError:
        where = f" at its input {name}" if (name := self.dialect.inputs[0]) else ""
        return LimitError(
            f"The thermometer's {show(kelvin, 'K')}{where} is no reading: {why}. "
            "Check that a sensor is connected there, its curve and its range, or name "
            "another input in [thermometer] of the bench file."
        )
