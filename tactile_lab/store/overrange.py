"""When inputs left their range, as the scope told: what they read then is a limit."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tactile_lab.quantity import show
from tactile_lab.store.stored_run import StoredRun

FloatArray = NDArray[np.float64]


def overrange(run: StoredRun, signal: str) -> FloatArray:
    """Stretches in which a stored signal left its range, shape (k, 2), s.

    The scope tells it block by block: a stretch is as long as the blocks are.
    """
    rows = run.records("overrange")
    rows = rows[rows["channels"] >> run.signal(signal).row & 1 == 1]
    if not rows.size:
        return np.empty((0, 2))
    first, stop = rows["sample"], rows["sample"] + rows["samples"]
    edges = [0, *(np.flatnonzero(first[1:] != stop[:-1]) + 1).tolist(), rows.size]
    joined = [(first[a], stop[b - 1]) for a, b in pairwise(edges)]
    return run.axis.time_of(np.array(joined))


def told(run: StoredRun) -> tuple[str, ...]:
    """A sentence for each signal that left its range, with channel and times."""
    return tuple(
        _sentence(run, name, found)
        for name in run.signals
        if (found := overrange(run, name)).size
    )


def _sentence(run: StoredRun, name: str, found: FloatArray) -> str:
    signal = run.signal(name)
    low, high = signal.span
    times = f"at {found[0, 0]:.4g} to {found[0, 1]:.4g} s"
    if len(found) > 1:
        times += f" and {len(found) - 1} more times until {found[-1, 1]:.4g} s"
    spent = float(np.sum(found[:, 1] - found[:, 0]))
    return (
        f"{name} left the range of scope input {signal.attributes['input']}, "
        f"{show(low, signal.unit)} to {show(high, signal.unit)}, {times} "
        f"({show(spent, 's', 3)} in all). It was cut off there: numbers from these "
        "times are wrong. Choose a larger range or another offset in the bench file."
    )
