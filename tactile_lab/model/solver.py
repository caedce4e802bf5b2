"""Solve one slice: prepare the numbers for the kernel, and read its answer."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tactile_lab.errors import ParameterError, SolverError
from tactile_lab.model import kernel, spiking
from tactile_lab.model.circuit import (
    LARGEST_VOLTAGE,
    SUBTHRESHOLD_LIMIT,
    Circuit,
    FloatArray,
)
from tactile_lab.model.equations import fires_at_rest
from tactile_lab.model.need import STAGES, Need
from tactile_lab.model.packed import parameters
from tactile_lab.model.solution import Solution, Statistics
from tactile_lab.model.state import State
from tactile_lab.model.tableau import ORDER
from tactile_lab.waveform import Waveform

MOST_SPIKES = 1e8
"""Most spikes in one slice: beyond, refuse instead of hanging."""
MOST_COUPLED = 1e5
"""The same where T1 saturates and a spike takes a hundred times as long."""


def solve(
    circuit: Circuit,
    state: State,
    force: Waveform,
    until: float,
    need: Need,
    tolerance: float,
) -> tuple[State, Solution]:
    """Advance `state` to `until` and keep what `need` asks for."""
    stale = set(state.left_out)
    if (need.node_a and "V_C1" in stale) or (need.integrator and "V_C2" in stale):
        raise ParameterError(
            "The state was advanced without what is asked for now; keep the same "
            "signals in every slice."
        )
    time, value = _points(state, force, until)
    largest = max(float(value.max()), -float(value.min()))
    if not abs(circuit.k_F) * largest <= LARGEST_VOLTAGE:
        raise ParameterError(
            f"A force of {largest:g} N makes {abs(circuit.k_F) * largest:g} V; at most "
            f"{LARGEST_VOLTAGE:g} V can be simulated."
        )
    par = parameters(circuit)
    node = np.array([state.V_C1, state.error_V_C1, 0.0, state.V_P, state.V_P])
    S = _memory(state)
    counts = np.zeros(kernel.COUNTS, dtype=np.int64)
    keep_spikes = bool(need.signals & {"spikes"})
    if circuit.saturation and need.node_a:
        from tactile_lab.model import coupled, ellipse

        most = MOST_COUPLED
        E = np.array([state.error_V_C1**2, state.errors_together, state.error_V_C2**2])
        status, segments, steps, pieces, spikes = coupled.run(
            time, value, circuit.k_F, par, node, E, S, counts, tolerance,
            keep_spikes, need.dense, need.dense_V_C2, most,
        )  # fmt: skip
        node[kernel.Y_ERROR] = math.sqrt(E[ellipse.E_11])
        S[spiking.ERROR] = math.sqrt(E[ellipse.E_22])
        together = float(E[ellipse.E_12])
    else:
        most, together = MOST_SPIKES, 0.0
        status, segments, steps, pieces, spikes = kernel.run(
            time, value, circuit.k_F, par, node, S, counts, tolerance,
            need.node_a, need.integrator, keep_spikes,
            need.dense, need.dense_V_C2, most,
        )  # fmt: skip
    if status != kernel.DONE:
        raise SolverError(_refusal(status, float(S[spiking.COUNT]), most))
    after = _after(state, until, float(value[-1]), node, S, need, together)
    return after, Solution(
        circuit=circuit,
        need=need,
        force=force,
        start=state.time,
        end=until,
        spike_times=spikes[: int(S[spiking.COUNT]) if keep_spikes else 0].copy(),
        before=tuple(
            t for t in (state.previous_spike, state.last_spike) if t is not None
        ),
        parameters=par,
        segments=segments[: counts[kernel.ROWS_0]].copy(),
        steps=steps[: counts[kernel.ROWS_1]].copy(),
        pieces=pieces[: counts[kernel.ROWS_2]].copy(),
        last=(after.V_P, after.V_C1, after.V_C2),
        stages=_stages(counts, S, need),
        evaluations=ORDER * int(counts[kernel.ITERATIONS])
        + (ORDER + 1) * int(counts[kernel.EXPANSIONS]),
        statistics=_statistics(S) if need.integrator else None,
        error_spike_time=float(S[spiking.LARGEST_ERROR]),
        error_V_C1=float(node[kernel.Y_LARGEST_ERROR]),
        warnings=_warnings(circuit, need, node, S),
    )


def _points(
    state: State, force: Waveform, until: float
) -> tuple[FloatArray, FloatArray]:
    """Force from the state on: its own value, a jump to the waveform's, the points."""
    first = int(np.searchsorted(force.time, state.time, side="right"))
    stop = int(np.searchsorted(force.time, until, side="right"))
    now, end = _value(force, first, state.time), _value(force, stop, until)
    ends = stop > first and force.time[stop - 1] == until
    head, tail = slice(0, 2), slice(2, 2 + stop - first)
    points = np.empty((2, 2 + stop - first + (0 if ends else 1)))
    points[0, head], points[1, head] = state.time, (state.force, now)
    points[0, tail], points[1, tail] = force.time[first:stop], force.value[first:stop]
    if not ends:
        points[0, -1], points[1, -1] = until, end
    return points[0], points[1]


