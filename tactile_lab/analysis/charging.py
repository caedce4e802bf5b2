"""C2 between two spikes, charged by what V_GS + V_P(t) lets through, Eqs. (17), (18).

Node A follows the drive V_GS + V_P by its time constant, some 6 ms, so T1's current is
a function of what the drive was so long before, to second order of that over tau. Where
T1 saturates it is not, and nothing here holds.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.equations import I_C, rest_V_C1

Drive = Callable[[FloatArray], FloatArray]
"""V_GS + V_P, V, at times of any shape, s."""

REACH = 1.2
"""The drive is known from so much below V_GS to as much above it, V."""
GRID = 1201
"""Points at which node A is solved: it is straight in I_DS, but for exp(-V_C1/V_T)."""
FINER = 16
"""And so many times more at which T1's current is computed, straight between them:
without R3 it grows by an eighth from one of the others to the next."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


class Charging:
    """The integrator of one circuit.

    Attributes:
        circuit: whose V_GS the drive replaces.
    """

    def __init__(self, circuit: Circuit) -> None:
        self.circuit = circuit
        solved = np.linspace(-REACH, REACH, GRID)
        V_P = np.linspace(-REACH, REACH, FINER * (GRID - 1) + 1)
        I_DS, known = (np.exp(v / (circuit.m * circuit.V_T)) for v in (V_P, solved))
        V_C1 = np.interp(I_DS, known, [rest_V_C1(circuit, float(v)) for v in solved])
        self._drive = circuit.V_GS + V_P
        self._current = I_C(circuit, V_C1) + circuit.I_bias

    def current(self, drive: FloatArray) -> FloatArray:
        """Into C2 at that drive, V, A."""
        current: FloatArray = np.interp(drive, self._drive, self._current)
        return current

    def drive(self, current: FloatArray) -> FloatArray:
        """The drive, V, that lets so much through, A."""
        drive: FloatArray = np.interp(current, self._current, self._drive)
        return drive

    def rate(self, drive: FloatArray) -> FloatArray:
        """Eq. (15) at a drive, V, Hz; 0 where C2 is never charged to V_fire."""
        c = self.circuit
        target = c.R_L * self.current(drive)
        above = np.maximum(target - c.fire_voltage, 0.0)
        with np.errstate(divide="ignore"):
            charging = c.tau_L * np.log((target - c.reset_voltage) / above)
        rate: FloatArray = 1 / (c.reset_time + charging)
        return rate

    def charged(self, drive: Drive, start: FloatArray, end: FloatArray) -> FloatArray:
        """V_C2 at `end` after a spike at `start`, s, without firing meanwhile, V."""
        c = self.circuit
        begin = start + c.reset_time
        half = (end - begin) / 2
        at = (begin + half)[:, None] + half[:, None] * _NODES
        left = np.exp((at - end[:, None]) / c.tau_L)
        current = self.current(drive(at - c.tau_A))
        charge = np.sum(_WEIGHTS * current * left, axis=1) * half
        kept = c.reset_voltage * np.exp((begin - end) / c.tau_L)
        voltage: FloatArray = charge / c.C2 + kept
        return voltage
