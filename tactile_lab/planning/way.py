"""By which way the coil gives a trial's force: one rule, for the plan and for the run.

Set-points need nothing but a slow line, and the force goes in stairs. A list that the
source plays by its own clock has steps as short as its dwell, and takes time to load.
The first of these whose force is as near as the scene wants is taken, else the nearest.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tactile_lab.current_list import CurrentList
from tactile_lab.drive import Drive
from tactile_lab.errors import LimitError, SceneError
from tactile_lab.instruments.registry import BY_PERSON, coil_capability
from tactile_lab.magnetics import Magnet
from tactile_lab.planning.current import cut, limited, wanted_current
from tactile_lab.quantity import show
from tactile_lab.scene.bench_file import CoilSpec
from tactile_lab.scene.scene import Scene
from tactile_lab.trial import Trial
from tactile_lab.waveform import Waveform

AT_ZERO = 1e-5
"""Current that counts as none, A."""


def drive_for(
    trial: Trial, scene: Scene, before: float, update_interval: float | None = None
) -> Drive:
    """How the coil gives `trial`.

    Args:
        trial: its force, or its current where it asks for one.
        scene: bench, and how near the force must be.
        before: current just before the trial, A.
        update_interval: time between two set-points, s; what the source promises
            unless given.

    Raises:
        LimitError: beyond the coil's limit, the calibration, or a source that gives
            current of one sign.
        SceneError: there is no such source, or not the way that the scene names.
    """
    coil, magnet = scene.bench.coil, scene.bench.magnet
    if coil is None:
        raise SceneError(f"bench {scene.bench.name} has no [coil].")
    wanted = wanted_current(trial, magnet, coil)
    asked = None if trial.current is not None else cut(trial.force, trial.length)
    interval = update_interval or coil_capability(coil).update_interval
    steps = _set_points(wanted, asked, magnet, coil, before, interval)
    way, enough = scene.coil.way, scene.force_accuracy
    if asked is None or asked.peak == 0 or way == "set-points":
        return steps
    range_ = float(np.ptp(np.append(asked.value, 0.0)))
    if way == "auto" and steps.error is not None and steps.error <= enough * range_:
        return steps
    try:
        points = _list(trial, scene, wanted, asked, before)
    except LimitError as reason:
        if way == "list":
            raise SceneError(
                f'trial "{trial.label}" cannot be played as a list: {reason} Leave '
                '[coil] way = "list" out.'
            ) from reason
        return replace(steps, why=f"{steps.why}. No list: {reason}")
    if points.error is None or steps.error is None or points.error < steps.error:
        return points
    return steps


def _set_points(
    wanted: Waveform,
    asked: Waveform | None,
    magnet: Magnet,
    coil: CoilSpec,
    before: float,
    interval: float,
) -> Drive:
    """Played by set-points, one each `interval` s."""
    played, warning = limited(wanted, coil.limits.slew, interval, before)
    played = cut(played, wanted.end)
    why = f"one each {show(interval, 's', 3)}"
    if asked is None:
        return Drive(played, why=why, warning=warning)
    starts = np.arange(0.0, wanted.end, interval)
    error = _error(asked, starts, played.at(starts), magnet)
    return Drive(played, error=error, why=why, warning=warning)


def _list(
    trial: Trial, scene: Scene, wanted: Waveform, asked: Waveform, before: float
) -> Drive:
    """Played as a list.

    Raises:
        LimitError: it cannot be, and why.
    """
    coil, magnet, meter = scene.bench.coil, scene.bench.magnet, scene.bench.field_meter
    assert coil is not None
    can = coil_capability(coil).lists
    if can is None:
        raise LimitError(f"{coil_capability(coil).title} plays none.")
    if trial.pause:
        raise LimitError("in a pause nothing is recorded.")
    if meter is not None and meter.driver == BY_PERSON and trial.hold is not None:
        raise LimitError("a person reads the field, for which a list does not wait.")
    for current in (before, float(wanted.value[-1])):
        if abs(current) > AT_ZERO:
            raise LimitError(
                "a list begins and ends at 0 A, and this trial does not "
                f"({show(current, 'A')})."
            )
    played, warning = limited(wanted, coil.limits.fastest, can.shortest, before)
    played = cut(played, wanted.end)
    points = CurrentList.following(played, can)
    error = _error(asked, points.starts, points.currents, magnet)
    load = can.load_time(len(points))
    dwells = points.dwells[:-1]
    why = (
        f"{len(points)} points of {show(float(dwells.min()), 's', 3)} and more, loaded "
        f"in {show(load, 's', 2)}"
    )
    return Drive(played, points, error=error, why=why, warning=warning, load=load)


def _error(
    asked: Waveform,
    starts: NDArray[np.float64],
    currents: NDArray[np.float64],
    magnet: Magnet,
) -> float:
    """Largest difference of the force asked for and that of a stair of currents, N.

    Within a step it is largest where the step begins or ends, or at a corner between.
    """
    force = magnet.force(currents)
    ends = np.append(starts[1:], max(asked.end, starts[-1]))
    ends = np.nextafter(ends, -np.inf)
    step = np.clip(np.searchsorted(starts, asked.time, side="right") - 1, 0, None)
    left = np.nextafter(asked.time, -np.inf)
    differences = (
        asked.at(starts) - force,
        asked.at(ends) - force,
        asked.value - force[step],
        asked.at(left) - force[np.clip(np.searchsorted(starts, left) - 1, 0, None)],
    )
    return float(max(np.abs(one).max() for one in differences))
