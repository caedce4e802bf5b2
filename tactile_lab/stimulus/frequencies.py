"""Frequencies that a protocol goes through, in one spacing and order."""

from __future__ import annotations

from collections.abc import Iterable
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


def by_label(frequencies: Iterable[float], digits: int) -> dict[str, float]:
    """Each frequency by the label of its trials, "21.5 Hz": rounded, Hz is not.

    Args:
        frequencies: Hz.
        digits: of a label; more where these do not tell the frequencies apart.
    """
    one_each = set(frequencies)
    found = {f"{f:.{digits}g} Hz": f for f in sorted(one_each)}
    return found if len(found) == len(one_each) else by_label(one_each, digits + 1)


def spaced(lowest: float, highest: float, count: int) -> list[float]:
    """So many frequencies, evenly spaced on a logarithmic scale, Hz."""
    if lowest == highest:
        return [lowest] * count
    return [float(f) for f in np.geomspace(lowest, highest, count)]
