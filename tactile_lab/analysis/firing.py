"""V_C2 at measured spikes by the model, taken from a solution slice by slice.

It is set to V_reset at one spike; what it misses V_fire by at the next tells of the
parameters, as `tactile_lab.analysis.evidence` says.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.equations import I_C

if TYPE_CHECKING:
    from tactile_lab.model.solution import Solution

STEP = 1e-3
"""I_C is integrated between spikes in steps no longer than this, s."""
AT_ONCE = 256
"""Pairs whose currents are held at once."""


class Firing:
    """V_C2 at each later spike, from V_reset at the earlier one, less V_fire.

    Taken from slices that keep V_C1, as they come.

    Args:
        circuit: of the slices.
        earlier: of each pair the earlier spike, s, ascending.
        straight: of each, ends and middles of steps to the later one.
        until: end of the last slice, s.

    Attributes:
        misses: shape (pairs,), V; known once all slices were taken.
    """

    def __init__(
        self,
        circuit: Circuit,
        earlier: FloatArray,
        straight: Sequence[FloatArray],
        until: float,
    ) -> None:
        self._circuit, self._until = circuit, until
        self._earlier, self._straight = earlier, straight
        self._later = np.array([grid[-1] for grid in straight])
        self._parts: list[Solution] = []
        self._taken, self.misses = 0, np.empty(len(straight))

    def take(self, part: Solution) -> None:
        """The pairs that the next slice completes."""
        self._parts.append(part)
        stop = self._later.size
        if part.end < self._until:
            stop = int(np.searchsorted(self._later, part.end, side="right"))
        while self._taken < stop:
            self._fire(min(stop, self._taken + AT_ONCE))
        begin = self._earlier[stop] if stop < self._later.size else np.inf
        self._parts = [p for p in self._parts if p.end > begin]

    def _fire(self, stop: int) -> None:
        """Those before number `stop` that were not yet taken."""
        circuit, pairs = self._circuit, slice(self._taken, stop)
        grids = self._between(pairs)
        current = charging(circuit, self._V_C1(np.concatenate(grids)))
        at = 0
        for i, grid in enumerate(grids, self._taken):
            flowing = current[at : at + grid.size]
            at += grid.size
            left = np.exp((grid - grid[-1]) / circuit.tau_L)
            charge = _simpson(flowing * left, grid) / circuit.C2
            kept = circuit.reset_voltage * left[0]
            self.misses[i] = charge + kept - circuit.fire_voltage
        self._taken = stop

    def _between(self, pairs: slice) -> list[FloatArray]:
        """Their steps, parted where the force bends."""
        bends = np.concatenate([part.force.time for part in self._parts])
        straight = self._straight[pairs]
        first = np.searchsorted(bends, self._earlier[pairs], side="right")
        last = np.searchsorted(bends, self._later[pairs])
        return [
            grid if i >= j else steps_between(grid[0], grid[-1], bends[i:j])
            for grid, i, j in zip(straight, first, last, strict=True)
        ]

    def _V_C1(self, time: FloatArray) -> FloatArray:
        """Node A at times, s, ascending, within the slices that are kept, V."""
        cuts = np.searchsorted(time, [p.end for p in self._parts[:-1]])
        inside = zip(self._parts, np.split(time, cuts), strict=True)
        return np.concatenate([part.sample("V_C1", t) for part, t in inside])


def charging(circuit: Circuit, V_C1: FloatArray) -> FloatArray:
    """Current that charges C2, A."""
    return np.asarray(I_C(circuit, V_C1) + circuit.I_bias)


def steps_between(
    start: float, end: float, bends: FloatArray | None = None
) -> FloatArray:
    """Ends and middles of steps from `start` to `end` s; one ends at each of `bends`.

    I_C bends where the force does, which a step across that would miss.
    """
    even = np.linspace(start, end, max(4, math.ceil((end - start) / (2 * STEP))) + 1)
    ends = even if bends is None else np.union1d(even, bends)
    return np.insert(ends, np.arange(1, ends.size), (ends[1:] + ends[:-1]) / 2)


def _simpson(values: FloatArray, grid: FloatArray) -> float:
    """Integral over steps whose ends and middles `grid` holds in turn."""
    each = values[:-2:2] + 4 * values[1:-1:2] + values[2::2]
    return float(np.diff(grid[::2]) @ each / 6)
