"""A scene as a general solver sees it: segments of force, two states, a reset."""

from __future__ import annotations

import os
import time as wall
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import SolverError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.compiled import entry, inner, source_stamp
from tactile_lab.model.equations import V_P as closed_V_P
from tactile_lab.model.equations import rest_point
from tactile_lab.model.integrator import TAU_L, Q_at
from tactile_lab.model.node_a import TAU, B_at, V_P_at, slope_at
from tactile_lab.model.packed import parameters
from tactile_lab.model.pair import flow
from tactile_lab.model.state import Start
from tactile_lab.model.transistor import FLOW, SATURATES, TO_A, TO_C2
from tactile_lab.waveform import Waveform


class OutOfTimeError(SolverError):
    """A solver used more than the time it was given."""


class Answer(NamedTuple):
    """What a method found.

    Attributes:
        spike_times: s.
        V_C1: at the end, V.
        evaluations: of the right-hand side; None where it is not known.
        estimate: its own estimate of the largest error of a spike time, s.
    """

    spike_times: FloatArray
    V_C1: float
    evaluations: int | None = None
    estimate: float | None = None


def spent() -> float:
    """CPU time of this process and of finished children so far, s."""
    children = os.times()
    return wall.process_time() + children.children_user + children.children_system


class Deadline:
    """After `cap` s of CPU time; cheap to ask while there is wall time left."""

    def __init__(self, cap: float) -> None:
        self._end = spent() + cap
        self._ask_again = wall.perf_counter() + cap

    def passed(self) -> bool:
        """Whether the time is used up."""
        if wall.perf_counter() < self._ask_again:
            return False
        left = self._end - spent()
        self._ask_again += max(left, 0.0)
        return left <= 0.0


@dataclass(frozen=True)
class Problem:
    """One scene of the comparison.

    Attributes:
        name: for tables.
        circuit: parameters.
        force: N over s.
        until: duration, s.
        start: voltages at time 0, None for the equilibrium.
        note: what is hard about it.
    """

    name: str
    circuit: Circuit
    force: Waveform
    until: float
    start: Start | None = None
    note: str = ""

    @cached_property
    def par(self) -> FloatArray:
        """The circuit as the compiled functions take it."""
        return parameters(self.circuit)

    @cached_property
    def first(self) -> tuple[float, float]:
        """V_C1 and V_C2 at time 0, V."""
        if self.start is not None:
            return self.start.V_C1, self.start.V_C2
        V_C1, V_C2 = rest_point(self.circuit)
        return V_C1, (
            V_C2 if V_C2 < self.circuit.fire_voltage else self.circuit.reset_voltage
        )

    @cached_property
    def segments(self) -> list[tuple[float, float, float, float]]:
        """Start s, end s, V_P at the start and slope k_F F' of every segment."""
        inside = self.force.time[(self.force.time > 0) & (self.force.time < self.until)]
        edges = np.unique(np.concatenate([[0.0], inside, [self.until]]))
        found, V_P = [], 0.0 if self.start is None else self.start.V_P
        F = float(self.force.value[0])
        k_F = self.circuit.k_F
        for t0, t1 in pairwise(edges):
            now = float(self.force.at(t0))
            V_P += k_F * (now - F)
            at = int(np.searchsorted(self.force.time, t1, side="left"))
            exact = at < self.force.time.size and self.force.time[at] == t1
            F = float(self.force.value[at] if exact else self.force.at(t1))
            p = k_F * (F - now) / float(t1 - t0)
            found.append((float(t0), float(t1), V_P, p))
            V_P = closed_V_P(self.circuit, V_P, p / k_F if k_F else 0.0, float(t1 - t0))
        return found

    @cached_property
    def table(self) -> FloatArray:
        """`segments` as the compiled methods take them."""
        return np.array(self.segments)

    @property
    def stiffness(self) -> float:
        """Largest over smallest rate of the Jacobian along the quasi-static path."""
        fastest = 0.0
        for t0, t1, V0, p in self.segments:
            k_F = self.circuit.k_F or 1.0
            for V_P in (V0, closed_V_P(self.circuit, V0, p / k_F, t1 - t0)):
                fastest = max(fastest, _fastest_rate(V_P, self.par))
        slowest = min(1 / self.circuit.tau, 1 / self.circuit.tau_L)
        return max(fastest, 1 / self.circuit.tau_L, 1 / self.circuit.tau) / slowest


