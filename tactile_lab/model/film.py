"""The film's voltage V_P along the forces it feels: Eq. (7), piece by piece."""

from __future__ import annotations

from tactile_lab.model.circuit import Circuit
from tactile_lab.model.equations import V_P
from tactile_lab.waveform import Waveform


class Film:
    """What the film remembers of the forces so far; from rest at 0 s.

    Attributes:
        force: that it feels since the last waveform's end, N.
    """

    def __init__(self, circuit: Circuit) -> None:
        self.force = 0.0
        self._circuit = circuit
        self._V_P, self._at = 0.0, 0.0

    def V_P(self, time: float) -> float:
        """V_P at `time` s, after all that was felt, V."""
        return V_P(self._circuit, self._V_P, 0.0, max(time - self._at, 0.0))

    def feels(self, force: Waveform, begin: float) -> None:
        """Take in `force`, N against s from `begin` s on, later than all before."""
        circuit = self._circuit
        volts = self.V_P(begin) + circuit.k_F * (float(force.value[0]) - self.force)
        for start, end, low, high in force.segments():
            if end > start:
                slope = (high - low) / (end - start)
                volts = V_P(circuit, volts, slope, end - start)
            else:
                volts += circuit.k_F * (high - low)
        self._V_P, self._at = volts, begin + force.end
        self.force = float(force.value[-1])
