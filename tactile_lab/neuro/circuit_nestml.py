"""The whole circuit as a NESTML model, in mV, pA, pF, GOhm and ms."""

from __future__ import annotations

from string import Template

from tactile_lab.neuro.scripts import script
from tactile_lab.neuro.solved import Solved

UNITS = {
    "mV": ("V_GS V_T V_S V_fire V_reset", 1e3),
    "pA": ("I_S I_T1s I_bias", 1e12),
    "GOhm": ("R1 R2 R3 R_L", 1e-9),
    "pF": ("C1 C2", 1e12),
    "ms": ("tau t_eps", 1e3),
}


def text(solved: Solved) -> str:
    """The model `tactile_sensor`; its input is the slope of the force, 1 pA a mN/s."""
    values = solved.parameters
    lines = [
        f"{name} {unit} = {values[name] * scale!r} {unit}"
        for unit, (names, scale) in UNITS.items()
        for name in names.split()
    ]
    lines.append(f"slope_factor real = {values['m']!r}")  # NESTML's m is a metre
    # V_P grows by k_F (V/N, mV/mN) for each mN/s and s
    lines.append(f"k_slope mV / ms / pA = {values['k_F'] * 1e-3!r} mV / ms / pA")
    first = solved.first
    if solved.circuit.t1 == "direct":
        state, current = "", "inline I_C pA = I_T1s * (exp((V_S - V_C1) / V_T) - 1)"
    else:
        state = f"I_C pA = {first['I_C'] * 1e12!r} pA"
        gain = "(I_C + I_T1s) / (R3 * (I_C + I_T1s) + V_T)"
        current = f"I_C' = -slope_of_V_C1 * {gain}"
    return Template(script("circuit_nestml")).substitute(
        title=solved.title,
        parameters="\n        ".join(lines),
        current=current,
        first_current=state,
        **{name: f"{first[name] * 1e3!r}" for name in ("V_P", "V_C1", "V_C2")},
    )
