"""One stored signal: codes on disk, SI values when asked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tactile_lab.signals import SIGNALS
from tactile_lab.store.columns import pyramid_of
from tactile_lab.store.layout import BIN
from tactile_lab.trace import Trace

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Axis:
    """Where stored samples lie in time: stretches without a gap.

    Attributes:
        first: shape (k,), index of each stretch's first stored sample, ascending.
        time: shape (k,), of that sample, s on the run's axis.
        step: shape (k,), time from sample to sample, drift included, s.
    """

    first: NDArray[np.int64]
    time: FloatArray
    step: FloatArray

    def time_of(self, sample: NDArray[Any] | float) -> FloatArray:
        """Run time of (fractional) stored sample indices, any shape, s."""
        index = np.asarray(sample, dtype=np.float64)
        which = np.searchsorted(self.first, index, side="right") - 1
        which = np.maximum(which, 0)
        at: FloatArray = (
            self.time[which] + (index - self.first[which]) * self.step[which]
        )
        return at

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
        axis: Axis,
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
        size = BIN
        if per < size:
            codes = self.codes[start:stop]
            return self._cells(start, per, 1, stop, (codes, codes, codes))
        per = -(-per // size)
        first, last = start // size, -(-stop // size)
        bins = self._bins_between(first, last)
        columns = (bins["low"], bins["high"], bins["sum"])
        return self._cells(first, per, size, self._length, columns)

    def _cells(
        self, first: int, per: int, size: int, end: int, columns: tuple[Any, Any, Any]
    ) -> Trace:
        """Join `per` entries of `size` samples each, the first of them number `first`.

        After a gap as long as a cell a new one begins.

        Args:
            first: number of the first entry.
            per: entries in a cell.
            size: samples in an entry.
            end: samples up to which entries are full.
            columns: smallest, largest and sum of each entry.
        """
        low, high, total = columns
        width = per * size * self.interval
        late = self.axis.after_gaps(width - self.interval / 2)
        late = -(-late // size) - first
        late = late[(late > 0) & (late < low.size)]
        edges = np.arange(0, low.size, per)
        if late.size:
            edges = np.union1d(edges, late)
        starts = (first + edges) * size
        stops = np.minimum((first + np.append(edges[1:], low.size)) * size, end)
        mean = np.add.reduceat(total, edges, dtype=np.int64) / (stops - starts)
        one = np.minimum.reduceat(low, edges).astype(np.float64)
        other = np.maximum.reduceat(high, edges).astype(np.float64)
        one, other, mean = (v * self.gain + self.offset for v in (one, other, mean))
        # a negative gain turns smallest into largest
        least, most = np.minimum(one, other), np.maximum(one, other)
        gap = np.isin(edges, late)
        gap[0] = True
        time = self.axis.time_of(starts)
        return Trace(time, least, most, mean, gap, width, self.name, self.unit)

    def _bins_between(self, first: int, last: int) -> NDArray[Any]:
        """Entries of the pyramid. A small part is read, the whole is read and kept."""
        count = -(-self._length // BIN)
        if self._bins is not None and len(self._bins) >= count:
            return self._bins[first:last]
        if last - first < count // 4:
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
