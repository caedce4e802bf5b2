"""Signals that a run does not store but tells: force, rate and drain current."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import RunFolderError
from tactile_lab.model.drain_current import DrainCurrent, drain_currents
from tactile_lab.store.folder import SCENE
from tactile_lab.store.signal import averages
from tactile_lab.store.stored_run import StoredRun

DERIVED = {
    "force": "by the run's calibration from the current that flowed, lags included",
    "rate": "1/ISI of the last two spikes, 0 in a silence",
    "I_DS": "Eq. (16) from V_C1, in steps of about 1 ms",
}
"""By name, what each is derived from."""
STEP = 1e-3
"""V_C1 is averaged over so long before I_DS is derived from it, s."""


def derivable(run: StoredRun) -> tuple[str, ...]:
    """What can be derived of this run."""
    # a folder without a scene knows neither calibration nor circuit
    known = (run.path / SCENE).exists()
    able = {
        "force": known and run.table("current").size > 0,
        "rate": run.detection is not None,
        "I_DS": known and "V_C1" in run.signals and _long_enough(run),
    }
    return tuple(name for name in DERIVED if able[name] and name not in run.signals)


def derivation(run: StoredRun, name: str) -> Callable[[FloatArray], FloatArray]:
    """Gives a derived signal at any times, s, in SI; reads what it rests on once.

    Raises:
        RunFolderError: it rests on something that is not stored.
        SceneError: the run's scene cannot be read any more.
    """
    if name == "force":
        return run.force.at
    if name == "rate":
        changes = run.rate
        return _held(changes["time"], np.append(0.0, changes["rate"]))
    found = drain_current_of(run)
    middles = (found.time[:-1] + found.time[1:]) / 2
    return _held(middles, found.current)


def _window(run: StoredRun) -> int:
    """Samples of V_C1 that are averaged into one."""
    interval = run.signal("V_C1").interval
    return max(1, round(max(STEP, interval) / interval))


def _long_enough(run: StoredRun) -> bool:
    """Whether V_C1 has a slope: three averages without a gap, somewhere."""
    longest = max((b - a for a, b in run.axis.stretches(0, run.samples)), default=0)
    return longest >= 3 * _window(run)


def _held(change: FloatArray, value: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Value 0 until the first change, s, and one more after each."""
    return lambda time: value[np.searchsorted(change, time, side="right")]


def drain_current_of(run: StoredRun) -> DrainCurrent:
    """I_DS by Eq. (16) from the stored V_C1; NaN where that is missing or a limit.

    Raises:
        RunFolderError: V_C1 was not stored, or there are too few samples of it.
        SceneError: the run's scene, which knows the divider, cannot be read any more.
    """
    signal = run.signal("V_C1")
    step = max(STEP, signal.interval)
    spans = run.axis.stretches(0, run.samples)
    pieces = list(averages([signal], spans, _window(run)))
    time = np.concatenate([times for times, _ in pieces] or [np.empty(0)])
    V_C1 = np.concatenate([means[0] for _, means in pieces] or [np.empty(0)])
    parts = drain_currents(time, V_C1, run.scene.circuit)
    if not parts:
        raise RunFolderError(f"{run.path} has too few samples of V_C1 to derive I_DS.")
    times, currents = [parts[0].time], [parts[0].current]
    for part in parts[1:]:
        times += [part.time[:1] - step / 2, part.time]
        currents += [np.array([np.nan]), part.current]
    averaged = max(part.averaged for part in parts)
    found, current = np.concatenate(times), np.concatenate(currents)
    for start, end in run.overrange("V_C1"):
        within = (found > start - averaged / 2) & (found < end + averaged / 2)
        current[within] = np.nan
    return DrainCurrent(found, current, min(part.bandwidth for part in parts), averaged)
