"""Solve one slice: prepare the numbers for the kernel, and read its answer."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import ParameterError, SolverError, TactileLabError
from tactile_lab.model import kernel, spiking
from tactile_lab.model.circuit import LARGEST_VOLTAGE, Circuit
from tactile_lab.model.equations import rest
from tactile_lab.model.need import Need
from tactile_lab.model.packed import parameters
from tactile_lab.model.solution import Solution
from tactile_lab.model.state import State
from tactile_lab.waveform import Waveform

MOST_SPIKES = 1e7
"""Most spikes in one slice: beyond, refuse instead of hanging."""
MOST_COUPLED = 1e5
"""The same where T1 saturates and a spike takes a hundred times as long."""


class Start(NamedTuple):
    """Where a slice starts, for us and for the kernel."""

    circuit: Circuit
    state: State
    parameters: FloatArray
    memory: FloatArray


def start_from(circuit: Circuit, state: State) -> Start:
    """A slice's start in `state`."""
    return Start(circuit, state, parameters(circuit), _memory(state))


@lru_cache(maxsize=256)
def start_at_rest(circuit: Circuit, force: float) -> Start:
    """A slice's start at 0 s, at rest under `force` N."""
    return start_from(circuit, rest(circuit, force=force))


def solve(
    start: Start, force: Waveform, until: float, need: Need, tolerance: float
) -> Solution:
    """From `start` to `until`; what `need` asks for is kept."""
    circuit, state, par, memory = start
    stale = state.left_out
    if stale and (
        (need.node_a and "V_C1" in stale) or (need.integrator and "V_C2" in stale)
    ):
        raise ParameterError(
            "The state was advanced without what is asked for now; keep the same "
            "signals in every slice."
        )
    S = memory.copy()
    end = float(until)  # a whole number would have the kernel compiled anew for it
    if circuit.saturation and need.node_a:
        from tactile_lab.model import coupled

        run, most = coupled.run, MOST_COUPLED
    else:
        run, most = kernel.run, MOST_SPIKES
    status, found = run(
        force.time, force.value, end, circuit.k_F, par, S, tolerance, need.asked, most
    )
    if status != kernel.DONE:
        length = until - state.time
        raise _refusal(status, circuit, force, length, float(S[spiking.COUNT]), most)
    spikes = rows = found
    if need.dense:
        count = int(S[spiking.COUNT]) if "spikes" in need.signals else 0
        # a copy: who keeps the spikes, a few, would keep all rows, up to a GB, too
        spikes, rows = found[:count].copy(), found[count:]
    return Solution(circuit, need, force, state, until, spikes, par, rows, S)


def _memory(state: State) -> FloatArray:
    """What the kernel knows at the start; see `spiking` and `kernel`."""
    S = kernel.FRESH.copy()
    S[kernel.TIME], S[kernel.FORCE] = state.time, state.force
    S[spiking.VOLTAGE] = state.V_C2
    S[kernel.Y] = state.V_C1
    S[kernel.V_P] = S[kernel.V_P_HIGHEST] = state.V_P
    if state.resume is not None:
        S[spiking.VOLTAGE], S[spiking.RESUME] = 0.0, max(state.resume - state.time, 0.0)
    if state.last_spike is not None:
        S[spiking.LAST] = state.last_spike
    if state.previous_spike is not None:
        S[spiking.PREVIOUS] = state.previous_spike
    errors = state.error_V_C1, state.error_V_C2
    if any(errors):
        S[kernel.Y_ERROR], S[spiking.ERROR] = errors
        S[kernel.ERRORS :] = errors[0] ** 2, state.errors_together, errors[1] ** 2
    return S


def _refusal(
    status: int,
    circuit: Circuit,
    force: Waveform,
    length: float,
    count: float,
    most: float,
) -> TactileLabError:
    if status == kernel.STRONG:
        largest = float(np.abs(force.value).max())
        return ParameterError(
            f"A force of {largest:g} N makes {abs(circuit.k_F) * largest:g} V; at most "
            f"{LARGEST_VOLTAGE:g} V can be simulated."
        )
    if status == kernel.FAST and count >= most:
        return SolverError(
            f"More than {most:g} spikes in one simulation of {length:g} s; make it "
            "shorter, or check the integrator's current (t1, I_T1s, R3, C2) and V_th."
        )
    if status == kernel.FAST:
        return SolverError(
            f"Spikes follow each other within {spiking.SHORTEST_INTERVAL:g} s, or "
            "faster than double-precision time resolves; the integrator's current is "
            "too large for C2 (t1, I_T1s, C2)."
        )
    if status == kernel.STUCK:
        return SolverError(
            "The solver cannot resolve V_C1 or I_C; parameters are too extreme."
        )
    return SolverError(
        "The solution left the range of finite numbers; parameters are too extreme."
    )
