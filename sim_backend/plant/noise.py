"""Noise of the circuit itself: of its sources, the mains' hum on the gate, of V_fire.

All of it depends on absolute time or on the spike's number alone, so that a simulation
does not depend on how the scope slices time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.waveform import Waveform

STEP = 2e-3
"""Between two values of the sources' noise, s: it is white up to 250 Hz."""
LENGTHS = 8191, 8179
"""Of two tables, whose sum repeats after as many values as their product: 37 h."""


@dataclass(frozen=True, kw_only=True)
class SensorNoise:
    """What makes the circuit irregular; a 0 switches a part off.

    Attributes:
        V_fire: standard deviation of V_fire from spike to spike, V.
        V_GS: standard deviation of the gate's source, V.
        current: standard deviation of the current source, A.
        hum: amplitude of the mains' hum on the gate, V.
    """

    V_fire: float = 0.0
    V_GS: float = 0.0
    current: float = 0.0
    hum: float = 0.0

    @property
    def of_force(self) -> bool:
        """Whether anything acts as a force does."""
        return max(self.V_GS, self.current, self.hum) > 0


class NoiseSource:
    """The values of one seed.

    Args:
        noise: how large.
        seed: of all of it.
        k_F: gate voltage that acts like a force, V/N: fast against the film's leakage,
            V_GS and V_P are one.
        newtons_per_ampere: force of the coil current, N/A.
        mains: frequency of the hum, Hz.
    """

    def __init__(
        self,
        noise: SensorNoise,
        seed: int,
        k_F: float,
        newtons_per_ampere: float,
        mains: float,
    ) -> None:
        made = np.random.default_rng((seed, 0x5E))
        self._tables = [made.standard_normal(n) / math.sqrt(2) for n in LENGTHS]
        self._fire = made.standard_normal(LENGTHS[0])
        self._V_fire, self._mains = noise.V_fire, mains
        self._hum = noise.hum / abs(k_F)
        self._force = math.hypot(
            noise.V_GS / abs(k_F), noise.current * newtons_per_ampere
        )

    def on(self, force: Waveform) -> Waveform:
        """The force with what acts like one added, N."""
        if force.end <= force.start:
            return force
        first, last = math.ceil(force.start / STEP), math.floor(force.end / STEP)
        ticks = np.arange(first, last + 1)
        time = np.union1d(force.time, ticks * STEP)
        return Waveform(time, force.at(time) + self._at(time))

    def _at(self, time: FloatArray) -> FloatArray:
        """Straight between ticks, N."""
        left = np.floor(time / STEP).astype(np.int64)
        part = time / STEP - left
        one, two = self._tick(left), self._tick(left + 1)
        return one + part * (two - one)

    def _tick(self, tick: np.ndarray) -> FloatArray:
        one, two = self._tables
        white = self._force * (one[tick % one.size] + two[tick % two.size])
        turn = 2 * math.pi * self._mains * STEP * tick
        return np.asarray(white + self._hum * np.sin(turn))

    def V_fire(self, spike: int, volts: float, least: float) -> float:
        """Voltage at which spike number `spike` comes, V, above `least` V.

        Args:
            spike: from 0.
            volts: without noise, V.
            least: V_reset, V.
        """
        off = self._V_fire * float(self._fire[spike % self._fire.size])
        return max(volts + off, least + 0.1 * (volts - least))
