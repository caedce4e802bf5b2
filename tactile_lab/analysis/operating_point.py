"""V_GS from the critical force: far sharper than from the rest V_C1."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from tactile_lab.errors import NotIdentifiableError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.quantity import show
from tactile_lab.waveform import Waveform

REACH = 0.15
"""How far V_GS is looked for to either side of the believed one, V."""
CLOSE = 2e-5
"""Width at which the search ends, V."""


def V_GS_of_onset(
    circuit: Circuit, silent: Waveform, fires: Waveform, force_error: float = 0.0
) -> tuple[float, float]:
    """Least and largest V_GS with which the model agrees with two trials from rest, V.

    Args:
        circuit: all else; its V_GS is where the search begins.
        silent: strongest force, N(t), that gave no spike.
        fires: weakest force, N(t), that gave one.
        force_error: of both forces alike (95 %), N; widens the interval.

    Raises:
        NotIdentifiableError: none within 0.15 V of the believed V_GS agrees.
    """

    def spikes(V_GS: float, force: Waveform) -> bool:
        found = simulate(
            replace(circuit, V_GS=V_GS), force, keep=("spikes",), tolerance=1e-6
        ).spike_times
        return found is not None and found.size > 0

    low = _edge(lambda V: spikes(V, fires), circuit.V_GS)
    high = _edge(lambda V: spikes(V, silent), circuit.V_GS)
    if low > high:
        raise NotIdentifiableError(
            f"the weakest force that fired asks for a V_GS above {show(low, 'V', 6)}, "
            f"the strongest silent one for less than {show(high, 'V', 6)}"
        )
    wider = abs(circuit.k_F) * force_error
    return low - wider, high + wider


def _edge(fires: Callable[[float], bool], middle: float) -> float:
    """The V_GS above which it fires."""
    low, high = middle - REACH, middle + REACH
    if fires(low) or not fires(high):
        raise NotIdentifiableError(
            f"no V_GS from {show(low, 'V')} to {show(high, 'V')} explains it"
        )
    for _ in range(math.ceil(math.log2((high - low) / CLOSE))):
        tried = (low + high) / 2
        low, high = (low, tried) if fires(tried) else (tried, high)
    return (low + high) / 2
