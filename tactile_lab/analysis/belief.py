"""What is believed of the sensor and bench of a run, and how well it is known."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from tactile_lab.analysis.estimate import Z95
from tactile_lab.arrays import FloatArray
from tactile_lab.bench import Followers
from tactile_lab.deviation import Deviation, DrivenCircuit
from tactile_lab.long_waveform import AnyWaveform
from tactile_lab.magnetics import Magnet
from tactile_lab.model.circuit import Circuit
from tactile_lab.waveform import Waveform

PART = 0.05
"""Of a cause's 95 % band by which it is moved: so little that each spike is known
again; what it does is taken to grow in proportion."""
NOWHERE = Deviation()
"""Nothing is other than believed."""
STEADY = 1e-9
"""A force below this is none, N."""
APART = 0.25
"""Steps of the source further apart than this belong to no one ramp, s."""
PROMPT = 5e-5
"""A step that is known so well is where it is believed to be, s."""
MOMENTS = 2
"""So many of a ramp's steps are felt in what comes after them."""


@dataclass(frozen=True, eq=False)
class Belief:
    """The sensor on its bench as it is believed to be, under the current that flowed.

    Attributes:
        circuit: the sensor, followers connected.
        magnet: force per current, lags, and how well both are known.
        setpoint: what the source gave, A on the run's time axis.
        followers: and how well they are known; None: there are none.
        temperature: half of the 95 % band of the sensor's, K; None: not stated.
        clock: how far measured times may lie from the current's, s.
        dated: whether the samples show when the current changed, so that its times are
            by the clock that measured times are by.
        steps: shape (n, 2): from that time on, s, the source gives this current, A.
        doubt: shape (n,): how far each of them may lie on either side of where the
            others say, s.
        begins: shape (k,), s: of lists, each of which may lie elsewhere within the
            clocks' band, for the samples showed each by itself when it began.
        deviation: of all that, to be tried.
    """

    circuit: Circuit
    magnet: Magnet
    setpoint: Waveform
    followers: Followers | None = None
    temperature: float | None = None
    clock: float = 0.0
    dated: bool = True
    steps: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    doubt: FloatArray = field(default_factory=lambda: np.empty(0))
    begins: FloatArray = field(default_factory=lambda: np.empty(0))
    deviation: Deviation = NOWHERE

    @cached_property
    def driven(self) -> DrivenCircuit:
        """The sensor and its force, N on the run's time axis."""
        return self.deviating(NOWHERE)

    @property
    def force(self) -> AnyWaveform:
        """Force on the sensor, N on the run's time axis."""
        return self.driven.force

    def deviating(self, deviation: Deviation) -> DrivenCircuit:
        """The sensor and its force if what is believed is off by `deviation` more."""
        off = self.deviation + deviation
        return off.driven(self.circuit, self.magnet, self.setpoint)

    @property
    def offset(self) -> float:
        """Half of the 95 % band of a follower's offset, V."""
        return 0.0 if self.followers is None else self.followers.offset_uncertainty

    @property
    def stated(self) -> dict[str, bool]:
        """For each cause of uncertainty whether the bench states how large it is."""
        return {
            "clocks": True,
            "follower": True,
            "lag": self.magnet.lag_uncertainty is not None,
            "force": self.magnet.force_uncertainty is not None,
            "temperature": self.temperature is not None,
        }

    @cached_property
    def bands(self) -> tuple[tuple[str, str, float], ...]:
        """Each independent cause of uncertainty: its name, what of, half its 95 % band.

        What: a name in `Deviation`, the "clock", s, or a "push" of all forces, N.
        """
        followers, known = self.followers, self.magnet.force_uncertainty
        bias = 0.0 if followers is None else followers.input_bias_uncertainty
        found = (
            ("clocks", "clock", self.clock),
            ("follower", "input_bias", bias),
            ("lag", "lag", self.magnet.lag_uncertainty),
            ("force", "push", 0.0 if known is None else known.absolute),
            ("force", "force", 0.0 if known is None else known.relative),
            ("temperature", "temperature", self.temperature),
        )
        return tuple((cause, what, size) for cause, what, size in found if size)

    def moved(self, parts: FloatArray) -> DrivenCircuit:
        """The sensor and its force with each cause moved by a part of its band.

        Args:
            parts: one for each of `bands`, either sign; 1 is the end of the band.
        """
        by = {
            what: part * size
            for (_, what, size), part in zip(self.bands, parts, strict=True)
            if part
        }
        later, pushed = by.pop("clock", 0.0), by.pop("push", 0.0)
        circuit, force = self.deviating(Deviation(**by))
        if pushed:
            force = force.each(lambda piece: _pushed(piece, pushed))
        if later:
            force = force.shifted(later).since(0.0)
        return DrivenCircuit(circuit, force)

    @cached_property
    def scattered(self) -> FloatArray:
        """What steps moved by themselves leave open, each row independent; (k, n), s.

        Steps that follow each other closely, as in a ramp, are taken together: what
        comes later feels little more of them than current times delay, in sum and in
        its first moments. A row is half of the 95 % band of one of these, as the steps
        most likely make it.
        """
        time, level = self.steps.T
        change, half = np.diff(level, prepend=0.0), Z95 / math.sqrt(3) * self.doubt
        ends = np.flatnonzero(np.diff(time) > APART) + 1
        rows = []
        for ramp in np.split(np.arange(time.size), ends):
            ramp = ramp[half[ramp] > PROMPT]
            since = time[ramp] - time[ramp].mean() if ramp.size else time[ramp]
            felt = np.vander(since, min(MOMENTS, ramp.size), increasing=True)
            for way in np.linalg.qr(felt * (change * half)[ramp, np.newaxis])[0].T:
                row = np.zeros(time.size)
                row[ramp] = half[ramp] * way
                rows.append(row)
        return np.array(rows).reshape(len(rows), time.size)

    def shifted(self, later: FloatArray) -> Belief:
        """With each step later by so much, shape (n,), s, but none before the last."""
        time = np.maximum.accumulate(self.steps[:, 0] + later)
        steps = np.column_stack([time, self.steps[:, 1]])
        setpoint = Waveform.stairs(steps, float(self.setpoint.time[-1]))
        return replace(self, setpoint=setpoint, steps=steps)

    def displaced(self, part: float = PART) -> Iterator[tuple[str, DrivenCircuit]]:
        """By each independent cause of uncertainty: moved by `part` of its band."""
        for (cause, _, _), parts in zip(
            self.bands, part * np.eye(len(self.bands)), strict=True
        ):
            yield cause, self.moved(parts)


def _pushed(force: Waveform, by: float) -> Waveform:
    """With `by` N more, but at rest, where by definition there is no force."""
    rest = np.abs(force.value) < STEADY
    return Waveform(force.time, force.value + np.where(rest, 0.0, by))
