"""The voltage follower between a node of the circuit and the scope's input.

A TL074 with a pole at 3 MHz and a slew rate of 13 V/us. Slow signals pass unchanged;
what it does to a spike and to the edge of a reset is computed once, as a pulse. Its
offset is added at the input, its input bias is part of the circuit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from tactile_lab.arrays import FloatArray

SETTLED = 14.0
"""Time constants after which what remains is below a millionth."""
CELLS = 1 << 13
"""Values of a pulse; between them it is straight."""
KEPT = 64
"""Pulses, of 64 kB each."""


@dataclass(frozen=True, eq=False)
class Pulse:
    """A voltage against time since an event; nothing before and after.

    Attributes:
        step: time between two values, s.
        value: shape (n,), V, at 0 s, step, 2 step, ...
    """

    step: float
    value: FloatArray

    @property
    def length(self) -> float:
        """Time after which nothing remains, s."""
        return self.step * (self.value.size - 1)

    @property
    def peak(self) -> float:
        """Largest value, V."""
        return float(self.value.max())

    def width(self, threshold: float) -> float:
        """Time it stays above `threshold` V, s, within a step; 0 if it never is."""
        return self.step * float(np.count_nonzero(self.value > threshold))


@dataclass(frozen=True)
class Follower:
    """A voltage follower's speed; a pole of 0 s and infinite slew are ideal.

    Attributes:
        pole: time constant, s.
        slew: largest rate of the output, V/s.
    """

    pole: float
    slew: float

    @classmethod
    def of(cls, bandwidth: float, slew: float) -> Follower:
        """By its bandwidth, Hz, 0 for an ideal one, and slew rate, V/s."""
        return cls(1 / (2 * math.pi * bandwidth), slew) if bandwidth else IDEAL

    def spike(self, amplitude: float, decay: float) -> Pulse | None:
        """Output for an input that jumps to `amplitude` V and decays with `decay` s."""
        return _spike(self, amplitude, decay) if decay > 0 else None

    def edge(self, drop: float) -> Pulse | None:
        """Output less input after the input fell by `drop` V at once."""
        return _edge(self, drop) if self.pole > 0 else None


IDEAL = Follower(0.0, math.inf)

# kept: a bench is opened for every run, and its pulses are those of the one before


@lru_cache(KEPT)
def _spike(follower: Follower, amplitude: float, decay: float) -> Pulse:
    length = SETTLED * (decay + follower.pole) + abs(amplitude) / follower.slew
    step = length / CELLS
    ideal = amplitude * np.exp(-np.arange(CELLS + 1) * step / decay)
    return _unchanged(step, _followed(follower, ideal, step))


@lru_cache(KEPT)
def _edge(follower: Follower, drop: float) -> Pulse:
    step = (SETTLED * follower.pole + drop / follower.slew) / CELLS
    fallen = np.full(CELLS + 1, -drop)
    return _unchanged(step, _followed(follower, fallen, step) + drop)


def _unchanged(step: float, value: FloatArray) -> Pulse:
    value.flags.writeable = False  # all that ask for it have the same
    return Pulse(step, value)


def _followed(follower: Follower, wanted: FloatArray, step: float) -> FloatArray:
    """Output from 0 V: y' = (x - y)/pole, limited to +-slew."""
    if follower.pole == 0:
        return wanted
    output = np.empty(wanted.size)
    y, most = 0.0, follower.slew * step
    share = -np.expm1(-step / follower.pole)
    output[0] = y
    for i, x in enumerate(((wanted[1:] + wanted[:-1]) / 2).tolist(), start=1):
        y += min(max((x - y) * share, -most), most)
        output[i] = y
    return output
