"""Colours of figures and page: Okabe-Ito hues, told apart by colour-blind readers.

The light values are drawn; the page takes the dark ones instead where the reader's
system is dark.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Colour:
    """One role's colour: its name in the page's style sheet, light and dark value."""

    name: str
    light: str
    dark: str


FORCE = Colour("force", "#0072b2", "#56b4e9")
V_C1 = Colour("v-c1", "#c84a00", "#ff8b4d")
V_C2 = Colour("v-c2", "#00805c", "#2fd1a0")
V_K = Colour("v-k", "#a9407e", "#f08cc4")
RATE = Colour("rate", "#5e35b1", "#f4e04d")
I_DS = Colour("i-ds", "#39485a", "#c9d3de")
TWIN = Colour("twin", "#2b3746", "#ffffff")
INK = Colour("ink", "#17212b", "#eef2f6")
QUIET = Colour("quiet", "#55636f", "#a9b6c2")
RULE = Colour("rule", "#d5dbe1", "#3a4654")
BAND = Colour("band", "#f0f3f6", "#232d38")
PAPER = Colour("paper", "#ffffff", "#18212b")
SIMULATED = Colour("simulated", "#8a5a00", "#f2b441")
MEASURED = Colour("measured", "#00694b", "#3fd6a4")

ALL = (
    FORCE, V_C1, V_C2, V_K, RATE, I_DS, TWIN, INK, QUIET, RULE, BAND, PAPER, SIMULATED,
    MEASURED,
)  # fmt: skip
BY_NAME = {
    "force": FORCE, "V_C1": V_C1, "V_C2": V_C2, "V_K": V_K, "rate": RATE, "I_DS": I_DS,
    "coil_current": FORCE, "field": FORCE, "temperature": FORCE, "model": TWIN,
    "ink": INK, "quiet": QUIET,
}  # fmt: skip
"""By the names that descriptions of plots use."""
