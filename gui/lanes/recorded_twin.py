"""The model beside a run on disk: coarse as a whole, exact where it is looked at."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gui.lanes.decimate import Drawn, FloatArray, cut
from gui.lanes.twinned import TwinSlice
from tactile_lab.acquisition.live import Bins

KEPT = 4
"""Parts kept: that of the lanes, those around the cursors, and the last one."""

MARGIN = 0.5
"""Part of the view's width that is asked for on either side of it."""

CLOSE = 4096
"""Bins of a part."""


class RecordedTwin:
    """Answers at once from what it has; finer parts are asked for and come later.

    Args:
        whole: the whole run.
        ask: has the model sampled between two times, s, in so many bins; `add` brings
            the answer.
    """

    def __init__(
        self, whole: TwinSlice, ask: Callable[[float, float, int], None]
    ) -> None:
        self.spikes: FloatArray = whole.spikes
        self._whole, self._end = _rows(whole), whole.end
        self._parts: list[dict[str, tuple[FloatArray, float]]] = []
        self._ask = ask
        self._waiting = False

    def add(self, part: TwinSlice) -> None:
        """A part that was asked for has come; newer wishes are asked for when drawn."""
        self._parts = [_rows(part), *self._parts[: KEPT - 1]]
        self._waiting = False

    def between(self, signal: str, start: float, end: float, count: int) -> Drawn:
        """The model's signal in [start, end] s in about `count` columns."""
        if signal not in self._whole:
            return Drawn.nothing()
        rows, width = self._whole[signal]
        for part in self._parts:
            finer, narrower = part[signal]
            # a part need not reach beyond the run
            first, last = max(start, rows[0, 0]), min(end, rows[0, -1])
            covers = finer[0, 0] <= first and last <= finer[0, -1] + 1.5 * narrower
            if covers and narrower < width:
                rows, width = finer, narrower
        wanted = (end - start) * (1 + 2 * MARGIN) / CLOSE
        seen = start < self._end and end > 0.0  # beyond the run there is no model
        coarse = end - start < count * width and width > 2 * wanted
        if seen and coarse and not self._waiting:
            self._waiting = True
            margin = MARGIN * (end - start)
            self._ask(max(start - margin, 0.0), min(end + margin, self._end), CLOSE)
        return cut(rows, width, start, end, count)


def _rows(part: TwinSlice) -> dict[str, tuple[FloatArray, float]]:
    return {signal: (_row(bins), bins.width) for signal, bins in part.bins.items()}


def _row(bins: Bins) -> FloatArray:
    return np.array([bins.time, bins.low, bins.high, bins.mean], dtype=np.float64)
