"""A solution too long to be held: a slice at a time, what is read of it taken at once.

It is cut where the force bends. There the solver begins a step anyway, so that the
slices are what one long solution would be.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.long_waveform import AnyWaveform
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import asked, solver, state_at_start
from tactile_lab.model.state import Start
from tactile_lab.waveform import Waveform

if TYPE_CHECKING:
    from tactile_lab.model.solution import Solution

POINTS = 1 << 14
"""Of the force in a slice: each takes some 500 B while it is solved, 1.2 kB at most."""


def slices(
    circuit: Circuit,
    force: AnyWaveform,
    *,
    keep: Sequence[str],
    until: float,
    start: Start | None = None,
    tolerance: float = 1e-9,
) -> Iterator[Solution]:
    """Solve as `simulate` does, from 0 to `until` s, one slice after another.

    Memory does not grow with the force's points as long as no slice is kept.

    Args:
        circuit: parameters.
        force: N over s.
        keep: what is wanted.
        until: end, s, of the last slice.
        start: voltages at time 0; equilibrium if None.
        tolerance: of spike times (s) and V_C1 (V).

    Raises:
        ParameterError: a bad option or waveform.
        SolverError: the model cannot answer to that tolerance.
    """
    pieces = force.pieces(POINTS)
    first = next(pieces)
    need, tolerance = asked(circuit, first, keep, until, tolerance)
    state = state_at_start(circuit, first.first, start)

    def solved(piece: Waveform, end: float) -> Solution:
        begin = solver().start_from(circuit, state)
        found: Solution = solver().solve(begin, piece, end, need, tolerance)
        return found

    for piece in chain((first,), pieces):
        if piece.end > state.time:
            yield (part := solved(piece, min(piece.end, until)))
            state = part.after
        if state.time >= until:
            return
    yield solved(Waveform.constant(float(piece.value[-1])), until)


class Samples:
    """A signal at given times, taken from slices as they come.

    Args:
        signal: kept by the slices.
        time: any shape, s, from 0 to `until`.
        until: end of the last slice, s.

    Attributes:
        value: of `time`'s shape, SI; known once all slices were taken.
    """

    def __init__(self, signal: str, time: FloatArray, until: float) -> None:
        self._signal, self._until = signal, until
        self._order = np.argsort(time, axis=None, kind="stable")
        self._time, self._taken = time.ravel()[self._order], 0
        self.value = np.empty(time.shape)

    def take(self, part: Solution) -> None:
        """What the next slice has; its end is the next one's begin.

        Raises:
            ParameterError: it was not kept, or a time lies outside of all slices.
        """
        stop = self._time.size  # of the last, its own end too, and what nobody has
        if part.end < self._until:
            stop = int(np.searchsorted(self._time, part.end))
        inside = slice(self._taken, stop)
        at = self._order[inside]
        self.value.flat[at] = part.sample(self._signal, self._time[inside])
        self._taken = stop
