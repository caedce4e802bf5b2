"""Where the model starts, and all that it remembers between two slices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from tactile_lab.model.circuit import Volt
from tactile_lab.table import SceneTable


@dataclass(frozen=True, kw_only=True)
class Start(SceneTable):
    """Voltages at time 0 instead of the equilibrium, V; a cold start is all 0 V."""

    V_P: Volt
    V_C1: Volt
    V_C2: Volt


class State(NamedTuple):
    """The circuit at one instant, after any jump or reset there; can be pickled.

    Attributes:
        time: s, absolute.
        force: N.
        V_P: piezoelectric voltage, V.
        V_C1: voltage of node A, V.
        V_C2: voltage of the integrator, V.
        resume: end of a reset in progress, s; V_C2 is held until then.
        last_spike: time of the last spike, s, None before the first.
        previous_spike: time of the one before, s.
        spikes: number of spikes so far.
        error_V_C1: estimated error of V_C1 so far, V.
        error_V_C2: estimated error of V_C2 so far, V; during a reset with
            ``saturation`` that of `resume`, s.
        errors_together: how far the two go together, the product of both units; 0
            without ``saturation``.
        left_out: stages not advanced up to `time`; their values are older.
    """

    time: float
    force: float
    V_P: float
    V_C1: float
    V_C2: float
    resume: float | None = None
    last_spike: float | None = None
    previous_spike: float | None = None
    spikes: int = 0
    error_V_C1: float = 0.0
    error_V_C2: float = 0.0
    errors_together: float = 0.0
    left_out: tuple[str, ...] = ()
