"""Axes of values that differ in late digits only: they stand less a round number."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from tactile_lab.plot import Panel
from tactile_lab.quantity import ROUNDING, show

ALIKE = 4
"""First digits that values have in common whose numbers would be too long."""


def from_near(panel: Panel) -> Panel:
    """The panel less a round number near its values, which the name of y then tells.

    Itself where its numbers are short as they are: 4.368, not 4.36877012.
    """
    across = [guide for guide in panel.guides if guide.along == "x"]
    values = [v for s in panel.series for v in (s.y, s.low, s.high)]
    values += [*panel.limits, *(end for g in across for end in (g.at, g.to))]
    known = np.concatenate([[], *(np.ravel(v) for v in values if v is not None)])
    known = known[np.isfinite(known)]
    from_0 = any(s.mark in ("filled", "cells") for s in panel.series)
    if from_0 or panel.log or panel.whole or not np.ptp(known if known.size else [0]):
        return panel
    low, high, largest = known.min(), known.max(), np.abs(known).max()
    if high - low <= ROUNDING * largest:  # one value, computed in several ways
        return replace(panel, limits=(low - 0.05 * largest, high + 0.05 * largest))
    last, first = (math.floor(math.log10(x)) for x in (high - low, largest))
    if first - last < ALIKE:
        return panel
    place = last + 1
    base = math.floor(low / 10.0**place) * 10.0**place

    def less(value: Any) -> Any:
        return None if value is None else np.subtract(value, base)

    return replace(
        panel,
        label=f"{panel.label} less {show(base, panel.unit, first - place + 1)}",
        prefix=None,
        series=tuple(
            replace(s, y=less(s.y), low=less(s.low), high=less(s.high))
            for s in panel.series
        ),
        guides=tuple(
            replace(g, at=less(g.at), to=less(g.to)) if g in across else g
            for g in panel.guides
        ),
        limits=(less(panel.limits[0]), less(panel.limits[1])),
    )
