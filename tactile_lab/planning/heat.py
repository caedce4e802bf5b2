"""Heat of the coil along a planned current, as the driver's interlock counts it."""

from __future__ import annotations

import math

import numpy as np

from tactile_lab.bench import CoilLimits
from tactile_lab.waveform import Waveform

COLD = 0.01
"""Share of its heat budget at which a coil counts as cold."""


def cool_down(used: float, limits: CoilLimits) -> float:
    """Time without current until a coil that used heat counts as cold, s.

    Args:
        used: heat, A^2 s.
        limits: budget and recovery.
    """
    if used <= COLD * limits.heat:
        return 0.0
    return limits.recovery * math.log(used / (COLD * limits.heat))


def heat_left(time: float, limits: CoilLimits) -> float:
    """Heat of a coil that counts as cold in `time` s, A^2 s; 0 where it does now."""
    if time <= 0:
        return 0.0
    return COLD * limits.heat * math.exp(time / limits.recovery)


def heat_along(
    current: Waveform, limits: CoilLimits, used: float = 0.0
) -> tuple[float, float, float | None]:
    """The leaky I^2 t integral above the continuous current.

    Above `limits.continuous` it grows by I^2 - continuous^2; below, it falls with
    `limits.recovery`.

    Args:
        current: A against s.
        limits: continuous current, budget and recovery.
        used: heat already there at the start, A^2 s.

    Returns:
        Heat at the end, its largest value (A^2 s), and when the budget is spent (s),
        None if it never is.
    """
    most, spent, bound = used, None, limits.continuous
    bent = current.with_points_at(np.array([-bound, bound]))
    pieces = np.diff(bent.time) > 0
    a, b, spans = bent.value[:-1][pieces], bent.value[1:][pieces], np.diff(bent.time)
    end, spans = bent.time[1:][pieces], spans[pieces]
    warm = np.maximum(np.abs(a), np.abs(b)) > bound * (1 + 1e-12)
    gains = spans * np.where(warm, (a * a + a * b + b * b) / 3 - bound * bound, 0.0)
    gains = np.maximum(gains, 0.0)
    turns = np.flatnonzero(np.diff(warm)) + 1  # it warms or cools for many in a row
    for part in np.split(np.arange(spans.size), turns):
        if not part.size:
            continue
        if not warm[part[0]]:
            used *= math.exp(-float(spans[part].sum()) / limits.recovery)
            continue
        along = used + np.cumsum(gains[part])
        over = np.flatnonzero((along > limits.heat) & (gains[part] > 0))
        if over.size and spent is None:
            first = part[over[0]]
            beyond = (along[over[0]] - limits.heat) / gains[first]
            spent = float(end[first] - spans[first] * min(beyond, 1.0))
        used = float(along[-1])
        most = max(most, used)
    return used, most, spent
