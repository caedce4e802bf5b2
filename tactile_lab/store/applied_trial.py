"""When the force of each trial begins to change, and when it stands.

A latency counts from the one, peak and final rate within the other. A coil that is set
over a serial line comes to both later than asked.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from tactile_lab.errors import SceneError
from tactile_lab.scene.scene import Scene
from tactile_lab.stimulus.force import ForceProtocol
from tactile_lab.trial import ROUNDING
from tactile_lab.waveform import Waveform

if TYPE_CHECKING:  # the window counts from here before it has loaded what reads runs
    from tactile_lab.store.stored_run import Records, StoredRun

LEAVES = 1e-3
"""Part of its fall by which a current has left its hold."""


def onsets(run: StoredRun, trials: Records) -> list[float | None]:
    """Of each trial, s from its start; None where the force applied stands still.

    Raises:
        SceneError: the run's scene cannot be read any more.
    """
    if "onset" in (trials.dtype.names or ()):
        asked = trials["onset"].tolist()
    else:  # older runs lack it
        asked = [_first_onset(run.scene)] * len(trials)
    return [
        None if math.isnan(at) else begun(at, run.force, float(start), float(end))
        for at, start, end in zip(asked, trials["start"], trials["end"], strict=True)
    ]


def holds(run: StoredRun, trials: Records) -> list[tuple[float, float] | None]:
    """Of each trial, (start, end) of its hold, s from its start; None without one.

    As asked where the run's scene cannot be read any more: its force is not known.
    """
    try:
        force = run.force
    except SceneError:
        return [_asked(row) for row in trials]
    return [
        stood(
            _asked(row),
            float(row["level"]),
            force,
            run.setpoint,
            float(row["start"]),
            float(row["end"]),
        )
        for row in trials
    ]


def _asked(trial: Any) -> tuple[float, float] | None:
    """(start, end) of the hold asked for, s from the trial's start, or None."""
    start, end = float(trial["hold_start"]), float(trial["hold_end"])
    return None if math.isnan(start) else (start, end)


def stood(
    asked: tuple[float, float] | None,
    level: float | None,
    force: Waveform,
    current: Waveform,
    start: float,
    end: float,
) -> tuple[float, float] | None:
    """When the force stood in a trial, (start, end) s from its start; None: no hold.

    From when it came within 1 % of what it was amid the hold to just before the current
    began to leave that, both no earlier than asked. As asked without one level, and at
    0 N, which nothing comes near to by parts.

    Args:
        asked: (start, end) of the hold, s from the trial's start, or None.
        level: N; None or not a number where the trial has no one level.
        force: as applied, N; the current itself where the lags behind it do not count.
        current: as applied, A.
        start: of the trial, s on the axis of both.
        end: of the trial, likewise.
    """
    if asked is None or level is None or not abs(level) > 0:
        return asked
    middle = start + (asked[0] + asked[1]) / 2
    came = force.arrival(middle, start)
    left = current.departure(middle, end, LEAVES)
    over = asked[1] if left is None else left - start - ROUNDING
    return max(asked[0], came - start), max(asked[1], over)


def begun(asked: float, applied: Waveform, start: float, end: float) -> float | None:
    """When `applied` began to change in a trial, s from its start; None if never.

    A coil that is set over a serial line begins later than asked, and still ends the
    trial before when this one begins: that is no change of this one's.

    Args:
        asked: when it was to begin, s from the trial's start.
        applied: force or current.
        start: of the trial, s on the axis of `applied`.
        end: of the trial, likewise.
    """
    left = applied.departure(start + asked, end)
    return None if left is None else left - start


def _first_onset(scene: Scene) -> float:
    """When the first presentation of the scene's protocol begins to change it, s."""
    if not isinstance(scene.protocol, ForceProtocol):
        return 0.0
    return next(scene.protocol.presentations()).onset or 0.0
