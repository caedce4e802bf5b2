"""A run's signals in columns of one time axis, those it did not store among them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tactile_lab.errors import RunFolderError
from tactile_lab.model.drain_current import DrainCurrent, drain_current
from tactile_lab.store.selection import Selection
from tactile_lab.store.stored_run import StoredRun

FloatArray = NDArray[np.float64]

DERIVED = ("force", "rate", "I_DS")
STEP = 1e-3
"""V_C1 is averaged over so long before I_DS is derived from it, s."""


def table(
    run: StoredRun,
    start: float,
    end: float | None,
    signals: Sequence[str] | None,
    rate: float | None,
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Times, s, and the values of each signal there, SI (see `Run.to_xarray`).

    Raises:
        RunFolderError: a signal is neither stored nor derived, or needs one that is
            not stored.
    """
    if signals is None:  # a folder without a scene knows no force
        known = (run.path / "scene.toml").exists()
        signals = (*run.signals, "force") if known else run.signals
    names = (signals,) if isinstance(signals, str) else tuple(signals)
    stored = tuple(name for name in names if name not in DERIVED)
    axis = stored or run.signals[:1]
    part = Selection(signals=axis, start=start, end=end, rate=rate)
    time, read = part.read(run)
    if not time.size:
        return time, dict.fromkeys(names, time)
    return time, {
        name: _derived(run, name, time) if name in DERIVED else read[name]
        for name in names
    }


def _derived(run: StoredRun, name: str, time: FloatArray) -> FloatArray:
    if name == "force":
        return run.force.at(time)
    if name == "I_DS":
        found = drain_current_of(run)
        return np.interp(time, found.time, found.current)
    rates = run.rate
    values: FloatArray = np.concatenate([[0.0], rates["rate"]])
    return values[np.searchsorted(rates["time"], time, side="right")]


def drain_current_of(run: StoredRun) -> DrainCurrent:
    """I_DS by Eq. (16) from the stored V_C1; NaN where samples are missing.

    Raises:
        RunFolderError: V_C1 was not stored, or there are too few samples of it.
        SceneError: the run's scene, which knows the divider, cannot be read any more.
    """
    step = max(STEP, run.signal("V_C1").interval)
    time, read = Selection(signals=("V_C1",), rate=1 / step).read(run)
    V_C1, circuit = read["V_C1"], run.scene.circuit
    even = np.abs(np.diff(time) - np.median(np.diff(time))) < 0.01 * step
    edges = np.flatnonzero(~even) + 1  # gaps, and last means of fewer samples
    parts = [
        drain_current(t, v, circuit)
        for t, v in zip(np.split(time, edges), np.split(V_C1, edges), strict=True)
        if t.size >= 3
    ]
    if not parts:
        raise RunFolderError(f"{run.path} has too few samples of V_C1 to derive I_DS.")
    times, currents = [parts[0].time], [parts[0].current]
    for part in parts[1:]:
        times += [part.time[:1] - step / 2, part.time]
        currents += [np.array([np.nan]), part.current]
    return DrainCurrent(
        np.concatenate(times),
        np.concatenate(currents),
        min(part.bandwidth for part in parts),
        max(part.averaged for part in parts),
    )
