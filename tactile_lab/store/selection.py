"""Which part of a run to export, and at which rate."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import RunFolderError
from tactile_lab.quantity import show
from tactile_lab.store.derived import derivable, derivation
from tactile_lab.store.signal import averages
from tactile_lab.store.stored_run import StoredRun

DERIVED_STEP = 1e-3
"""Derived signals have a value so often in a run that stores no samples, s."""


@dataclass(frozen=True, kw_only=True)
class Selection:
    """A part of a run.

    Attributes:
        signals: to export, stored or derived; None for all there are.
        start: s on the run's axis.
        end: s on the run's axis; None for the last sample.
        rate: S/s to average down to; None for every sample.
    """

    signals: tuple[str, ...] | None = None
    start: float = 0.0
    end: float | None = None
    rate: float | None = None

    def __post_init__(self) -> None:
        """Raises RunFolderError: a rate that is not above 0."""
        if self.rate is not None and self.rate <= 0:
            raise RunFolderError(
                f"A rate of {self.rate:g} S/s holds nothing; give one above 0 S/s."
            )

    def check(self, run: StoredRun) -> None:
        """Refuse what the run does not have, before a file is touched.

        Raises:
            RunFolderError: a signal that is neither stored nor derived, a rate above
                the run's, or a time without anything in it.
        """
        self.names(run)
        if run.signals:
            self.average(run.signal(run.signals[0]).interval)
        end = run.duration if self.end is None else self.end
        part = f"from {show(self.start, 's')} until {show(end, 's')}"
        if end <= max(self.start, 0.0) or self.start >= run.duration:
            raise RunFolderError(
                f"The run has nothing {part}; it lasts {show(run.duration, 's')}. "
                "Choose a part that begins before it ends."
            )
        if run.samples and not self.spans(run):
            raise RunFolderError(
                f"The run has no sample {part}: that is a planned pause, or a gap. "
                "Choose a longer part."
            )

    def names(self, run: StoredRun) -> tuple[str, ...]:
        """Signals to export.

        Raises:
            RunFolderError: one of them is neither stored nor derived.
        """
        known = (*run.signals, *derivable(run))
        for name in self.signals or ():
            if name not in known:
                raise RunFolderError(
                    f"{run.path} stores no {name}, nor can it be derived; there is "
                    f"{', '.join(known) or 'no signal'}."
                )
        return known if self.signals is None else tuple(dict.fromkeys(self.signals))

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
        if not run.samples:
            return []
        chosen = run.signal(run.signals[0]).between(self.start, self.end)
        return run.axis.stretches(chosen.start, chosen.stop)

    def of(self, table: NDArray[Any]) -> NDArray[Any]:
        """Rows of a table whose time, or stretch of time, lies in the part."""
        if "time" in (table.dtype.names or ()):
            return table[self.holds(table["time"])]
        end = np.inf if self.end is None else self.end
        return table[(table["end"] > self.start) & (table["start"] < end)]

    def holds(self, time: FloatArray) -> NDArray[np.bool_]:
        """Which of these times, s, lie in the part."""
        end = np.inf if self.end is None else self.end
        found: NDArray[np.bool_] = (time >= self.start) & (time < end)
        return found

    def ends(self, run: StoredRun) -> tuple[float, float]:
        """Where the part begins and ends within the run, s."""
        end = run.duration if self.end is None else min(self.end, run.duration)
        return max(self.start, 0.0), end

    def told(self, run: StoredRun) -> dict[str, float]:
        """What the part is, where it is not the whole run, and its sample rate."""
        found = {}
        if self.start > 0 or self.end is not None:
            start, end = self.ends(run)
            found = {"from_s": start, "until_s": end}
        if self.names(run):
            found["sample_rate_Hz"] = round(1 / self._step(run), 6)
        if run.samples and self.rate is not None:
            interval = run.signal(run.signals[0]).interval
            found["samples_averaged"] = float(self.average(interval))
        return found

    def _step(self, run: StoredRun) -> float:
        """Time from row to row, s."""
        if run.samples:
            interval = run.signal(run.signals[0]).interval
            return self.average(interval) * interval
        return DERIVED_STEP if self.rate is None else 1 / self.rate

    def _times(self, run: StoredRun) -> FloatArray:
        """When signals are told that are derived of a run without samples, s."""
        if run.samples or not self.names(run):
            return np.empty(0)
        (start, end), step = self.ends(run), self._step(run)
        # a last one that rounding alone keeps in front of the end is left out
        count = int(np.ceil((end - start) / step - 1e-6))
        return start + step * np.arange(count, dtype=np.float64)

    def rows(self, run: StoredRun) -> int:
        """How many rows `pieces` gives in all."""
        if not run.samples:
            return self._times(run).size
        spans = self.spans(run)
        count = self.average(run.signal(run.signals[0]).interval) if spans else 1
        return sum(-(-(last - first) // count) for first, last in spans)

    def stretches(self, run: StoredRun, count: int, rows: int) -> list[Selection]:
        """Parts of `rows` rows each, `count` of them over all; itself where short."""
        whole = self.rows(run)
        if whole <= count * rows:
            return [self] if whole else []
        begins: NDArray[Any]
        if run.samples:
            spans = self.spans(run)
            size = rows * self.average(run.signal(run.signals[0]).interval)
            begins = np.linspace(spans[0][0], spans[-1][1] - size, count).astype(int)
            starts = run.axis.time_of(begins)
            ends = run.axis.time_of(begins + size - 1)
        else:
            (start, end), length = self.ends(run), rows * self._step(run)
            starts = np.linspace(start, end - length, count)
            ends = starts + length
        bounds = zip(starts.tolist(), ends.tolist(), strict=True)
        return [replace(self, start=start, end=end) for start, end in bounds]

    def pieces(self, run: StoredRun) -> Iterator[tuple[FloatArray, list[FloatArray]]]:
        """(times, one array of SI values per signal), a bounded piece at a time.

        Raises:
            RunFolderError: what a derived signal rests on is not stored.
            SceneError: a derived signal needs the run's scene, which cannot be read.
        """
        spans, names = self.spans(run), self.names(run)
        if (time := self._times(run)).size:
            yield time, [derivation(run, name)(time) for name in names]
        if not spans:
            return
        stored = [name for name in names if name in run.signals]
        axis = run.signal(run.signals[0])
        made = {n: derivation(run, n) for n in names if n not in stored}
        read = averages(
            [run.signal(name) for name in stored] or [axis],
            spans,
            self.average(axis.interval),
        )
        for time, columns in read:
            found = dict(zip(stored, columns, strict=False))
            yield time, [made[n](time) if n in made else found[n] for n in names]

    def read(self, run: StoredRun) -> tuple[FloatArray, dict[str, FloatArray]]:
        """Times, s, and the SI values of each signal there, all at once."""
        pieces = list(self.pieces(run))
        none = [np.empty(0)]
        return np.concatenate([times for times, _ in pieces] or none), {
            name: np.concatenate([columns[i] for _, columns in pieces] or none)
            for i, name in enumerate(self.names(run))
        }
