"""The model in causal slices: state in, force for a while, state and outputs out."""

from __future__ import annotations

import math
import time as wall
from collections.abc import Sequence
from dataclasses import dataclass

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import ParameterError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.equations import rest
from tactile_lab.model.need import Need, checked_tolerance
from tactile_lab.model.solution import Solution
from tactile_lab.model.solver import solve
from tactile_lab.model.state import State
from tactile_lab.waveform import Waveform

__all__ = ["Outputs", "State", "advance", "rest"]


@dataclass(frozen=True)
class Outputs:
    """What happened in one slice, in absolute time.

    Attributes:
        start: beginning of the slice, s.
        end: end of the slice, s; the state there is right-continuous.
        spike_times: shape (n,), absolute, s; None if not kept.
        run_time: wall time spent, s.
    """

    start: float
    end: float
    spike_times: FloatArray | None
    run_time: float
    solution: Solution

    @property
    def stages(self) -> dict[str, int]:
        """Evaluations of each stage in this slice."""
        return self.solution.stages

    def sample(self, signal: str, times: FloatArray) -> FloatArray:
        """Values of `signal` at absolute `times` in [start, end], right-continuous.

        Raises:
            ParameterError: the signal was not kept, or a time lies outside.
        """
        return self.solution.sample(signal, times)


def advance(
    circuit: Circuit,
    state: State,
    force: Waveform,
    until: float,
    *,
    keep: Sequence[str] = ("V_C1", "V_C2", "spikes"),
    tolerance: float = 1e-9,
) -> tuple[State, Outputs]:
    """Advance from `state` to `until` s under `force`, given in absolute time.

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
    started = wall.perf_counter()
    solution = solve(circuit, state, force, until, need, checked_tolerance(tolerance))
    return solution.after, Outputs(
        start=state.time,
        end=until,
        spike_times=solution.spike_times if "spikes" in need.signals else None,
        run_time=wall.perf_counter() - started,
        solution=solution,
    )
