"""The twin: what the model made of the force that was applied, beside the run."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.engine.events import ModelPart
from tactile_lab.pyramid import Pyramid
from tactile_lab.trace import Trace

MARGIN = 0.5
"""Part of a view's width that is looked at closely on either side of it."""

CLOSE = 4096
"""Cells of a closer look."""

Look = Callable[[float, float, int], None]
"""Has the model computed between two times, s, in so many cells."""


class TwinTraces:
    """Slices put together.

    Args:
        look: asks for a closer look; `refine` brings it. None where there is none.

    Attributes:
        end: time up to which the twin has come, s.
    """

    def __init__(self, look: Look | None = None) -> None:
        self.end = 0.0
        self._look = look
        self._waiting = False
        self._pyramids: dict[str, Pyramid] = {}
        self._spikes: list[FloatArray] = []

    def add(self, part: ModelPart) -> None:
        """Append the next slice."""
        for signal, bins in part.bins.items():
            self._pyramids.setdefault(signal, Pyramid()).add(bins)
        if part.spikes.size:
            self._spikes.append(part.spikes)
        self.end = part.end

    def refine(self, part: ModelPart) -> None:
        """A closer look has come; if another is wanted, it is asked for when drawn."""
        for signal, bins in part.bins.items():
            self._pyramids[signal].refine(float(bins.time[0]), part.end, bins)
        self._waiting = False

    @property
    def spikes(self) -> FloatArray:
        """The twin's spikes so far, s."""
        if len(self._spikes) > 1:
            self._spikes = [np.concatenate(self._spikes)]
        return self._spikes[0] if self._spikes else np.empty(0)

    def knows(self, signal: str) -> bool:
        """Whether the twin computes a signal."""
        return signal in self._pyramids

    def trace(self, signal: str, start: float, end: float, count: int) -> Trace:
        """The twin's signal in about `count` cells, as far as it has come."""
        pyramid = self._pyramids.get(signal)
        if pyramid is None or start >= self.end:
            return Trace.nothing()
        # a closer look has no more than `CLOSE` cells, with the margins
        most = min(count, round(CLOSE / (2 * (1 + 2 * MARGIN))))
        if self._look and not self._waiting and pyramid.wants(start, end, most):
            self._waiting = True
            margin = MARGIN * (end - start)
            self._look(max(start - margin, 0.0), min(end + margin, self.end), CLOSE)
        return pyramid.between(start, min(end, self.end), count)
