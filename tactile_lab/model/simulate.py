"""The sensor under a force: spikes and signals, how accurate, how long it took."""

from __future__ import annotations

import math
import time as wall
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import ParameterError
from tactile_lab.model.circuit import LARGEST_VOLTAGE, Circuit
from tactile_lab.model.equations import rest
from tactile_lab.model.need import Need, checked_tolerance
from tactile_lab.model.state import Start, State
from tactile_lab.waveform import Waveform

if TYPE_CHECKING:
    from tactile_lab.model.solution import Solution


class ErrorEstimate(NamedTuple):
    """Largest estimated error over a result.

    Attributes:
        spike_time: s; None where spikes were left out.
        V_C1: V; None where V_C1 was left out.
    """

    spike_time: float | None
    V_C1: float | None

    @classmethod
    def of(cls, found: Solution) -> ErrorEstimate:
        """What a solution estimates of itself."""
        return cls(
            found.error_spike_time if found.need.integrator else None,
            found.error_V_C1 if found.need.node_a else None,
        )

    @classmethod
    def largest(cls, found: Sequence[ErrorEstimate]) -> ErrorEstimate:
        """That of several slices, at least one, of one solution."""
        of_both = (
            [e for e in each if e is not None] for each in zip(*found, strict=True)
        )
        return cls(*(max(each, default=None) for each in of_both))


@dataclass(eq=False)
class Result:
    """What `simulate` found. Nothing changes it; see `Solution` why it is not frozen.

    Attributes:
        duration: s.
        spike_times: shape (n,), s; None if not kept.
        run_time: wall time spent, s.
        solution: the solved slice, with dense evaluators.
    """

    duration: float
    spike_times: FloatArray | None
    run_time: float
    solution: Solution

    @property
    def end(self) -> State:
        """The state at `duration`."""
        return self.solution.after

    @property
    def error(self) -> ErrorEstimate:
        """How far from the exact solution at most, by estimate."""
        return ErrorEstimate.of(self.solution)

    @property
    def left_out(self) -> tuple[str, ...]:
        """Signals that were not computed because nothing asked for them."""
        return self.solution.need.left_out

    @property
    def warnings(self) -> tuple[str, ...]:
        """Where the model leaves what it describes well."""
        return self.solution.warnings

    @property
    def stages(self) -> dict[str, int]:
        """Evaluations of each stage, 0 where left out."""
        return self.solution.stages

    def sample(self, signal: str, times: FloatArray) -> FloatArray:
        """Values of `signal` at `times` s in [0, duration], right-continuous.

        Args:
            signal: force V_P I_DS V_C1 I_C V_C2 V_K or rate, if kept or implied.
            times: any shape, s.

        Raises:
            ParameterError: the signal was not kept, or a time lies outside.
        """
        return self.solution.sample(signal, times)


def simulate(
    circuit: Circuit,
    force: Waveform,
    *,
    keep: Sequence[str] = ("spikes",),
    until: float | None = None,
    start: Start | None = None,
    tolerance: float = 1e-9,
) -> Result:
    """Simulate the circuit from time 0 under a force, Eqs. (1)-(18).

    Args:
        circuit: parameters.
        force: N over s; before its first point the first value was held for ever.
        keep: what is wanted; stages that nothing wanted depends on are left out.
        until: end, s; the force's last point if None.
        start: voltages at time 0; equilibrium if None.
        tolerance: of spike times (s) and V_C1 (V).

    Raises:
        ParameterError: a bad option or waveform.
        SolverError: the model cannot answer to that tolerance.
    """
    duration = force.end if until is None else until
    need, tolerance = asked(circuit, force, keep, duration, tolerance)
    began = wall.perf_counter()
    if start is None:
        begin = solver().start_at_rest(circuit, force.first)
    else:
        state = state_at_start(circuit, force.first, start)
        begin = solver().start_from(circuit, state)
    solution = solver().solve(begin, force, duration, need, tolerance)
    spikes = solution.spike_times if "spikes" in need.signals else None
    return Result(duration, spikes, wall.perf_counter() - began, solution)


def asked(
    circuit: Circuit,
    force: Waveform,
    keep: Sequence[str],
    duration: float,
    tolerance: float,
) -> tuple[Need, float]:
    """What a simulation from time 0 on is to find, and to which tolerance.

    Raises:
        ParameterError: a bad option or waveform.
    """
    if not 0 < duration < math.inf:
        raise ParameterError(
            f"The duration is {duration} s; it must be finite and above 0 s. Give "
            "`until` or a force with a last point after 0 s."
        )
    if force.start < 0:
        raise ParameterError(
            f"The force starts at {force.start:g} s; a simulation starts at 0 s. "
            "Shift the waveform."
        )
    return Need.of(keep, circuit.saturation), checked_tolerance(tolerance)


@cache
def solver() -> ModuleType:
    """Compiled code, loaded by those who simulate, and looked for once."""
    from tactile_lab.model import solver as compiled

    return compiled


def state_at_start(circuit: Circuit, force: float, start: Start | None) -> State:
    """The state at time 0: as `start` says, or at rest under `force` N.

    Raises:
        ParameterError: a voltage the circuit cannot start at.
    """
    if start is None:
        return rest(circuit, force=force)
    for name, low, high in (
        ("V_P", -LARGEST_VOLTAGE, LARGEST_VOLTAGE),
        ("V_C1", 0.0, circuit.V_S),
        ("V_C2", -LARGEST_VOLTAGE, circuit.fire_voltage),
    ):
        value = getattr(start, name)
        if not (np.isfinite(value) and low <= value <= high):
            raise ParameterError(
                f"start {name} = {value} V must lie between {low:g} V and {high:g} V."
            )
    if start.V_C2 >= circuit.fire_voltage:
        raise ParameterError(
            f"start V_C2 = {start.V_C2:g} V must be below V_fire = "
            f"{circuit.fire_voltage:g} V."
        )
    return State(time=0.0, force=force, V_P=start.V_P, V_C1=start.V_C1, V_C2=start.V_C2)
