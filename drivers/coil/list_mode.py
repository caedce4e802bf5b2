"""Loading a list of currents into a source, checked before and after.

A list runs on when this program dies, so it is always finite and ends at 0 A.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivers.coil.interlock import check_current
from drivers.coil.wire import CoilWire
from tactile_lab.bench import CoilLimits
from tactile_lab.current_list import CurrentList
from tactile_lab.errors import BadReplyError, LimitError, NoReplyError, RefusedError
from tactile_lab.instruments.serial_dialect import CoilDialect, ListMode
from tactile_lab.quantity import show

TRIES = 3
"""Times a line is sent whose answer is lost and which, as the count tells, was, too."""


def check_list(points: CurrentList, limits: CoilLimits, row: CoilDialect) -> ListMode:
    """Refuse a list that may not be played; the row's list mode otherwise.

    Args:
        points: the last must be 0 A.
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
    if not 1 <= len(points) <= mode.max_points:
        raise LimitError(
            f"A list of {len(points)} points cannot be played; the source takes 1 to "
            f"{mode.max_points}."
        )
    for dwell in (float(points.dwells.min()), float(points.dwells.max())):
        if not mode.shortest * (1 - 1e-9) <= dwell <= mode.longest * (1 + 1e-9):
            raise LimitError(
                f"A dwell of {show(dwell, 's')} cannot be played; the source takes "
                f"{show(mode.shortest, 's')} to {show(mode.longest, 's')}."
            )
    check_points(points, limits, row, row.grain)
    return mode


def check_points(
    points: CurrentList, limits: CoilLimits, row: CoilDialect, grain: float = 0.0
) -> None:
    """Refuse currents that may not be played, by whatever keeps their time.

    Args:
        points: the last must be 0 A.
        limits: in force.
        row: the source's dialect.
        grain: step to which the currents are rounded, A: a slope may seem so much
            steeper.

    Raises:
        LimitError: a current or step is beyond a limit, or they do not end at 0 A.
    """
    for current in points.currents:
        check_current(float(current), limits, row)
    if points.currents[-1] != 0.0:
        raise LimitError(
            f"The list ends at {show(float(points.currents[-1]), 'A')}; it must end at "
            "0 A, because its last point lasts until someone stops it."
        )
    grained = grain / float(points.dwells.min())
    if points.steepest > limits.fastest * (1 + 1e-3) + grained:
        raise LimitError(
            f"Steps of up to {show(points.steepest, 'A/s')} exceed the limit of "
            f"{show(limits.fastest, 'A/s')}. Use smaller or longer steps, or allow "
            "more by list_slew in [coil.limits] of the bench file."
        )


def load(wire: CoilWire, mode: ListMode, points: CurrentList) -> None:
    """Send a checked list, to be played once; each line and the count are verified.

    Raises:
        RefusedError: a line is refused, or the memory holds another number of points.
        NoReplyError, BadReplyError: answers are lost.
    """
    digits = wire.dialect.digits
    currents = [f"{wire.dialect.sent(i):.{digits}f}" for i in points.currents]
    dwells = [f"{t:.{mode.dwell_digits}f}" for t in points.dwells]
    if np.all(points.dwells == points.dwells[0]):
        dwells = dwells[:1]  # one stands for all
    for line in mode.clear:
        wire.command(line)
    _send(wire, mode, (mode.points, mode.points_query), currents)
    _send(wire, mode, (mode.dwells, mode.dwells_query), dwells)
    wire.command(mode.count.format(n=1))


def _send(
    wire: CoilWire, mode: ListMode, how: tuple[str, str | None], values: Sequence[str]
) -> None:
    """Append values by a template, a line at a time; a query counts what is held.

    A line whose answer was lost is sent again only if the count says that it never
    came: sent twice, its points would stand twice in the memory.
    """
    template, query = how
    for first in range(0, len(values), mode.points_per_line):
        part = values[first : first + mode.points_per_line]
        line = template.format(values=",".join(part))
        for _ in range(TRIES):
            try:
                wire.command_once(line)
                break
            except (NoReplyError, BadReplyError):
                if query is None:
                    raise
                held = wire.number(query)
                if held == first + len(part):
                    break
                if held != first:
                    raise _torn(held, first) from None
        else:
            raise NoReplyError(f"The source answered nothing to {line!r}, thrice.")
    if query is not None and (held := wire.number(query)) != len(values):
        raise _torn(held, len(values))


def _torn(held: float, wanted: int) -> RefusedError:
    return RefusedError(
        f"The source holds {held:g} points of a list of which it was sent {wanted}. "
        "Check the link, and try again."
    )
