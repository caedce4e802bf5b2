"""What is believed of the sensor and bench of a run, and how well it is known."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tactile_lab.bench import Followers
from tactile_lab.deviation import Deviation, DrivenCircuit
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
        deviation: of all that, to be tried.
    """

    circuit: Circuit
    magnet: Magnet
    setpoint: Waveform
    followers: Followers | None = None
    temperature: float | None = None
    clock: float = 0.0
    deviation: Deviation = NOWHERE

    @cached_property
    def driven(self) -> DrivenCircuit:
        """The sensor and its force, N on the run's time axis."""
        return self.deviating(NOWHERE)

    @property
    def force(self) -> Waveform:
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

    def displaced(self, part: float = PART) -> Iterator[tuple[str, DrivenCircuit]]:
        """By each independent cause of uncertainty: moved by `part` of its band."""
        if self.clock > 0:
            later = self.force.shifted(part * self.clock)
            yield "clocks", DrivenCircuit(self.driven.circuit, later)
        followers = self.followers
        if followers is not None and followers.input_bias_uncertainty > 0:
            bias = part * followers.input_bias_uncertainty
            yield "follower", self.deviating(Deviation(input_bias=bias))
        if self.magnet.lag_uncertainty:
            lag = part * self.magnet.lag_uncertainty
            yield "lag", self.deviating(Deviation(lag=lag))
        known = self.magnet.force_uncertainty
        if known is not None and known.absolute > 0:
            # at rest there is no force, by definition
            rest = np.abs(self.force.value) < STEADY
            pushed = np.where(rest, 0.0, part * known.absolute)
            moved = Waveform(self.force.time, self.force.value + pushed)
            yield "force", DrivenCircuit(self.driven.circuit, moved)
        if known is not None and known.relative > 0:
            yield "force", self.deviating(Deviation(force=part * known.relative))
        if self.temperature:
            yield (
                "temperature",
                self.deviating(Deviation(temperature=part * self.temperature)),
            )
