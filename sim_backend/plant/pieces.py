"""A piecewise-linear function of time as the plant hands it from part to part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tactile_lab.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Pieces:
    """Linear pieces, each valid from its start to the start of the next one.

    Unlike knots, a piece knows its slope without its successor. So a future that was
    computed in advance can be cut off anywhere without changing what lies before the
    cut: what the scope has been shown stays what it was.

    Attributes:
        start: shape (n,), s, strictly increasing; the last piece never ends.
        value: shape (n,), value at the start of each piece.
        slope: shape (n,), per s.
    """

    start: FloatArray
    value: FloatArray
    slope: FloatArray

    @classmethod
    def constant(cls, value: float, start: float = 0.0) -> Pieces:
        """One piece of one value."""
        return cls(np.array([start]), np.array([value]), np.zeros(1))

    @classmethod
    def through(cls, time: FloatArray, value: FloatArray) -> Pieces:
        """Pieces through knots; the same time twice is a jump, the last value holds."""
        run = time[1:] - time[:-1]
        if np.all(run > 0):
            slope = np.append((value[1:] - value[:-1]) / run, 0.0)
            return cls(time, value, slope)
        real = run > 0
        slope = np.append((value[1:] - value[:-1])[real] / run[real], 0.0)
        real = np.append(real, True)
        return cls(time[real], value[real], slope)

    def at(self, time: float) -> float:
        """Value at `time` s; the first start's value before it."""
        time = max(time, float(self.start[0]))
        i = int(np.searchsorted(self.start, time, side="right")) - 1
        return float(self.value[i] + (time - self.start[i]) * self.slope[i])

    def between(self, start: float, end: float) -> Pieces:
        """The pieces that [start, end) s needs; the first may begin earlier."""
        low = max(int(self.start.searchsorted(start, side="right")) - 1, 0)
        high = max(int(self.start.searchsorted(end, side="left")), low + 1)
        return Pieces(self.start[low:high], self.value[low:high], self.slope[low:high])


def join(parts: Sequence[Pieces]) -> Pieces:
    """One function of parts that follow each other and are cut already."""
    if len(parts) == 1:
        return parts[0]
    return Pieces(
        np.concatenate([part.start for part in parts]),
        np.concatenate([part.value for part in parts]),
        np.concatenate([part.slope for part in parts]),
    )
