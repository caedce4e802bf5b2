"""The model advancing beside a run while it lasts, driven by the applied current."""

from __future__ import annotations

from queue import Empty, SimpleQueue

import numpy as np

from tactile_lab.magnetics import Magnet
from tactile_lab.model.advance import advance, rest
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.solution import Solution
from tactile_lab.model.state import State
from tactile_lab.scene.scene import Scene
from tactile_lab.waveform import Waveform

KEEP = ("V_C1", "V_C2", "spikes")
TOLERANCE = 1e-6
"""Error of spike times aimed at, s: far below what clocks and coil leave open."""


class LiveModel:
    """A circuit under the force that set-points give; each holds until the next.

    `add` may be called from another thread than `until`.

    Args:
        circuit: the sensor as it is believed to be.
        magnet: force per current.
        start: voltages at run time 0 s; the equilibrium if None.
    """

    def __init__(
        self, circuit: Circuit, magnet: Magnet, start: State | None = None
    ) -> None:
        self._circuit = circuit
        self._magnet = magnet
        self._points: SimpleQueue[tuple[float, float]] = SimpleQueue()
        self._later: tuple[float, float] | None = None
        self._state = start or rest(circuit)
        self._amperes, self._field = 0.0, (0.0, 0.0)
        self._told: float | None = None

    @classmethod
    def of(cls, scene: Scene) -> LiveModel:
        """That of a scene's sensor on its bench."""
        start = scene.start
        state = None
        if start is not None:
            state = State(
                time=0.0, force=0.0, V_P=start.V_P, V_C1=start.V_C1, V_C2=start.V_C2
            )
        return cls(scene.circuit, scene.bench.magnet, state)

    @property
    def reached(self) -> float:
        """Run time the model has reached, s."""
        return self._state.time

    def add(self, at: float, amperes: float) -> None:
        """The current `amperes` A was applied at run time `at` s, and flows on."""
        if amperes != self._told:  # a hold of a day is read back 300,000 times
            self._points.put((at, amperes))
            self._told = amperes

    def until(self, end: float) -> Solution:
        """Advance to `end` s, at least `reached`.

        Raises:
            ParameterError: `end` lies before what was reached.
            SolverError: the model cannot follow this force.
        """
        times, amperes = [self.reached], [self._amperes]
        while (point := self._next(end)) is not None:
            at, value = max(point[0], times[-1]), point[1]
            if at > times[-1]:
                times.append(at)
                amperes.append(amperes[-1])
            elif len(times) > 1 and times[-2] == at:
                amperes[-1] = value
                continue
            times.append(at)
            amperes.append(value)
        self._amperes = amperes[-1]
        if end > times[-1]:
            times.append(end)
            amperes.append(amperes[-1])
        current = Waveform(np.array(times), np.array(amperes))
        force, self._field = self._magnet.lagged_force(current, self._field)
        solved = advance(
            self._circuit, self._state, force, end, keep=KEEP, tolerance=TOLERANCE
        )
        self._state = solved.after
        return solved

    def _next(self, end: float) -> tuple[float, float] | None:
        """The next set-point applied by `end` s; a later one waits for its turn."""
        try:
            point = self._later or self._points.get_nowait()
        except Empty:
            return None
        self._later = point if point[0] > end else None
        return point if self._later is None else None
