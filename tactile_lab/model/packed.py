"""A circuit as the array the compiled functions take."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model import integrator, node_a, transistor
from tactile_lab.model.circuit import SATURATION_HEADROOM, Circuit
from tactile_lab.model.derived import Numbers


@lru_cache(maxsize=64)
def parameters(circuit: Circuit) -> FloatArray:
    """The circuit as the kernel's array; see `node_a` and `integrator`."""
    par = np.empty(transistor.ALL_PARAMETERS)
    fill(circuit, circuit.tau_A, circuit.critical_V_C1, circuit.t1 == "direct", par)
    par[transistor.SATURATES] = float(circuit.saturation)
    par.setflags(write=False)
    return par


def fill(
    c: Numbers, tau_A: float, critical_V_C1: float, direct: bool, par: FloatArray
) -> None:
    """Put a circuit's numbers into `par`, as the compiled functions want them.

    T1 does not saturate unless the caller says so afterwards. Compiled code calls it,
    too: with one record of many circuits (see `batch`).
    """
    drop = c.I_T1s * c.R3
    par[node_a.V_T] = c.V_T
    par[node_a.LAMBDA] = 1 / tau_A
    par[node_a.DIVIDER] = c.V_S * c.R2 / (c.R1 + c.R2)
    par[node_a.LOG_B0] = math.log(c.I_S) - math.log(c.C1) + c.V_GS / (c.m * c.V_T)
    par[node_a.PER_VOLT] = 1 / (c.m * c.V_T)
    par[node_a.TAU] = c.tau
    par[integrator.DIRECT] = 1.0 if direct else 0.0
    par[integrator.V_S] = c.V_S
    par[integrator.T1_LOG] = math.log(drop) - math.log(c.V_T)
    par[integrator.T1_DROP] = drop
    if direct:
        par[integrator.T1_SCALE] = c.R_L * c.I_T1s
        par[integrator.T1_SHIFT] = c.R_L * c.I_bias
    else:
        par[integrator.T1_SCALE] = c.R_L * c.V_T / c.R3
        par[integrator.T1_SHIFT] = c.R_L * (c.I_bias - c.I_T1s)
    par[integrator.TAU_L] = c.R_L * c.C2
    par[integrator.V_FIRE] = c.fire_voltage
    par[integrator.V_RESET] = c.reset_voltage
    par[integrator.T_EPS] = c.reset_time
    par[integrator.Y_CRITICAL] = critical_V_C1
    par[integrator.Y_SATURATED] = c.fire_voltage - SATURATION_HEADROOM
    a = 1 + 1 / c.beta_F
    par[transistor.I_S1], par[transistor.T1_BIAS] = c.I_T1s, c.I_bias
    par[transistor.R_E], par[transistor.E_DROP] = c.R3, a * drop
    par[transistor.E_LOG] = math.log(a) + par[integrator.T1_LOG]
    par[transistor.PER_F], par[transistor.PER_R] = 1 / c.beta_F, 1 / c.beta_R
    par[transistor.T1_C1], par[transistor.T1_C2] = c.C1, c.C2
    par[transistor.SATURATES] = 0.0