@entry
def _fastest_rate(V_P: float, par: FloatArray) -> float:
    from_zero = B_at(V_P, par) / par[0]
    y = 0.0
    # the equilibrium by bisection: robust, and speed does not matter here
    low, high = 0.0, par[2]
    for _ in range(80):
        y = 0.5 * (low + high)
        if slope_at(B_at(V_P, par), y, par) > 0.0:
            low = y
        else:
            high = y
    return float(par[1] + from_zero * np.exp(-y / par[0]))


@inner
def slopes(
    s: float,
    y: float,
    v: float,
    V0: float,
    p: float,
    held: bool,
    par: FloatArray,
    both: FloatArray,
    out: FloatArray,
) -> None:
    """Eqs. (7), (8) and (16) to (18), V/s; `both` has room for a `flow`."""
    B = B_at(V_P_at(s, V0, p, par[TAU]), par)
    if par[SATURATES] != 0.0:
        flow(B, y, v, held, par, both)
        out[0], out[1] = both[TO_A], both[TO_C2]
        return
    out[0] = slope_at(B, y, par)
    out[1] = 0.0 if held else (Q_at(y, par) - v) / par[TAU_L]


def _build(stamp: int) -> Callable[..., Any]:
    @entry
    def right_hand_side(
        s: float, y: float, v: float, V0: float, p: float, held: bool, par: FloatArray,
        both: FloatArray, out: FloatArray,
    ) -> None:  # fmt: skip
        _ = stamp
        slopes(s, y, v, V0, p, held, par, both, out)

    return right_hand_side


right_hand_side = _build(source_stamp())
"""`slopes` for whoever calls from Python."""


MOST_SPIKES = 2_000_000
Piece = Callable[[float, float, FloatArray, bool, Any], tuple[float, FloatArray, bool]]
"""Integrate from s to s_end (local) with a right-hand side: where it stopped, the
state there, and whether V_C2 reached V_fire."""


def march(problem: Problem, piece: Piece, cap: float) -> Answer:
    """The answer of a general solver called from Python, restarted at every event.

    Raises:
        OutOfTimeError: more than `cap` s of CPU time.
    """
    c, par = problem.circuit, problem.par
    deadline = Deadline(cap)
    y, both = np.array(problem.first), np.empty(FLOW)
    spikes: list[float] = []
    resume, evaluations = -1.0, 0
    for t0, t1, V0, p in problem.segments:
        s, T = 0.0, t1 - t0
        while s < T:
            held = resume >= 0.0
            end = min(T, max(resume - t0, s)) if held else T

            def rhs(
                at: float, state: FloatArray, V0: float = V0, p: float = p,
                held: bool = held,
            ) -> FloatArray:  # fmt: skip
                nonlocal evaluations
                evaluations += 1
                if deadline.passed():
                    raise OutOfTimeError(f"stopped after {cap:g} s")
                out = np.empty(2)
                right_hand_side(
                    float(at), float(state[0]), float(state[1]), V0, p, held, par,
                    both, out,
                )  # fmt: skip
                return out

            fired = False
            if end > s:
                s, y, fired = piece(s, end, y, not held, rhs)
            if not np.all(np.isfinite(y)):
                raise SolverError("the solution is NaN")
            if held and s >= end and end < T:
                resume, y[1] = -1.0, c.reset_voltage
            if fired:
                spikes.append(t0 + s)
                if len(spikes) > MOST_SPIKES:
                    raise OutOfTimeError(f"stopped after {MOST_SPIKES} spikes")
                y[1] = c.reset_voltage
                if c.reset_time > 0:
                    resume = t0 + s + c.reset_time
    return Answer(np.array(spikes), float(y[0]), evaluations)
