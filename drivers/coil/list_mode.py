"""Lists of currents that a source plays by its own clock, checked before upload.

A list runs on when this program dies, so it is always finite and ends at 0 A.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from drivers.coil.interlock import check_current
from drivers.coil.wire import CoilWire
from tactile_lab.bench import CoilLimits
from tactile_lab.errors import LimitError
from tactile_lab.instruments.serial_dialect import CoilDialect, ListMode
from tactile_lab.quantity import show


def check_list(
    currents: Sequence[float], dwell: float, limits: CoilLimits, row: CoilDialect
) -> ListMode:
    """Refuse a list that may not be played; the row's list mode otherwise.

    Args:
        currents: A, one per point; the last must be 0.
        dwell: time of each point, s.
        limits: in force.
        row: the source's dialect.

    Raises:
        LimitError: the model has no list mode, or a current, step, time or length is
            beyond a limit.
    """
    mode = row.list
    if mode is None:
        raise LimitError(
            f"{row.title} has no list mode; play the waveform by host time, or use an "
            "external waveform generator."
        )
    if not mode.shortest <= dwell <= mode.longest:
        raise LimitError(
            f"A dwell of {show(dwell, 's')} cannot be played; the source takes "
            f"{show(mode.shortest, 's')} to {show(mode.longest, 's')}."
        )
    if not 1 <= len(currents) <= mode.max_points:
        raise LimitError(
            f"A list of {len(currents)} points cannot be played; the source takes 1 to "
            f"{mode.max_points}."
        )
    for current in currents:
        check_current(current, limits, row)
    if currents[-1] != 0.0:
        raise LimitError(
            f"The list ends at {show(currents[-1], 'A')}; it must end at 0 A, because "
            "its last point lasts until someone stops it."
        )
    steepest = max(abs(b - a) for a, b in pairwise((0.0, *currents)))
    if steepest > limits.slew * dwell * (1 + 1e-9):
        raise LimitError(
            f"A step of {show(steepest, 'A')} in {show(dwell, 's')} exceeds the slew "
            f"limit of {show(limits.slew, 'A/s')}. Use smaller or longer steps."
        )
    return mode


def upload(
    wire: CoilWire, mode: ListMode, currents: Sequence[float], dwell: float
) -> None:
    """Send a checked list, to be played once; each line is verified."""
    digits = wire.dialect.digits
    for line in mode.clear:
        wire.command(line)
    template = mode.points
    for first in range(0, len(currents), mode.points_per_line):
        part = currents[first : first + mode.points_per_line]
        values = ",".join(f"{round(i, digits) + 0.0:.{digits}f}" for i in part)
        wire.command(template.format(values=values))
        template = mode.append or mode.points
    wire.command(mode.dwell.format(t=dwell))
    wire.command(mode.count.format(n=1))
