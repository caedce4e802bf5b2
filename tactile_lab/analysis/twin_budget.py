"""What each cause of uncertainty contributes to predicted spike times and to V_C1.

Medians over the run. Numerics are the solver's own estimate and the straight pieces the
field is drawn with.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tactile_lab.analysis.belief import Belief
from tactile_lab.analysis.error_budget import ErrorBudget
from tactile_lab.analysis.spike_pairs import irregularity
from tactile_lab.analysis.twin import Twin

CAUSES = ("numerics", "clocks", "follower", "lag", "force", "temperature", "noise")


def spike_time_budget(twin: Twin, belief: Belief) -> ErrorBudget | None:
    """That of the predicted spikes, s; None where none were matched.

    Noise is what the irregularity of the intervals has added up to at a spike.
    """
    matched = twin.spikes
    if matched is None or not matched.offsets.size:
        return None
    noise = matched.scatter
    return _budget("s", matched.open, twin.error.spike_time, noise, belief)


def V_C1_budget(twin: Twin, belief: Belief) -> ErrorBudget | None:
    """That of the predicted V_C1 against its channel, V; None without V_C1.

    Noise is the scatter of its bins and one code of the converter.
    """
    residual = twin.residual("V_C1")
    if residual is None or not residual.time.size:
        return None
    noise = float(
        np.hypot(irregularity(residual.difference), _of(residual.open, "codes"))
    )
    return _budget("V", residual.open, twin.error.V_C1, noise, belief)


def _budget(
    unit: str,
    parts: Mapping[str, np.ndarray],
    numerics: float | None,
    noise: float,
    belief: Belief,
) -> ErrorBudget:
    stated, drawn = belief.stated, belief.magnet.lag.drawn
    if unit != "s":  # what V_C1 changes in that time
        drawn *= _of(parts, "clocks") / belief.clock if belief.clock else 0.0
    known = {
        name: _of(parts, name) if stated.get(name, True) else None for name in CAUSES
    }
    known["numerics"] = float(np.hypot(numerics or 0.0, drawn))
    known["noise"] = noise if np.isfinite(noise) else 0.0
    return ErrorBudget(unit, known)


def _of(parts: Mapping[str, np.ndarray], name: str) -> float:
    """Median of one part over the run; 0 where there is none."""
    part = parts.get(name, np.zeros(1))
    finite = part[np.isfinite(part)]
    return float(np.median(finite)) if finite.size else 0.0
