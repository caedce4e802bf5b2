"""One specimen of the circuit: its parts within their makers' tolerances."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model.circuit import Circuit

RESISTOR, CAPACITOR = 0.01, 0.05
"""Two standard deviations of a resistor and of a capacitor, as a part of each."""
V_GS, V_TH = 2e-3, 5e-3
"""Two standard deviations of the voltages set by hand and by the PUT, V."""
LARGEST_DRAW = 12.3
"""No number that numpy draws from a normal distribution lies more standard deviations
off: its tail is x with x^2 < -2 ln(2^-53) beyond 3.654."""


def parts(circuit: Circuit, numbers: Iterable[int]) -> dict[str, FloatArray]:
    """The parts of specimens that differ from the marked ones, by name.

    The same number is always the same specimen. All values are drawn from normal
    distributions, two standard deviations of which are the tolerances above.

    Args:
        circuit: as its parts are marked.
        numbers: of the specimens, from 1.

    Returns:
        SI, each of shape (numbers,).
    """
    bands = _bands(circuit)
    drawn = np.array(
        [np.random.default_rng(n).standard_normal(len(bands)) for n in numbers]
    )
    return _off(circuit, bands, drawn)


def outermost(circuit: Circuit, names: tuple[str, ...]) -> dict[str, FloatArray]:
    """The corners of a box in which these parts of every specimen lie.

    Args:
        circuit: as its parts are marked.
        names: of parts; those that do not differ are left aside.

    Returns:
        SI, each of shape (corners,).
    """
    bands = {name: band for name, band in _bands(circuit).items() if name in names}
    ends = np.array(list(product((-LARGEST_DRAW, LARGEST_DRAW), repeat=len(bands))))
    return _off(circuit, bands, ends)


def _bands(circuit: Circuit) -> dict[str, float]:
    """Two standard deviations of each part that differs, by its name."""
    bands = {name: RESISTOR for name in ("R1", "R2", "R3", "R_L", "R_k")}
    bands |= {name: CAPACITOR for name in ("C1", "C2")}
    bands |= {"V_GS": V_GS, "V_th": V_TH}
    if circuit.V_fire is not None:
        bands["V_fire"] = V_TH
    return bands


def _off(
    circuit: Circuit, bands: dict[str, float], deviations: FloatArray
) -> dict[str, FloatArray]:
    """The parts so many standard deviations off, SI; deviations: (n, bands)."""
    off = deviations * (np.array(list(bands.values())) / 2)
    return {
        name: getattr(circuit, name) + column
        if name.startswith("V")
        else getattr(circuit, name) * (1.0 + column)
        for name, column in zip(bands, off.T, strict=True)
    }


def specimen(circuit: Circuit, number: int) -> Circuit:
    """The circuit as specimen `number` has it; 0: as its parts are marked."""
    if number == 0:
        return circuit
    made: dict[str, Any] = {
        name: float(values[0]) for name, values in parts(circuit, [number]).items()
    }
    return replace(circuit, **made)
