"""A circuit with the force on it and our answer: what goes out as a model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import ParameterError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import Result, simulate
from tactile_lab.model.state import Start
from tactile_lab.waveform import Waveform

SIGNALS = ("spikes", "V_P", "V_C1", "I_C", "V_C2")


@dataclass(frozen=True, eq=False)
class Solved:
    """One simulation that other programs are to repeat.

    Attributes:
        title: for people.
        circuit: whose text is written.
        force: on it, N.
        result: our answer.
    """

    title: str
    circuit: Circuit
    force: Waveform
    result: Result

    @classmethod
    def of(
        cls,
        circuit: Circuit,
        force: Waveform,
        until: float | None = None,
        *,
        start: Start | None = None,
        title: str = "Tactile sensor",
    ) -> Solved:
        """Simulate as `simulate` does, keeping what the formats need.

        Raises:
            ParameterError: T1 saturates, which these formats cannot hold.
            SolverError: the model cannot answer.
        """
        if circuit.saturation:
            raise ParameterError(
                "saturation = true: V_C2 acts back on T1, and a reset changes its "
                "current at once, which neither NIR nor these equations for Brian2 and "
                "NESTML hold; leave saturation out."
            )
        result = simulate(circuit, force, keep=SIGNALS, until=until, start=start)
        return cls(title, circuit, force, result)

    @property
    def spikes(self) -> FloatArray:
        """Our spike times, s."""
        return self.result.solution.spike_times

    @property
    def first(self) -> dict[str, float]:
        """Voltages, V, and T1's current, A, at time 0."""
        names = ("V_P", "V_C1", "I_C", "V_C2")
        return {n: float(self.result.sample(n, np.zeros(1))[0]) for n in names}

    @property
    def parameters(self) -> dict[str, float]:
        """Of the circuit by the paper's names, SI; what `firing` sets is resolved."""
        c = self.circuit
        names = "I_S V_GS m V_T tau R1 R2 R3 R_L C1 C2 V_S I_T1s I_bias k_F"
        return {n: float(getattr(c, n)) for n in names.split()} | {
            "V_fire": c.fire_voltage,
            "V_reset": c.reset_voltage,
            "t_eps": c.reset_time,
        }
