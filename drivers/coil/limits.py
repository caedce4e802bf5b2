"""What a coil may be asked to do, checked before anything is sent."""

from __future__ import annotations

import math
from dataclasses import replace

from tactile_lab.bench import CoilLimits
from tactile_lab.errors import LimitError
from tactile_lab.instruments.serial_dialect import CoilDialect
from tactile_lab.quantity import show


def narrowed(limits: CoilLimits, row: CoilDialect) -> CoilLimits:
    """The limits of coil and user, or the model's where those are narrower."""
    return replace(
        limits,
        current=min(limits.current, row.current),
        compliance=min(limits.compliance, row.voltage),
    )


def check_current(current: float, limits: CoilLimits, row: CoilDialect) -> None:
    """Refuse a current (A) that may never be set.

    Raises:
        LimitError: not finite, beyond the limit, or of a sign the source cannot give.
    """
    if not math.isfinite(current):
        raise LimitError(f"A coil current of {current} A cannot be set.")
    if abs(current) > limits.current * (1 + 1e-9):
        raise LimitError(
            f"A coil current of {show(current, 'A')} exceeds the limit of "
            f"{show(limits.current, 'A')}. Ask for less, or for a coil and "
            "source that allow more."
        )
    if current < 0 and row.polarity == "positive":
        raise LimitError(
            f"{row.title} cannot reverse its current, so "
            f"{show(current, 'A')} is refused. Ask for a force of the other sign, "
            "or use a four-quadrant source."
        )
