"""Do source and shunt agree? Averaged over each level of the applied current."""

from __future__ import annotations

import numpy as np

from tactile_lab.analysis.estimate import Estimate
from tactile_lab.store.applied import BEFORE, VISIBLE, AppliedCurrent, Shunt

LEVEL = 0.2
"""Levels that last so long are averaged over the shunt, s."""
SETTLING = 0.02
"""Beginning of a level that is left out of the average: the coil's lag, s."""


def shunt_over_source(applied: AppliedCurrent, shunt: Shunt) -> Estimate | None:
    """Slope of the averaged shunt over the read-back; an offset is allowed for.

    None where fewer than 3 levels were held long enough, or all were alike.
    """
    begin, level = applied.steps.T
    seen = []
    for i in np.flatnonzero(applied.ends - begin >= LEVEL):
        _, value = shunt(float(begin[i]) + SETTLING, float(applied.ends[i]) - BEFORE)
        if value.size:
            seen.append((level[i], float(value.mean())))
    if len(seen) < 3:
        return None
    source, mean = np.array(seen).T
    apart = source - source.mean()
    spread = float(np.sum(apart**2))
    if spread < VISIBLE**2:
        return None
    slope = float(np.sum(apart * mean) / spread)
    left = mean - mean.mean() - slope * apart
    freedom = source.size - 2
    error = float(np.sqrt(np.sum(left**2) / freedom / spread))
    return Estimate.of(slope, error, freedom)
