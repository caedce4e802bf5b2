"""Rows that wait long for an answer, for real wires on a machine busy with others."""


def patient(row, timeout=5.0, **wire):
    """The row with a timeout (s) that no starved far end misses."""
    serial = row.serial.model_copy(update={"timeout": timeout, **wire})
    return row.model_copy(update={"serial": serial})
