"""Frequencies that a protocol goes through, in one spacing and order."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from tactile_lab.quantity import Unit

Frequency = Annotated[float, Unit("Hz", above=0.0)]


def check_rising(lowest: float, highest: float) -> None:
    """Refuse by ValueError a last frequency below the first, Hz."""
    if highest < lowest:
        raise ValueError(
            f"highest {highest:g} Hz must not be below lowest {lowest:g} Hz"
        )


def spaced(lowest: float, highest: float, count: int) -> list[float]:
    """So many frequencies, evenly spaced on a logarithmic scale, Hz."""
    return [float(f) for f in np.geomspace(lowest, highest, count)]
