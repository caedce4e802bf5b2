"""Has V_C1 at rest drifted? Asked before every trial that pushes the sensor.

V_P is a high-pass of force: after a push the film remembers it for some time, and V_C1
is off its rest by as much. That part is computed from the played current and taken out,
so a protocol without recoveries is judged like one with them.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tactile_lab.errors import LimitError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.equations import rest_V_C1
from tactile_lab.model.film import Film
from tactile_lab.quantity import show
from tactile_lab.waveform import Waveform

NOTHING = 1e-6
"""A force below this is none, N."""
STILL = 0.25
"""Time without force after which V_C1 counts as at rest, s: the coil may be late."""


class Drift:
    """Compares V_C1 at rest with the first value seen in a run.

    Args:
        circuit: the sensor, for what the film remembers.
        force_for: force, N(t), of a coil current, A(t).
        limit: largest drift, V, either sign.
    """

    def __init__(
        self, circuit: Circuit, force_for: Callable[[Waveform], Waveform], limit: float
    ) -> None:
        self._circuit = circuit
        self._force_for = force_for
        self._limit = limit
        self._film = Film(circuit)
        self._still = -STILL
        self._first: tuple[float, float] | None = None

    def before(
        self, V_C1: float, time: float, *, cut_off: bool = False
    ) -> float | None:
        """The drift, V, of a rest value measured just before run time `time` s.

        None where the sensor was not at rest: under force, or until a moment ago; and
        where V_C1 was `cut_off` at its channel's range, which is no value to compare
        with but still shows a drift beyond the limit.

        Raises:
            LimitError: it is beyond the limit, and so is the change of V_C1 itself: a
                film that remembers less than believed is no drift.
        """
        if abs(self._film.force) > NOTHING or time < self._still + STILL:
            return None
        alone = V_C1 - rest_V_C1(self._circuit, self._film.V_P(time))
        if self._first is None:
            if cut_off:
                return None
            self._first = alone, V_C1
        drift, plain = alone - self._first[0], V_C1 - self._first[1]
        if min(abs(drift), abs(plain)) > self._limit:
            raise LimitError(
                f"V_C1 at rest has drifted by {show(drift, 'V')} since the first "
                f"trial; {show(self._limit, 'V')} is the limit. Check V_GS, the supply "
                "and the temperature, or raise protocol.drift_limit."
            )
        return None if cut_off else drift

    def plays(self, current: Waveform, begin: float) -> None:
        """The coil plays `current`, A against s from run time `begin` s."""
        force = self._force_for(current)
        # a list rounds: far behind its last push some 1e-12 N are left of it
        felt = np.abs(np.append(self._film.force, force.value)) > NOTHING
        if felt.any():
            after = min(int(np.flatnonzero(felt)[-1]), force.time.size - 1)
            self._still = begin + float(force.time[after])
        self._film.feels(force, begin)
