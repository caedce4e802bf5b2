"""The equilibrium of V_C1 and V_C2, as if it did not fire."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model.compiled import entry, inner, source_stamp
from tactile_lab.model.integrator import TAU_L, V_S, Q_at
from tactile_lab.model.node_a import LAMBDA, V_T, B_at, equilibrium
from tactile_lab.model.pair import flow
from tactile_lab.model.transistor import (
    FLOW,
    I_S1,
    SATURATES,
    T1_BIAS,
    T1_C1,
    T1_C2,
    TO_A,
    TO_C2,
)


@inner
def rest_V_C2_at(B: float, y: float, par: FloatArray, f: FloatArray) -> float:
    """Where V_C2 stays at V_C1 = y: its slope falls strictly, so by halving, V."""
    R_L = par[TAU_L] / par[T1_C2]
    reach = R_L * (abs(par[T1_BIAS]) + par[I_S1])
    low, high = min(0.0, y) - reach, par[V_S] + reach
    while True:
        v: float = 0.5 * (low + high)
        if not low < v < high:
            return v
        flow(B, y, v, False, par, f)
        if f[TO_C2] > 0.0:
            low = v
        else:
            high = v


@inner
def rest_of_cascade(par: FloatArray) -> tuple[float, float]:
    """Root of Eq. (16), then of Eq. (18), V: V_C2 does not act back."""
    y = equilibrium(B_at(0.0, par), par)
    return y, Q_at(y, par)


def _build(stamp: int) -> Callable[..., Any]:
    @entry
    def rest_of_both(par: FloatArray) -> tuple[float, float]:
        """Root of Eqs. (16) and (18), V.

        Where T1 saturates, of both together: one halving inside another, for V_C1's
        slope, with V_C2 at rest for each V_C1, falls strictly too.
        """
        _ = stamp
        if par[SATURATES] == 0.0:
            return rest_of_cascade(par)
        f = np.empty(FLOW)
        B = B_at(0.0, par)
        highest = par[V_S] + par[T1_BIAS] / (par[LAMBDA] * par[T1_C1])
        low, high = -par[V_T], max(highest, par[V_S]) + par[V_T]
        while True:
            y = 0.5 * (low + high)
            v = rest_V_C2_at(B, y, par, f)
            if not low < y < high:
                return y, v
            flow(B, y, v, False, par, f)
            if f[TO_A] > 0.0:
                low = y
            else:
                high = y

    return rest_of_both


rest_of_both = _build(source_stamp())
