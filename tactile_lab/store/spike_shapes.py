"""The shape of spikes: the stored samples around some of them, on one axis.

Each spike's time is where its samples cross the threshold, interpolated between two of
them. Laid over each other at that time, spikes of one shape fall on one line, and their
samples show it more closely than any one of them was sampled.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import RunFolderError
from tactile_lab.store.run import Run

BEFORE, AFTER = 4.0, 10.0
"""What is read around a spike, in widths of an ordinary one."""

LEAST = 12
"""Samples that are read on either side of it, at least."""

MOST = 4000
"""Samples that are read around one spike, at most."""


@dataclass(frozen=True, eq=False)
class SpikeShapes:
    """Samples of the signal that spikes were searched in, around some of them.

    Attributes:
        signal: its name.
        threshold: SI; None where spikes are resets and no level is crossed.
        times: shape (k,), of the spikes, s on the run's axis.
        peaks: shape (k,), furthest value of each as it was detected, SI.
        widths: shape (k,), time each stayed beyond the threshold less its hysteresis,
            s; not a number where the record ends in it.
        after: shape (k, n), time of each sample after its spike's, s.
        values: shape (k, n), SI; not a number where nothing was stored.
    """

    signal: str
    threshold: float | None
    times: FloatArray
    peaks: FloatArray
    widths: FloatArray
    after: FloatArray
    values: FloatArray


def threshold_of(run: Run) -> float | None:
    """The level, SI, at which a spike was counted; None where none is known.

    Where resets were searched there is none, nor where the signal was not stored.
    """
    found = run.detection
    if found is None or found.kind == "reset" or found.signal not in run.signals:
        return None
    signal = run.signal(found.signal)
    return found.threshold / signal.code_scale * signal.gain + signal.offset


def spike_shapes(run: Run, times: FloatArray) -> SpikeShapes:
    """Read the samples around the spikes of `run` that are nearest to `times`, s.

    Raises:
        RunFolderError: spikes were not searched for, none was found, or the signal that
            has them was not stored.
    """
    found, spikes = run.detection, run.spikes
    if found is None or not spikes.size:
        raise RunFolderError(f"{run.name} has no spike that could be shown.")
    signal = run.signal(found.signal)
    ends = np.concatenate(([-np.inf], spikes["time"], [np.inf]))
    right = np.searchsorted(spikes["time"], times)
    nearer = times - ends[right] < ends[right + 1] - times
    wanted = spikes[np.unique(np.clip(right - nearer, 0, spikes.size - 1))]
    known = spikes["width"][np.isfinite(spikes["width"])]
    width = np.median(known) / signal.interval if known.size else float(found.span)
    before = int(np.clip(BEFORE * width, LEAST, MOST * BEFORE / (BEFORE + AFTER)))
    after = int(np.clip(AFTER * width, LEAST, MOST - before))
    first = np.ceil(wanted["sample"]).astype(np.int64) - before
    each = first[:, None] + np.arange(before + after)
    values = np.full(each.shape, np.nan)
    for row, start in enumerate(first.tolist()):
        low, high = max(start, 0), min(start + before + after, len(signal))
        values[row, low - start : high - start] = signal[low:high]
    since = signal.axis.time_of(each.ravel()).reshape(each.shape)
    level = threshold_of(run)
    return SpikeShapes(
        signal=signal.name,
        threshold=level,
        times=wanted["time"],
        peaks=wanted["amplitude"],
        widths=wanted["width"],
        after=since - wanted["time"][:, None],
        values=values,
    )
