"""Stress along a track, kept as series: who moves along it feels the same, shifted.

A rigid load that slides along x presses every taxel of a row with one curve, each at
another time. That curve, for strength 1, is cut into stretches as long as the taxels
are deep. No stress has a singularity nearer to the track than that depth, so a
polynomial through n Chebyshev points of a stretch errs by some (2 + sqrt 5)^-n of it
(L. N. Trefethen, Approximation Theory and Approximation Practice, 2013, theorem 8.2).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from tactile_lab.arrays import FloatArray
from tactile_lab.model.compiled import inner
from tactile_lab.skin.contact import stress

NODES = 16
"""Chebyshev points of a stretch: an error of some 1e-10 of the largest stress."""
KEPT = 1 << 16
"""Stretches of which a thread keeps the series: 10 MB."""
SAME = 1e-10
"""Tracks nearer to one another than so much of the depth are one."""

_angles = np.pi * (np.arange(NODES) + 0.5) / NODES
AT = np.cos(_angles)
"""The points, on [-1, 1]."""
_of_chebyshev = [np.cos(k * _angles) * (2.0 if k else 1.0) for k in range(NODES)]
_powers = [chebyshev.cheb2poly([0.0] * k + [1.0 / NODES]) for k in range(NODES)]
POWERS = np.stack([np.pad(p, (0, NODES - p.size)) for p in _powers], axis=1)
POWERS = POWERS @ np.stack(_of_chebyshev)
"""From values at these points to factors of the powers of x."""


class TrackSeries(NamedTuple):
    """Stretches in the memory of one thread, each where its own key says.

    Attributes:
        key: stimulus, track and stretch, shape (room, 3).
        factor: of the powers of x, -1 to 1 along the stretch, Pa for strength 1, shape
            (room, NODES).
        bend: the largest second derivative by x, shape (room,).
    """

    key: FloatArray
    factor: FloatArray
    bend: FloatArray

    @classmethod
    def none(cls, room: int = KEPT) -> TrackSeries:
        """None yet; room for a power of two of them."""
        return cls(np.full((room, 3), np.nan), np.empty((room, NODES)), np.empty(room))


@inner
def stress_of(
    rows: FloatArray, begin: int, end: int, strength: float, x: float, y: float,
    depth: float,
) -> float:  # fmt: skip
    """Pa of the loads from `begin` to `end`, at x, y, m, from their common place."""
    total = 0.0
    for i in range(begin, end):
        total += stress(rows[i], strength, x, y, depth)
    return total


@inner
def track_of(across: float, depth: float) -> float:
    """The number of the track that runs `across`, m, from a stimulus' centre."""
    return float(np.rint(across / (SAME * depth)))


@inner
def slot_of(
    series: Any, rows: FloatArray, begin: int, end: int, way_x: float, way_y: float,
    track: float, stretch: float, depth: float,
) -> int:  # fmt: skip
    """Where the series of a stretch is; it is made where it is not known yet.

    Args:
        series: what is known already.
        rows: loads, see `contact`.
        begin: the first of them.
        end: after the last.
        way_x: direction of the track; its cosine with the x axis.
        way_y: and its sine.
        track: see `track_of`.
        stretch: its number, from the stimulus' centre.
        depth: m.
    """
    key, factor = series.key, series.factor
    mixed = int(1e-3 * track) * 2654435761 + begin * 40503 + int(stretch)
    slot = int(mixed & (key.shape[0] - 1))
    if key[slot, 0] == begin and key[slot, 1] == track and key[slot, 2] == stretch:
        return slot
    key[slot, 0], key[slot, 1], key[slot, 2] = begin, track, stretch
    across = track * SAME * depth
    for k in range(NODES):
        factor[slot, k] = 0.0
    for n in range(NODES):
        u = (stretch + 0.5 + 0.5 * AT[n]) * depth
        x, y = u * way_x - across * way_y, u * way_y + across * way_x
        value = stress_of(rows, begin, end, 1.0, x, y, depth)
        for k in range(NODES):
            factor[slot, k] += POWERS[k, n] * value
    bend = 0.0
    for n in range(-NODES, NODES + 1):
        total = 0.0
        for k in range(NODES - 1, 1, -1):
            total = total * (n / NODES) + k * (k - 1) * factor[slot, k]
        bend = max(bend, abs(total))
    series.bend[slot] = bend
    return slot


@inner
def summed(factor: FloatArray, slot: int, x: float) -> float:
    """The series at x, Pa for strength 1."""
    x2 = x * x
    even, odd = factor[slot, NODES - 2], factor[slot, NODES - 1]
    for k in range(NODES - 4, -1, -2):
        even, odd = even * x2 + factor[slot, k], odd * x2 + factor[slot, k + 1]
    return float(even + odd * x)
