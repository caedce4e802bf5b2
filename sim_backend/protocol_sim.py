"""Lets pyserial open `sim://` addresses; pyserial finds this module by its name."""

from __future__ import annotations

from sim_backend.serial_line.wires import SimPort


def serial_class_for_url(url: str) -> tuple[str, type[SimPort]]:
    """The address and the class of port that serves it."""
    return url, SimPort
