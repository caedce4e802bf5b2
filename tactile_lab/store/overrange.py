"""When inputs left their range, as the scope told: what they read then is a limit."""

from __future__ import annotations

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.quantity import count, show
from tactile_lab.store.stored_run import StoredRun

NEAR_END = 0.98
"""Part of a channel's full scale from which on it is taken to be at its end."""


def unsearched(run: StoredRun) -> FloatArray:
    """Stretches in which spikes could not be told, shape (k, 2), s.

    A spike that is cut off at its top is counted and timed where it crosses the
    threshold. It is not where its channel lay at the other end of the range, or never
    below the threshold; nor where resets of V_C2 are looked for in what was cut off.
    """
    detection = run.detection
    if detection is None or detection.signal not in run.signals:
        return np.empty((0, 2))
    found = run.overrange(detection.signal)
    if detection.kind == "reset" or not len(found):
        return found
    signal, sign = run.signal(detection.signal), detection.polarity
    other_end = -NEAR_END * float(run.attributes["full_scale"])
    blind = []
    for start, end in found:
        part = signal.between(start, end)
        cells = signal.trace(part.start, part.stop, cells=200)
        low, mean, high = (
            sign * (side - signal.offset) / signal.gain * signal.code_scale
            for side in (cells.low, cells.mean, cells.high)
        )
        reached = float(np.nanmin([low, high])) <= other_end
        blind.append(reached or float(np.nanmedian(mean)) >= sign * detection.threshold)
    kept: FloatArray = found[np.array(blind)]
    return kept


def told(run: StoredRun) -> tuple[str, ...]:
    """A sentence for each signal that left its range, with channel and times."""
    return tuple(
        _sentence(run, name, found)
        for name in run.signals
        if (found := run.overrange(name)).size
    )


def _sentence(run: StoredRun, name: str, found: FloatArray) -> str:
    signal = run.signal(name)
    low, high = signal.span
    times = f"at {found[0, 0]:.4g} to {found[0, 1]:.4g} s"
    if len(found) > 1:
        times += f" and {count(len(found) - 1, 'more time')} until {found[-1, 1]:.4g} s"
    spent = float(np.sum(found[:, 1] - found[:, 0]))
    detection = run.detection
    searched = detection is not None and detection.signal == name
    if searched and not unsearched(run).size:
        what = (
            "It was cut off there, above the threshold: spikes are counted and timed, "
            "their heights are not told."
        )
    elif name == "coil_current":
        what = (
            "It was cut off there: steps of the current in these times are not dated "
            "by it."
        )
    else:
        what = "It was cut off there: numbers from these times are wrong."
    return (
        f"{name} left the range of scope input {signal.attributes['input']}, "
        f"{show(low, signal.unit)} to {show(high, signal.unit)}, {times} "
        f"({show(spent, 's', 3)} in all). {what} Choose a larger range or another "
        "offset in the bench file."
    )
