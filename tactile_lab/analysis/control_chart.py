"""Shewhart's chart of single values: is a quantity the same as it was for months?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.errors import ParameterError
from tactile_lab.quantity import ROUNDING

WIDTH = 2.66
"""Mean moving ranges of two from the mean to a limit: three standard deviations of
normal values (NIST/SEMATECH e-Handbook of Statistical Methods, 6.3.2.2)."""
LEAST = 8
"""Fewest values that say what is usual."""
RUN = 8
"""So many on one side of the mean in a row are a drift (Western Electric, rule 4)."""


@dataclass(frozen=True, eq=False)
class ControlChart:
    """What is usual of values in order of time, and which are not.

    Attributes:
        mean: of all of them.
        low, high: limits.
        outside: indices of values beyond them.
        drifting: indices of values that end eight or more on one side of the mean.
    """

    mean: float
    low: float
    high: float
    outside: tuple[int, ...]
    drifting: tuple[int, ...]


def control_chart(values: ArrayLike) -> ControlChart:
    """The chart of single values in order of time, shape (n,), n at least 8.

    Raises:
        ParameterError: fewer values, or one that is not finite.
    """
    found = np.asarray(values, dtype=np.float64)
    if found.size < LEAST or not np.isfinite(found).all():
        raise ParameterError(
            f"{found.size} values; at least {LEAST} finite ones say what is usual."
        )
    mean = float(found.mean())
    reach = WIDTH * float(np.abs(np.diff(found)).mean())
    off = found - mean
    off[np.abs(off) <= ROUNDING * abs(mean)] = 0.0
    side = np.sign(off)
    length, drifting = 0, []
    for i, here in enumerate(side):
        length = length + 1 if i and here == side[i - 1] and here else 1
        if length >= RUN:
            drifting.append(i)
    beyond = np.flatnonzero(np.abs(off) > reach)
    return ControlChart(
        mean,
        mean - reach,
        mean + reach,
        tuple(map(int, beyond)),
        tuple(drifting),
    )


def mean_and_error(values: Sequence[float]) -> tuple[float, float]:
    """Mean and standard error of the mean; the error is NaN of one value."""
    found = np.asarray(values)
    spread = found.std(ddof=1) if found.size > 1 else math.nan
    return float(found.mean()), float(spread / math.sqrt(found.size))
