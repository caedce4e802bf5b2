"""Least, largest, mean and rms value of a stored signal over a stretch of time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tactile_lab.errors import RunFolderError
from tactile_lab.store.signal import PIECE, StoredSignal

MOST = 100_000_000
"""Samples that are looked at; they are read in about a second."""


@dataclass(frozen=True)
class SignalStatistics:
    """Of every sample in a stretch of time, in the signal's SI unit.

    Attributes:
        low, high: least and largest value.
        mean: of the values.
        deviation: root mean square of the values less their mean.
        samples: how many there are.
    """

    low: float
    high: float
    mean: float
    deviation: float
    samples: int

    @property
    def rms(self) -> float:
        """Root mean square of the values, about 0."""
        return math.hypot(self.mean, self.deviation)


def statistics(signal: StoredSignal, start: float, end: float) -> SignalStatistics:
    """Over the samples with `start` <= time < `end`, s on the run's axis.

    Sums are of the stored integers and so without rounding.

    Raises:
        RunFolderError: there is no sample in it, or more than `MOST`.
    """
    part = signal.between(start, end)
    count = part.stop - part.start
    if not 0 < count <= MOST:
        raise RunFolderError(
            f"{count} samples of {signal.name} lie in {start:.6g} to {end:.6g} s; "
            f"choose a stretch with 1 to {MOST:.0e} of them."
        )
    low, high, total, squares = math.inf, -math.inf, 0, 0
    for first in range(part.start, part.stop, PIECE):
        codes = signal.codes[first : min(first + PIECE, part.stop)].astype(np.int64)
        low, high = min(low, int(codes.min())), max(high, int(codes.max()))
        total += int(codes.sum())
        squares += int(np.dot(codes, codes))
    gain, offset = signal.gain, signal.offset
    ends = sorted((gain * low + offset, gain * high + offset))
    # of integers: exact, where a difference of two floats would lose what is small
    variance = (count * squares - total * total) / count**2
    return SignalStatistics(
        low=ends[0],
        high=ends[1],
        mean=gain * total / count + offset,
        deviation=abs(gain) * math.sqrt(variance),
        samples=count,
    )
