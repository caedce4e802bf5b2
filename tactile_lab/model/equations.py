"""The paper's equations as functions of a circuit.

Scalars or arrays go in and come out alike, SI units throughout. Equation numbers are
those of Birkoben et al., Sci. Rep. 10, 2020.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import ParameterError
from tactile_lab.model import derived
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.state import State


def V_P(circuit: Circuit, V_P0: float, slope: float, time: float) -> float:
    """Eq. (7) after `time` s from V_P0 under a force of constant slope N/s, V."""
    e = math.expm1(-time / circuit.tau)
    return V_P0 + V_P0 * e - circuit.k_F * slope * circuit.tau * e


def I_DS(circuit: Circuit, V_P: ArrayLike, V_C1: ArrayLike) -> FloatArray:
    """Drain current of the PiezoFET, Eq. (8) with V_DS = V_C1, A."""
    c = circuit
    exponent = np.minimum((c.V_GS + np.asarray(V_P)) / (c.m * c.V_T), 600.0)
    current: FloatArray = (
        c.I_S * np.exp(exponent) * -np.expm1(-np.asarray(V_C1) / c.V_T)
    )
    return current


def V_C1_slope(circuit: Circuit, V_P: ArrayLike, V_C1: ArrayLike) -> FloatArray:
    """dV_C1/dt, Eq. (16), V/s."""
    c, V = circuit, np.asarray(V_C1)
    slope: FloatArray = ((c.V_S - V) / c.R1 - V / c.R2 - I_DS(c, V_P, V)) / c.C1
    return slope


def critical_force(circuit: Circuit) -> float:
    """The least force at which a film that does not leak would keep it firing, N.

    NaN where no force does; see `derived.critical_force`.
    """
    return derived.critical_force(circuit, circuit.critical_V_C1, circuit.k_F)


def I_C(circuit: Circuit, V_C1: ArrayLike) -> FloatArray:
    """Collector current of T1, Eq. (17), A.

    With R3 in the emitter, V_EB + R3 I_C = V_S - V_C1 has the closed form of the
    Wright omega function; "direct" takes V_EB = V_S - V_C1.
    """
    c, U = circuit, circuit.V_S - np.asarray(V_C1, dtype=np.float64)
    if c.t1 == "direct":
        direct: FloatArray = c.I_T1s * np.expm1(np.minimum(U / c.V_T, 700.0))
        return direct
    drop = c.I_T1s * c.R3
    omega = wright_omega((U + drop) / c.V_T + math.log(drop / c.V_T))
    current: FloatArray = c.V_T / c.R3 * omega - c.I_T1s
    return current


def shortest_interval(circuit: Circuit) -> float:
    """Less than any interval between two spikes, s: of C2 charged as at V_C1 = 0 V."""
    most = float(I_C(circuit, 0.0)) + circuit.I_bias
    return circuit.C2 * circuit.swing / most


def T1_currents(
    circuit: Circuit, V_C1: ArrayLike, V_C2: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Collector and base current of a T1 that saturates, A; see `transistor`."""
    c, y = circuit, np.asarray(V_C1, dtype=np.float64)
    J = c.I_T1s * np.expm1(np.minimum((np.asarray(V_C2) - y) / c.V_T, 230.0))
    U = c.V_S - y
    if c.t1 == "direct":
        I_F = c.I_T1s * np.expm1(np.minimum(U / c.V_T, 600.0))
    else:
        R = c.R3 * (1 + 1 / c.beta_F)
        drop = c.I_T1s * R
        omega = wright_omega((U + c.R3 * J + drop) / c.V_T + math.log(drop / c.V_T))
        I_F = c.V_T / R * omega - c.I_T1s
    return I_F - J * (1 + 1 / c.beta_R), I_F / c.beta_F + J / c.beta_R


def wright_omega(z: ArrayLike) -> FloatArray:
    """The root w of w + ln w = z, by Fritsch, Shafer and Crowley's iteration."""
    z = np.asarray(z, dtype=np.float64)
    small = np.exp(np.minimum(z, 1.0))
    large = np.log(np.maximum(z, 1.0))
    w = np.where(z < 1.0, small / (1.0 + 0.76 * small), z - large * (1 - 1 / (1 + z)))
    tiny = z < -40.0
    w, z = np.where(tiny, 1.0, w), np.where(tiny, 1.0, z)
    for _ in range(3):
        r = z - w - np.log(w)
        a = (1 + w) * (1 + w + 2 / 3 * r)
        w = w * (1 + r / (1 + w) * (a - 0.5 * r) / (a - r))
    omega: FloatArray = np.where(tiny, small, w)
    return omega


def rest_V_C1(circuit: Circuit, V_P: float = 0.0) -> float:
    """Equilibrium of V_C1 at a given V_P, the root of Eq. (16), V.

    The root is unique: Eq. (16) falls strictly from a positive value at 0 V to a
    negative one at the open divider's voltage.
    """
    c = circuit
    open_divider = c.V_S * c.R2 / (c.R1 + c.R2)
    G = 1 / c.R1 + 1 / c.R2
    log_A = math.log(c.I_S / G) + (c.V_GS + V_P) / (c.m * c.V_T)
    A = math.exp(min(log_A, 600.0))
    low, high = 0.0, open_divider
    # convex in V, so Newton from the left of the root never overshoots
    V = max(0.0, open_divider - A)
    for _ in range(200):
        f = open_divider - V + A * math.expm1(-V / c.V_T)
        low, high = (V, high) if f > 0 else (low, V)
        V_next = V + f / (1 + A / c.V_T * math.exp(-V / c.V_T))
        if not low <= V_next <= high:
            V_next = 0.5 * (low + high)
        if abs(V_next - V) <= 2e-16 * V_next:
            return V_next
        V = V_next
    return V


@lru_cache(maxsize=256)
def rest_point(circuit: Circuit) -> tuple[float, float]:
    """V_C1 and V_C2 at equilibrium, V; V_C2 as if it did not fire."""
    from tactile_lab.model.packed import parameters
    from tactile_lab.model.rest_pair import rest_of_both

    V_C1, V_C2 = rest_of_both(parameters(circuit))
    return float(V_C1), float(V_C2)


@lru_cache(maxsize=256)
def rest(circuit: Circuit, *, time: float = 0.0, force: float = 0.0) -> State:
    """The equilibrium under a constant `force` N, reached long ago, at `time` s.

    Where the equilibrium lies above threshold, V_C2 starts at V_reset.
    """
    if not (math.isfinite(time) and math.isfinite(force)):
        raise ParameterError(f"time {time} s and force {force} N must be finite.")
    V_C1, V_C2 = rest_point(circuit)
    if V_C2 >= circuit.fire_voltage:
        V_C2 = circuit.reset_voltage
    return State(time=time, force=force, V_P=0.0, V_C1=V_C1, V_C2=V_C2)


def fires_at_rest(circuit: Circuit) -> bool:
    """Whether the equilibrium lies above V_fire."""
    return rest_point(circuit)[1] >= circuit.fire_voltage


def rest_V_C2(circuit: Circuit, V_C1: float) -> float:
    """Equilibrium of V_C2 at a given V_C1 without firing, Eq. (18), V."""
    return float(circuit.R_L * (I_C(circuit, V_C1) + circuit.I_bias))
