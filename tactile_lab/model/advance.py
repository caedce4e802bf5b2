"""The model in causal slices: state in, force for a while, what it did out."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tactile_lab.errors import ParameterError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.equations import rest
from tactile_lab.model.need import Need, checked_tolerance
from tactile_lab.model.solution import Solution
from tactile_lab.model.solver import solve, start_from
from tactile_lab.model.state import State
from tactile_lab.waveform import Waveform

__all__ = ["State", "advance", "rest"]


def advance(
    circuit: Circuit,
    state: State,
    force: Waveform,
    until: float,
    *,
    keep: Sequence[str] = ("V_C1", "V_C2", "spikes"),
    tolerance: float = 1e-9,
) -> Solution:
    """Advance from `state` to `until` s under `force`, all in absolute time.

    The state to go on from is ``after`` what is returned; `spike_times` are absolute.

    A force that differs from ``state.force`` at ``state.time`` is a jump there. Slices
    of any size give the same answer.

    Raises:
        ParameterError: `until` before the state, unknown signal, bad tolerance.
        SolverError: the model cannot answer to that tolerance.
    """
    if not (math.isfinite(until) and until >= state.time):
        raise ParameterError(
            f"until = {until} s must be finite and not before the state's "
            f"{state.time:g} s."
        )
    need = Need.of(keep, circuit.saturation)
    start = start_from(circuit, state)
    return solve(start, force, until, need, checked_tolerance(tolerance))
