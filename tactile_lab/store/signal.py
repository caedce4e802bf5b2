"""One stored signal: codes on disk, SI values when asked for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.signals import SIGNALS
from tactile_lab.store.columns import pyramid_of
from tactile_lab.store.layout import BIN
from tactile_lab.trace import Trace

PIECE = 1 << 20
"""Samples read at a time."""
ROWS = 1 << 18
"""Samples handed on at a time, of each signal."""
AT_ONCE = 1 << 20
"""Bins of the pyramid read at once, and kept where there are no more: 15 MB."""


@dataclass(frozen=True, eq=False)
class TimeAxis:
    """Where stored samples lie in time: stretches without a gap.

    Attributes:
        first: shape (k,), index of each stretch's first stored sample, ascending.
        time: shape (k,), of that sample, s on the run's axis.
        step: shape (k,), time from sample to sample, drift included, s.
    """

    first: NDArray[np.int64]
    time: FloatArray
    step: FloatArray

    def stretches(self, start: int, stop: int) -> list[tuple[int, int]]:
        """(first, one past last) of samples start to stop in each stretch."""
        edges = np.clip([*self.first.tolist(), stop], start, stop).tolist()
        return [(first, last) for first, last in pairwise(edges) if first < last]

    def time_of(self, sample: NDArray[Any] | float) -> FloatArray:
        """Run time of (fractional) stored sample indices, any shape, s."""
        index = np.asarray(sample, dtype=np.float64)
        if self.first.size == 1:
            one: FloatArray = self.time[0] + (index - self.first[0]) * self.step[0]
            return one
        which = np.searchsorted(self.first, index, side="right") - 1
        which = np.maximum(which, 0)
        at: FloatArray = (
            self.time[which] + (index - self.first[which]) * self.step[which]
        )
        return at

    def step_at(self, sample: int) -> float:
        """Time from sample to sample in the stretch of that stored sample, s."""
        which = int(np.searchsorted(self.first, sample, side="right")) - 1
        return float(self.step[max(which, 0)])

    def sample_at(self, time: float) -> int:
        """Index of the first stored sample at or after `time`, s."""
        which = max(int(np.searchsorted(self.time, time, side="right")) - 1, 0)
        index = int(self.first[which])
        past = (time - self.time[which]) / self.step[which]
        # a time that a sample was computed from must lead back to that sample
        index += max(0, int(np.ceil(past - 1e-6)))
        if which + 1 < self.first.size:
            return min(index, int(self.first[which + 1]))
        return index

    def after_gaps(self, least: float) -> NDArray[np.int64]:
        """Samples before which more than `least` s were not sampled, ascending."""
        ends = self.time[:-1] + np.diff(self.first) * self.step[:-1]
        return self.first[1:][self.time[1:] - ends > least]


class StoredSignal:
    """A signal of a run; reads from disk only what is indexed.

    ``signal[a:b]`` gives samples a to b in the SI unit, ``signal.codes[a:b]`` the
    integers as stored.

    Attributes:
        name: such as "V_C1".
        unit: SI.
        interval: s from sample to sample.
        axis: sample indices to run time.
        gain, offset: value = gain * stored code + offset.
        code_scale: scope code = code_scale * stored code.
    """

    def __init__(
        self,
        name: str,
        samples: h5py.Dataset,
        pyramid: h5py.Dataset,
        length: int,
        axis: TimeAxis,
    ) -> None:
        self.name = name
        self.unit = str(samples.attrs["unit"])
        self.interval = float(samples.attrs["interval"])
        self.axis = axis
        self.gain = float(samples.attrs["gain"])
        self.offset = float(samples.attrs["offset"])
        self.code_scale = int(samples.attrs["code_scale"])
        self._samples = samples
        self._pyramid = pyramid
        self._length = length
        self._bins: NDArray[Any] | None = None

    @property
    def title(self) -> str:
        """For axes and legends."""
        known = SIGNALS.get(self.name)
        return known.title if known else self.name

    @property
    def span(self) -> tuple[float, float]:
        """Lowest and highest value its channel could see, in the SI unit."""
        full = float(self._samples.file.attrs["full_scale"]) / self.code_scale
        ends = (end * self.gain + self.offset for end in (-full, full))
        low, high = sorted(ends)
        return low, high

    @property
    def row(self) -> int:
        """Its bit in the table `overrange`; older runs have them as they are named."""
        names = list(self._samples.parent)
        return int(self._samples.attrs.get("row", names.index(self.name)))

    @property
    def attributes(self) -> dict[str, Any]:
        """Scope input, range, coupling and scaling as stored."""
        return dict(self._samples.attrs)

    def __len__(self) -> int:
        return self._length

    def __getitem__(self, key: slice | int) -> Any:
        codes = self.codes[key]
        if isinstance(codes, np.ndarray):
            values = codes.astype(np.float64)
            values *= self.gain
            values += self.offset
            return values
        return float(codes) * self.gain + self.offset

    @property
    def codes(self) -> Codes:
        """The stored integers."""
        return Codes(self._samples, self._length)

    def scope_codes(self, start: int, stop: int) -> NDArray[np.int16]:
        """Samples start to stop as the scope gave them, int16."""
        codes = self.codes[start:stop].astype(np.int16)
        codes *= self.code_scale
        return codes  # type: ignore[no-any-return]

    def time(self, start: int = 0, stop: int | None = None) -> FloatArray:
        """Run time of samples start to stop, s."""
        return self.axis.time_of(np.arange(*slice(start, stop).indices(self._length)))

    def between(self, start: float, end: float | None = None) -> slice:
        """Samples with start <= time < end, s on the run's axis; None: to the last."""
        last = self._length if end is None else self.axis.sample_at(end)
        first = self.axis.sample_at(start)
        return slice(min(first, self._length), min(last, self._length))

    def trace(
        self, start: int = 0, stop: int | None = None, *, cells: int = 1000
    ) -> Trace:
        """Samples start to stop in about `cells` cells, at once for any length.

        Wide views come from the stored pyramid (their ends fall on its bins), narrow
        ones from the samples.
        """
        start, stop, _ = slice(start, stop).indices(self._length)
        if start >= stop:
            return Trace.nothing(self.name, self.unit)
        per = max(1, -(-(stop - start) // max(cells, 1)))
        if per < BIN:
            codes = self.codes[start:stop]
            every = np.arange(start, stop)
            return self._cells(every, stop, per, (codes, codes, codes))
        first, last, cell = start // BIN, -(-stop // BIN), -(-per // BIN)
        many = max(1, AT_ONCE // cell) * cell
        parts = [
            self._of_bins(at, min(at + many, last), cell, first=at == first)
            for at in range(first, last, many)
        ]
        if len(parts) == 1:
            return parts[0]
        return replace(
            parts[0],
            time=np.concatenate([part.time for part in parts]),
            low=np.concatenate([part.low for part in parts]),
            high=np.concatenate([part.high for part in parts]),
            mean=np.concatenate([part.mean for part in parts]),
            gap=np.concatenate([part.gap for part in parts]),
        )

    def _of_bins(self, begin: int, end: int, cell: int, *, first: bool) -> Trace:
        """Bins of the pyramid, numbers `begin` to `end`, as cells of `cell` of them."""
        starts, bins = self._whole_in_time(begin, self._bins_between(begin, end))
        columns = (bins["low"], bins["high"], bins["sum"])
        stop = min(end * BIN, self._length)
        return self._cells(starts, stop, cell * BIN, columns, first=first)

    def _cells(
        self,
        starts: NDArray[np.int64],
        end: int,
        per: int,
        columns: tuple[Any, Any, Any],
        *,
        first: bool = True,
    ) -> Trace:
        """Join what lies in `per` samples; after a gap as long a new cell begins.

        Args:
            starts: first sample of each entry, ascending.
            end: one past the last sample of the last entry.
            per: samples in a cell.
            columns: smallest, largest and sum of each entry.
            first: whether nothing comes before them.
        """
        low, high, total = columns
        width = per * self.interval
        late = self.axis.after_gaps(width - self.interval / 2)
        begins = first or bool(np.isin(starts[0], late))
        late = np.searchsorted(starts, late[(late > starts[0]) & (late < end)])
        edges = np.searchsorted(starts, np.arange(starts[0], end, per))
        if late.size:
            edges = np.union1d(edges, late)
        starts = starts[edges]
        count = np.diff(starts, append=end)
        mean = np.add.reduceat(total, edges, dtype=np.int64) / count
        one = np.minimum.reduceat(low, edges).astype(np.float64)
        other = np.maximum.reduceat(high, edges).astype(np.float64)
        one, other, mean = (v * self.gain + self.offset for v in (one, other, mean))
        # a negative gain turns smallest into largest
        least, most = np.minimum(one, other), np.maximum(one, other)
        gap = np.zeros(edges.size, np.bool_)
        gap[np.searchsorted(edges, late)] = True
        gap[0] = begins
        time = self.axis.time_of(starts)
        return Trace(time, least, most, mean, gap, width, self.name, self.unit)

    def _whole_in_time(
        self, first: int, bins: NDArray[Any]
    ) -> tuple[NDArray[np.int64], NDArray[Any]]:
        """Bins from number `first` on, those that reach across a gap cut there.

        Returns:
            First sample of each, and the bins.
        """
        starts = np.arange(first * BIN, (first + len(bins)) * BIN, BIN)
        cuts = self.axis.first[self.axis.first % BIN > 0]
        cuts = cuts[(cuts > first * BIN) & (cuts < self._length)]
        cuts = cuts[cuts < (first + len(bins)) * BIN]
        if cuts.size == 0:
            return starts, bins
        torn = np.unique(cuts // BIN) * BIN
        kept = ~np.isin(starts, torn)
        begins = np.union1d(torn, cuts)
        stops = np.minimum(
            np.append(begins[1:], self._length), (begins // BIN + 1) * BIN
        )
        parts = self._parts(begins, stops, bins.dtype)
        starts = np.concatenate([starts[kept], begins])
        order = np.argsort(starts)
        return starts[order], np.concatenate([bins[kept], parts])[order]

    def _parts(
        self, starts: NDArray[np.int64], stops: NDArray[np.int64], kind: np.dtype[Any]
    ) -> NDArray[Any]:
        """Smallest, largest and sum of samples starts to stops, at most `BIN` each."""
        pieces: list[NDArray[Any]] = []
        while len(pieces) < starts.size:
            # many small reads would each decompress their chunk anew
            row = len(pieces)
            last = int(np.searchsorted(starts, starts[row] + PIECE))
            begin = int(starts[row])
            codes = self.codes[begin : int(stops[last - 1])]
            pieces += [
                codes[starts[k] - begin : stops[k] - begin] for k in range(row, last)
            ]
        codes, counts = np.concatenate(pieces), stops - starts
        edges = np.cumsum(counts) - counts
        parts = np.empty(starts.size, kind)
        parts["low"] = np.minimum.reduceat(codes, edges)
        parts["high"] = np.maximum.reduceat(codes, edges)
        parts["sum"] = np.add.reduceat(codes, edges, dtype=np.int64)
        return parts

    def _bins_between(self, first: int, last: int) -> NDArray[Any]:
        """Entries of the pyramid; one that is not large is read as a whole and kept."""
        count = -(-self._length // BIN)
        if self._bins is not None and len(self._bins) >= count:
            return self._bins[first:last]
        if last - first < count // 4 or count > AT_ONCE:
            return self._read_bins(first, last)
        self._bins = self._read_bins(0, count)
        return self._bins[first:last]

    def _read_bins(self, first: int, last: int) -> NDArray[Any]:
        """What a crash kept out of the stored pyramid comes from the samples."""
        # the last stored bin may have been short when it was written
        have = min(max(len(self._pyramid) - 1, 0), self._length // BIN)
        middle = min(max(first, have), last)
        stored = self._pyramid[first:middle]
        rest = pyramid_of(self.codes[middle * BIN : last * BIN])
        return np.concatenate([stored, rest])


def averages(
    signals: Sequence[StoredSignal], spans: Sequence[tuple[int, int]], count: int = 1
) -> Iterator[tuple[FloatArray, list[FloatArray]]]:
    """Signals averaged down, a bounded piece at a time, each stretch for itself.

    Args:
        signals: of one run, at least one.
        spans: (first, one past last) sample of stretches without a gap.
        count: samples averaged into one; the last of a stretch may have fewer.

    Yields:
        Times, s, and an array of SI values per signal.
    """
    axis = signals[0].axis
    step = max(ROWS // count, 1) * count
    for first, last in spans:
        for at in range(first, last, step):
            stop = min(at + step, last)
            edges = np.arange(at, stop, count)
            centre = (edges + np.minimum(edges + count, stop) - 1) / 2
            means = [_averaged(signal[at:stop], count) for signal in signals]
            yield axis.time_of(centre), means


def _averaged(values: FloatArray, count: int) -> FloatArray:
    """Means of each `count` values; the last may have fewer."""
    if count == 1:
        return values
    edges = np.arange(0, values.size, count)
    sizes = np.diff(np.append(edges, values.size))
    means: FloatArray = np.add.reduceat(values, edges) / sizes
    return means


class Codes:
    """Array-like view of a dataset's valid part."""

    def __init__(self, samples: h5py.Dataset, length: int) -> None:
        self._samples = samples
        self._length = length
        self.dtype = samples.dtype

    def __len__(self) -> int:
        return self._length

    def __getitem__(self, key: slice | int) -> Any:
        if isinstance(key, slice):
            start, stop, step = key.indices(self._length)
            return self._samples[start : max(start, stop) : step]
        if not -self._length <= key < self._length:
            raise IndexError(f"sample {key} of {self._length}")
        return self._samples[key % self._length]
