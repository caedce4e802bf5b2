"""Rows that wait long for an answer, for real wires on a machine busy with others."""

from typing import TypeVar

from tactile_lab.instruments.serial_dialect import SerialDialect

D = TypeVar("D", bound=SerialDialect)


def patient(row: D, timeout: float = 5.0, **wire: object) -> D:
    """The row with a timeout (s) that no starved far end misses."""
    serial = row.serial.model_copy(update={"timeout": timeout, **wire})
    return row.model_copy(update={"serial": serial})
