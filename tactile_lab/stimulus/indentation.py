"""A force on top of an indentation: down, something on it, and up again, all smooth."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import TypeVar

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import ParameterError
from tactile_lab.quantity import show
from tactile_lab.waveform import Waveform

T = TypeVar("T")

FINEST = 2.5e-4
"""Shortest time between two points of a smooth force, s."""

IN_ONE_RISE, IN_ONE_CYCLE = 64, 96
"""Points a smooth rise, and a cycle, are drawn with: within 0.06 % of the curve."""

MOST_POINTS = 200_000
"""Points of one force, which are computed in the plan: a minute and a half at 20 Hz."""


def rise(level: float, lasts: float) -> Waveform:
    """From 0 to `level` N in `lasts` s as a raised cosine."""
    points = max(2, min(IN_ONE_RISE, math.ceil(lasts / FINEST)))
    part = np.arange(points + 1) / points
    return Waveform(lasts * part, level * (1 - np.cos(np.pi * part)) / 2)


def fall(level: float, lasts: float) -> Waveform:
    """From `level` N to 0 in `lasts` s as a raised cosine."""
    up = rise(level, lasts)
    return Waveform(up.time, up.value[::-1])


def on_indentation(
    base: float,
    over: Callable[[FloatArray], FloatArray],
    *,
    down: float,
    lasts: float,
    rest: float,
    highest: float,
) -> tuple[Waveform, tuple[float, float]]:
    """A force `over` an indentation of `base` N, and when that acts.

    It comes and goes within a tenth of its time, so that it starts without a kink.

    Args:
        base: N.
        over: N at times from 0 to `lasts` s.
        down: time to get down, and up again, s.
        lasts: s.
        rest: at no force afterwards, s.
        highest: frequency in `over` that must be followed, Hz.

    Returns:
        The force; and start and end, s, of the part where `over` acts in full.

    Raises:
        ParameterError: it has too many points.
    """
    spacing = max(FINEST, min(1 / (IN_ONE_CYCLE * highest), lasts / IN_ONE_CYCLE))
    count = max(IN_ONE_CYCLE, math.ceil(lasts / spacing))
    if count > MOST_POINTS:
        raise ParameterError(
            f"{show(lasts, 's')} of a force with details of {show(highest, 'Hz')} is "
            f"{count:.2g} points; {MOST_POINTS} are the most. Ask for less time."
        )
    time = lasts * np.arange(count + 1) / count
    soft = lasts / 10
    edge = np.clip(np.minimum(time, lasts - time) / soft, 0.0, 1.0)
    value = base + over(time) * (1 - np.cos(np.pi * edge)) / 2
    value[[0, -1]] = base
    wave = rise(base, down).then(Waveform(time, value)).then(fall(base, down))
    if rest > 0:
        wave = wave.then(Waveform.through([(0.0, 0.0), (rest, 0.0)]))
    return wave, (down + soft, down + lasts - soft)


def turned_over(number: int) -> bool:
    """Whether presentation `number`, from 0, begins half a cycle later in its stimulus.

    The sensor has a rhythm of its own, which begins with each indentation. Were all
    alike, it would come at the same phases each time, and be taken for the stimulus's.
    Half of them are turned over, by pairs: what the film remembers changes meanwhile.
    """
    return (number + 1) // 2 % 2 == 1


def balanced(each: Iterable[tuple[bool, T]]) -> list[T]:
    """As many that were turned over as others: the first of each.

    One more of either, of an odd number or of a run cut short, would leave a part of
    the sensor's own rhythm in what is to cancel it.

    Args:
        each: whether it was turned over, and what it gave.
    """
    both: dict[bool, list[T]] = {False: [], True: []}
    for turned, one in each:
        both[turned].append(one)
    pairs = min(len(both[False]), len(both[True]))
    return both[False][:pairs] + both[True][:pairs]
