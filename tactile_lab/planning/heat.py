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
    a, b, spans = bent.value[:-1], bent.value[1:], np.diff(bent.time)
    warm = np.maximum(np.abs(a), np.abs(b)) > bound * (1 + 1e-12)
    gains = spans * np.where(warm, (a * a + a * b + b * b) / 3 - bound * bound, 0.0)
    kept = np.where(warm, 1.0, np.exp(-spans / limits.recovery))
    rows = np.column_stack([bent.time[1:], spans, gains, kept])[spans > 0]
    for end, span, gain, part in rows.tolist():
        used = used * part + max(gain, 0.0)
        most = max(most, used)
        if gain > 0 and used > limits.heat and spent is None:
            spent = end - span * min((used - limits.heat) / gain, 1.0)
    return used, most, spent
