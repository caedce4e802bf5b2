"""V_GS from the critical force: far sharper than from the rest V_C1."""

from __future__ import annotations

import math
from collections.abc import Collection
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
    circuit: Circuit,
    silent: Waveform,
    fires: Waveform,
    force_error: float = 0.0,
    displaced: Collection[Circuit] = (),
) -> tuple[float, float]:
    """Least and largest V_GS with which the model agrees with two trials from rest, V.

    The truth lies anywhere between the two trials; with either error this is a 95 %
    interval. A lag of the force delays the onset and moves no V_GS: it is left out.

    Args:
        circuit: all else; its V_GS is where the search begins.
        silent: strongest force, N(t), that gave no spike.
        fires: weakest force, N(t), that gave one.
        force_error: of both forces alike (95 %), N; widens the interval.
        displaced: the circuit with each thing that is not known of it at the end of its
            95 % band; widens it likewise.

    Raises:
        NotIdentifiableError: none within 0.15 V of the believed V_GS agrees, or all do
            with one of the trials.
    """
    weakest = "the weakest force that fired"
    low = _edge(circuit, fires, weakest)
    high = _edge(circuit, silent, "the strongest silent one")
    if low > high:
        raise NotIdentifiableError(
            f"{weakest} asks for a V_GS above {show(low, 'V', 6)}, "
            f"the strongest silent one for less than {show(high, 'V', 6)}"
        )
    moved = [_edge(other, fires, weakest) - low for other in displaced]
    half = (high - low) / 2
    wider = math.hypot(half, circuit.k_F * force_error, *moved) - half
    return low - wider, high + wider


def _edge(circuit: Circuit, force: Waveform, which: str) -> float:
    """The V_GS above which it fires under a force, of that name."""
    # whether it fires is asked, not how often: without R3 that is without bound
    once = replace(circuit, t_eps=force.end - force.start)

    def fires(V_GS: float) -> bool:
        found = simulate(
            replace(once, V_GS=V_GS), force, keep=("spikes",), tolerance=1e-6
        ).spike_times
        return found is not None and found.size > 0

    low, high = circuit.V_GS - REACH, circuit.V_GS + REACH
    always = fires(low)
    if always or not fires(high):
        raise NotIdentifiableError(
            f"under {which} it {'fires' if always else 'is silent'} by the model with "
            f"each V_GS from {show(low, 'V')} to {show(high, 'V')}"
        )
    for _ in range(math.ceil(math.log2((high - low) / CLOSE))):
        tried = (low + high) / 2
        low, high = (low, tried) if fires(tried) else (tried, high)
    return (low + high) / 2
