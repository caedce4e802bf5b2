"""Heat of the coil along a planned current, as the driver's interlock counts it."""

from __future__ import annotations

import itertools
import math

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
    most, spent = used, None
    bound = limits.continuous
    for t0, t1, i0, i1 in current.segments():
        for start, end, a, b in _split(t0, t1, i0, i1, bound):
            span = end - start
            if max(abs(a), abs(b)) <= bound * (1 + 1e-12):
                used *= math.exp(-span / limits.recovery)
                continue
            gain = span * ((a * a + a * b + b * b) / 3 - bound * bound)
            used += max(gain, 0.0)
            if used > limits.heat and spent is None:
                over = used - limits.heat
                spent = end - span * min(over / gain, 1.0) if gain > 0 else end
            most = max(most, used)
    return used, most, spent


def _split(
    t0: float, t1: float, i0: float, i1: float, bound: float
) -> list[tuple[float, float, float, float]]:
    """One segment cut where the magnitude of the current crosses `bound`."""
    if t1 <= t0:
        return []
    cuts = [0.0, 1.0]
    if i1 != i0:
        cuts += [
            part
            for level in (-bound, bound)
            if 0 < (part := (level - i0) / (i1 - i0)) < 1
        ]
    cuts.sort()
    span, rise = t1 - t0, i1 - i0
    return [
        (t0 + span * a, t0 + span * b, i0 + rise * a, i0 + rise * b)
        for a, b in itertools.pairwise(cuts)
    ]
