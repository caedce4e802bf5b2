"""Which part of a run to export, and at which rate."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_lab.errors import RunFolderError
from tactile_lab.quantity import show
from tactile_lab.store.stored_run import StoredRun

PIECE = 1 << 18
"""Rows handled at a time."""

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Selection:
    """A part of a run.

    Attributes:
        signals: to export; None for all that are stored.
        start: s on the run's axis.
        end: s on the run's axis; None for the last sample.
        rate: S/s to average down to; None for every sample.
    """

    signals: tuple[str, ...] | None = None
    start: float = 0.0
    end: float | None = None
    rate: float | None = None

    def check(self, run: StoredRun) -> None:
        """Refuse what the run does not have, before a file is touched.

        Raises:
            RunFolderError: a signal that is not stored, a rate above the run's, or a
                time without anything in it.
        """
        names = self.names(run)
        if names:
            self.average(run.signal(names[0]).interval)
        end = run.duration if self.end is None else self.end
        found = self.spans(run) if names else self.start < min(end, run.duration)
        if not found or end <= self.start:
            raise RunFolderError(
                f"The run has nothing from {show(self.start, 's')} until "
                f"{show(end, 's')}; it lasts {show(run.duration, 's')}. Choose a part "
                "that begins before it ends."
            )

    def names(self, run: StoredRun) -> tuple[str, ...]:
        """Signals to export.

        Raises:
            RunFolderError: one of them is not stored.
        """
        if self.signals is None:
            return run.signals
        for name in self.signals:
            run.signal(name)
        return self.signals

    def average(self, interval: float) -> int:
        """Samples averaged into one.

        Raises:
            RunFolderError: a rate above the run's.
        """
        if self.rate is None:
            return 1
        count = round(1.0 / (self.rate * interval))
        if count < 1:
            raise RunFolderError(
                f"The run has {1.0 / interval:g} S/s; it cannot be exported at "
                f"{self.rate:g} S/s."
            )
        return count

    def spans(self, run: StoredRun) -> list[tuple[int, int]]:
        """(first, one past last) sample of each stretch without a gap."""
        names = self.names(run)
        if not names or not run.samples:
            return []
        chosen = run.signal(names[0]).between(self.start, self.end)
        return run.axis.stretches(chosen.start, chosen.stop)

    def rows(self, table: NDArray[Any]) -> NDArray[Any]:
        """Rows of a table whose time, or stretch of time, lies in the part."""
        end = np.inf if self.end is None else self.end
        if "time" in (table.dtype.names or ()):
            return table[(table["time"] >= self.start) & (table["time"] < end)]
        return table[(table["end"] > self.start) & (table["start"] < end)]

    def pieces(self, run: StoredRun) -> Iterator[tuple[FloatArray, list[FloatArray]]]:
        """(times, one array of SI values per signal), a bounded piece at a time."""
        spans = self.spans(run)
        if not spans:
            return
        signals = [run.signal(name) for name in self.names(run)]
        # read once: a scope with gaps leaves thousands of stretches
        axis, count = signals[0].axis, self.average(signals[0].interval)
        step = max(PIECE // count, 1) * count
        for first, last in spans:
            for at in range(first, last, step):
                stop = min(at + step, last)
                edges = np.arange(at, stop, count)
                centre = (edges + np.minimum(edges + count, stop) - 1) / 2
                yield (
                    axis.time_of(centre),
                    [_averaged(signal[at:stop], count) for signal in signals],
                )

    def read(self, run: StoredRun) -> tuple[FloatArray, dict[str, FloatArray]]:
        """Times, s, and the SI values of each signal there, all at once."""
        pieces = list(self.pieces(run))
        none = [np.empty(0)]
        return np.concatenate([times for times, _ in pieces] or none), {
            name: np.concatenate([columns[i] for _, columns in pieces] or none)
            for i, name in enumerate(self.names(run))
        }


def _averaged(values: FloatArray, count: int) -> FloatArray:
    """Means of each `count` values; the last may have fewer."""
    if count == 1:
        return values
    edges = np.arange(0, values.size, count)
    sizes = np.diff(np.append(edges, values.size))
    means: FloatArray = np.add.reduceat(values, edges) / sizes
    return means
