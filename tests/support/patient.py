"""Rows that wait long for an answer, for real wires on a machine busy with others."""

from tactile_lab.instruments.dialects import load_dialect


def patient(name, timeout=5.0, **wire):
    """The row `name` with a timeout (s) that no starved far end misses."""
    row = load_dialect(name)
    serial = row.serial.model_copy(update={"timeout": timeout, **wire})
    return row.model_copy(update={"serial": serial})
