"""How much later a signal is recorded than one that it should follow."""

from __future__ import annotations

import math

import numpy as np

from tactile_lab.analysis.estimate import Estimate, correlated
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.waveform import Waveform

FEWEST = 8
"""Bins from which on a delay is told."""
APART = 1e-3
"""Part of the slope that must be no part of size and offset, or they are its delay."""


def delay(
    flow: Waveform, start: FloatArray, width: float, seen: FloatArray
) -> Estimate:
    """By how much bins show a signal later than `flow`, s; its size and offset free.

    To first order: it is small against the time in which `flow` bends.

    Args:
        flow: what the signal should be, in its unit.
        start: shape (n,), of each bin, s.
        width: of a bin, s.
        seen: shape (n,), the signal's mean in each.

    Raises:
        NotIdentifiableError: too few bins, or `flow` does not move in them, or what was
            seen does not move with it.
    """
    slope = (flow.at(start + width) - flow.at(start)) / width
    design = np.column_stack([flow.mean(start, width), np.ones_like(start), -slope])
    moves = float(np.linalg.norm(slope))
    left = slope - design[:, :2] @ (np.linalg.pinv(design[:, :2]) @ slope)
    if start.size < FEWEST or float(np.linalg.norm(left)) <= APART * moves:
        raise NotIdentifiableError(
            f"{start.size} bins of {width:g} s do not tell when it moved: {FEWEST} "
            "are needed, of its rest as well"
        )
    inverse = np.linalg.pinv(design)
    found = inverse @ seen
    size = float(found[0])
    if size <= 0:
        raise NotIdentifiableError("the signal does not follow what it should follow")
    left = seen - design @ found
    freedom = start.size - 3
    alike = correlated(left)
    scatter = math.sqrt(float(np.sum(left**2)) / freedom * alike)
    error = scatter * float(np.linalg.norm(inverse[2])) / size
    return Estimate.of(float(found[2]) / size, error, max(1, int(freedom / alike)))
