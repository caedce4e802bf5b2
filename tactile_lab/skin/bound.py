"""Who cannot fire whatever its parts: found without its force's course or its parts.

From rest, V_P = k_F (F - what F was on average, weighted by exp(-t/tau)), so that it
never exceeds k_F times the range of F. Where that stays below the V_P which the least
critical specimen needs, V_C1 stays above its critical value and C2 below V_fire.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model.batch import critical_forces, records
from tactile_lab.model.compiled import entry, source_stamp
from tactile_lab.model.specimen import outermost
from tactile_lab.skin.contact import (
    KIND,
    STRIP,
    UNIFORM,
    WAVE,
    most_stress,
    under_wave,
)
from tactile_lab.skin.forces import (
    AT_X,
    AT_Y,
    END,
    FIRST,
    HOLD,
    HOW,
    PERIOD,
    RAMP,
    RESTS,
    SOURCES,
    SPEED,
    START,
    STILL,
    STRENGTH,
    TIMES,
    VIBRATION,
    WAY_X,
    WAY_Y,
    Loads,
    placed,
)
from tactile_lab.skin.skin import Skin

DECIDING = ("R1", "R2", "R3", "R_L", "V_GS", "V_th", "V_fire")
"""Parts that decide the critical force. It rises or falls with each of them alone, so
that it is least at a corner of the box in which they lie."""
ROUNDING = 1e-6
"""Of a critical force: more than what rounding does to it and to a stress."""


def least_critical(skin: Skin) -> float:
    """A force, N, with which no taxel can fire, whatever its parts; 0 if unknown."""
    if skin.circuit.saturation:
        return 0.0
    corners = outermost(skin.circuit, DECIDING) if skin.first_specimen else {}
    forces = critical_forces(skin.circuit, records(skin.circuit, corners))
    forces = forces * np.sign(skin.circuit.k_F)
    return float(max(forces.min() * (1 - ROUNDING), 0.0) if forces.min() > 0 else 0.0)


def spans(skin: Skin, loads: Loads) -> tuple[FloatArray, FloatArray]:
    """What the range of the force on each taxel, and that force, stay below, N."""
    low, high = reach(skin.array.places, loads.pressing, skin.duration)
    for one in skin.frames:
        least, most = one.range
        low, high = low + least, high + most
    return high - low + 2 * skin.force_error, high


def _build(stamp: int) -> Callable[..., Any]:
    @entry
    def reach(places: FloatArray, pressing: Any, until: float) -> Any:
        _ = stamp
        n, courses, rows = places.shape[0], pressing.courses, pressing.rows
        low, high = np.zeros(n), np.zeros(n)
        at = np.empty((courses.shape[0], 2))
        for i in range(n):
            placed(places[i, 0], places[i, 1], pressing, at)
            for s in range(courses.shape[0]):
                course = courses[s]
                if course[START] >= until:
                    continue
                strength = course[STRENGTH] * (1.0 + course[VIBRATION])
                if course[HOW] == STILL:
                    value = pressing.area * strength * at[s, 0]
                    low[i] += min(value, 0.0)
                    high[i] += max(value, 0.0)
                    continue
                end = course[START] + (course[TIMES] - 1.0) * course[PERIOD]
                end = min(end + 2.0 * course[RAMP] + course[HOLD], until)
                moves = max(end - course[START] - course[RESTS], 0.0)
                x, y = places[i, 0] - course[AT_X], places[i, 1] - course[AT_Y]
                least = most = 0.0
                for k in range(int(course[FIRST]), int(course[END])):
                    most += most_stress(
                        rows[k], strength, x, y, pressing.depth,
                        course[WAY_X], course[WAY_Y], course[SPEED] * moves,
                    )  # fmt: skip
                    if rows[k, KIND] == UNIFORM:
                        least += strength
                    elif rows[k, KIND] == WAVE:
                        least -= abs(under_wave(rows[k], strength, pressing.depth))
                    elif rows[k, KIND] == STRIP:  # they lie beside one another
                        most = min(most, strength)
                low[i] += pressing.area * min(least, 0.0)
                high[i] += pressing.area * most
        return low, high

    return reach


reach = _build(source_stamp(*SOURCES, Path(__file__)))
