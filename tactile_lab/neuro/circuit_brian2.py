"""The whole circuit as a Brian2 script."""

from __future__ import annotations

from string import Template

import numpy as np

from tactile_lab.neuro.scripts import script
from tactile_lab.neuro.solved import Solved

UNITS = {
    "volt": "V_GS V_T V_S V_fire V_reset",
    "amp": "I_S I_T1s I_bias",
    "ohm": "R1 R2 R3 R_L",
    "farad": "C1 C2",
    "second": "tau t_eps",
    "volt / newton": "k_F",
    "": "m",
}
LONGEST_STEP = 20e-6
"""s, of the script; stiffer circuits take shorter ones."""


def text(solved: Solved) -> str:
    """The script; it reads the force from `NAME.force.npz` beside it."""
    values = solved.parameters
    lines = [
        f"{name} = {values[name]!r}{f' * {unit}' if unit else ''}"
        for unit, names in UNITS.items()
        for name in names.split()
    ]
    if solved.circuit.t1 == "direct":
        current = "I_C = I_T1s*expm1((V_S - V_C1)/V_T) : amp"
        first = ""
    else:
        gain = "(I_C + I_T1s)/(R3*(I_C + I_T1s) + V_T)"
        current = f"dI_C/dt = -slope_of_V_C1*{gain} : amp"
        first = f"sensor.I_C = {solved.first['I_C']!r} * amp"
    return Template(script("circuit_brian2")).substitute(
        title=solved.title,
        step=repr(step(solved)),
        parameters="\n".join(lines),
        current=current,
        first_current=first,
        **{name: repr(solved.first[name]) for name in ("V_P", "V_C1", "V_C2")},
    )


def step(solved: Solved) -> float:
    """A step that the classical Runge-Kutta method follows V_C1 with, s."""
    c = solved.circuit
    times = np.linspace(0.0, solved.result.duration, 10_001)
    V_P, V_C1 = (solved.result.sample(name, times) for name in ("V_P", "V_C1"))
    conductance = c.I_S / c.V_T * np.exp((c.V_GS + V_P) / (c.m * c.V_T) - V_C1 / c.V_T)
    fastest = float(np.max(1 / c.tau_A + conductance / c.C1))
    return float(f"{min(LONGEST_STEP, 0.2 / fastest):.0e}")