def _value(force: Waveform, after: int, t: float) -> float:
    """`force.at(t)` where point number `after` is the first later than t."""
    if after == 0 or after == force.time.size:
        return float(force.value[min(after, force.time.size) - (after > 0)])
    t0, t1 = float(force.time[after - 1]), float(force.time[after])
    F0, F1 = float(force.value[after - 1]), float(force.value[after])
    return F0 + (t - t0) / (t1 - t0) * (F1 - F0)


def _memory(state: State) -> FloatArray:
    S = np.zeros(spiking.MEMORY)
    S[spiking.VOLTAGE] = state.V_C2
    S[spiking.RESUME] = -1.0
    if state.resume is not None:
        S[spiking.VOLTAGE], S[spiking.RESUME] = 0.0, max(state.resume - state.time, 0.0)
    S[spiking.ERROR] = state.error_V_C2
    S[spiking.LAST] = -math.inf if state.last_spike is None else state.last_spike
    S[spiking.PREVIOUS] = (
        -math.inf if state.previous_spike is None else state.previous_spike
    )
    S[spiking.SHORTEST] = math.inf
    return S


def _refusal(status: int, count: float, most: float) -> str:
    if status == kernel.FAST and count >= most:
        return (
            f"More than {most:g} spikes in one simulation; make it shorter or check "
            "the integrator's current (t1, I_T1s, C2)."
        )
    if status == kernel.FAST:
        return (
            f"Spikes follow each other within {spiking.SHORTEST_INTERVAL:g} s, or "
            "faster than double-precision time resolves; the integrator's current is "
            "too large for C2 (t1, I_T1s, C2)."
        )
    if status == kernel.STUCK:
        return "The solver cannot resolve V_C1 or I_C; parameters are too extreme."
    return "The solution left the range of finite numbers; parameters are too extreme."


def _after(
    state: State,
    until: float,
    force: float,
    node: FloatArray,
    S: FloatArray,
    need: Need,
    together: float,
) -> State:
    resume = None
    V_C2 = float(S[spiking.VOLTAGE])
    if not need.integrator:
        V_C2, resume = state.V_C2, state.resume
    elif S[spiking.RESUME] >= 0:
        resume = until + float(S[spiking.RESUME])
    last, previous = float(S[spiking.LAST]), float(S[spiking.PREVIOUS])
    left_out = tuple(
        name
        for name, solved in (("V_C1", need.node_a), ("V_C2", need.integrator))
        if not solved
    )
    return State(
        time=until,
        force=force,
        V_P=float(node[kernel.V_P]),
        V_C1=float(node[kernel.Y]),
        V_C2=V_C2,
        resume=resume,
        last_spike=last if last > -math.inf else None,
        previous_spike=previous if previous > -math.inf else None,
        spikes=state.spikes + int(S[spiking.COUNT]),
        error_V_C1=float(node[kernel.Y_ERROR]),
        error_V_C2=float(S[spiking.ERROR]),
        errors_together=together,
        left_out=left_out,
    )


def _stages(counts: NDArray[np.int64], S: FloatArray, need: Need) -> dict[str, int]:
    stages = dict.fromkeys(STAGES, 0)
    stages["V_P"] = int(counts[kernel.SEGMENTS])
    stages["V_C1"] = int(counts[kernel.STEPS] + counts[kernel.REJECTED])
    stages["I_C"] = int(counts[kernel.EXPANSIONS])
    stages["V_C2"] = int(counts[kernel.PIECES])
    stages["spikes"] = int(S[spiking.SEARCHES])
    return stages


def _statistics(S: FloatArray) -> Statistics:
    count = int(S[spiking.COUNT])
    intervals = math.isfinite(S[spiking.SHORTEST])
    return Statistics(
        count,
        float(S[spiking.FIRST]) if count else None,
        float(S[spiking.LAST]) if count else None,
        float(S[spiking.SHORTEST]) if intervals else None,
        float(S[spiking.LONGEST]) if intervals else None,
    )


def _warnings(
    circuit: Circuit, need: Need, node: FloatArray, S: FloatArray
) -> tuple[str, ...]:
    found = []
    if need.node_a and node[kernel.V_P_HIGHEST] + circuit.V_GS > SUBTHRESHOLD_LIMIT:
        found.append(
            f"V_GS + V_P exceeds {SUBTHRESHOLD_LIMIT} V, where the exponential law of "
            "Eq. (1) ends; I_DS is overestimated there."
        )
    if S[spiking.SATURATED]:
        found.append(
            "Spikes occur with V_C1 below V_fire - 0.5 V, where a real T1 saturates "
            "and the circuit stops firing; Eq. (17) cannot show it, saturation = true "
            "does."
        )
    if S[spiking.DOUBT]:
        found.append(
            "V_C2 only just reaches or misses V_fire, closer than the estimated error: "
            "whether there is a spike cannot be decided."
        )
    if need.integrator and fires_at_rest(circuit):
        found.append(
            "The circuit fires at rest: its equilibrium lies above V_fire; V_C2 starts "
            "at V_reset."
        )
    return tuple(found)
