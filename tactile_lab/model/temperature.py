"""What temperature does to the circuit: V_T = kT/q, and the saturation currents.

Both follow the law of a junction as SPICE has it (Nagel 1975; ngspice manual, diode
model: ``IS(T) = IS (T/T0)^(XTI/N) exp(EG/(N V_T0) (1 - T0/T))``), N = 1 for T1 and the
slope factor m for the PiezoFET, whose Eq. (1) has the same form.
"""

from __future__ import annotations

import math
from dataclasses import replace

from tactile_lab.errors import ParameterError
from tactile_lab.model.circuit import Circuit

VOLT_PER_KELVIN = 1.380649e-23 / 1.602176634e-19
"""k/q, V/K (SI)."""
GAP = 1.11
"""Band gap of silicon as SPICE has it, V."""
POWER = 3.0
"""Exponent of the temperature in a saturation current (XTI)."""
COLDEST, HOTTEST = 200.0, 400.0
"""Temperatures at which the laws are used, K."""


def temperature(circuit: Circuit) -> float:
    """The temperature that the circuit's V_T stands for, K; 290.1 K in Table 1."""
    return circuit.V_T / VOLT_PER_KELVIN


def at_temperature(circuit: Circuit, kelvin: float) -> Circuit:
    """The circuit as it is at another temperature than its V_T stands for.

    Raises:
        ParameterError: outside 200 K to 400 K.
    """
    if not COLDEST <= kelvin <= HOTTEST:
        raise ParameterError(
            f"A temperature of {kelvin:g} K is none a transistor's law holds at; give "
            f"{COLDEST:g} K to {HOTTEST:g} K."
        )
    ratio = kelvin / temperature(circuit)

    def risen(slope: float) -> float:
        barrier = GAP / (slope * circuit.V_T) * (1 - 1 / ratio)
        return float(ratio ** (POWER / slope) * math.exp(barrier))

    return replace(
        circuit,
        V_T=circuit.V_T * ratio,
        I_S=circuit.I_S * risen(circuit.m),
        I_T1s=circuit.I_T1s * risen(1.0),
    )
