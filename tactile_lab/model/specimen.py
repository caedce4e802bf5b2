"""One specimen of the circuit: its parts within their makers' tolerances."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from tactile_lab.model.circuit import Circuit

RESISTOR, CAPACITOR = 0.01, 0.05
"""Two standard deviations of a resistor and of a capacitor, as a part of each."""
V_GS, V_TH = 2e-3, 5e-3
"""Two standard deviations of the voltages set by hand and by the PUT, V."""


def specimen(circuit: Circuit, number: int) -> Circuit:
    """The circuit as specimen `number` has it; 0: as its parts are marked.

    The same number is always the same specimen. All values are drawn from normal
    distributions, two standard deviations of which are the tolerances above.
    """
    if number == 0:
        return circuit
    made = np.random.default_rng(number)

    def near(value: float, band: float) -> float:
        return float(value + made.normal(0, band / 2))

    parts: dict[str, Any] = {
        name: near(1.0, tolerance) * getattr(circuit, name)
        for tolerance, names in (
            (RESISTOR, ("R1", "R2", "R3", "R_L", "R_k")),
            (CAPACITOR, ("C1", "C2")),
        )
        for name in names
    }
    parts |= {"V_GS": near(circuit.V_GS, V_GS), "V_th": near(circuit.V_th, V_TH)}
    if circuit.V_fire is not None:
        parts["V_fire"] = near(circuit.V_fire, V_TH)
    return replace(circuit, **parts)
