"""The sensor at rest, as a monitor shows it here and through the pipe."""

from __future__ import annotations

from dataclasses import dataclass

from tactile_lab.measurement import BETWEEN_SAMPLES, TOO_FAST

KEPT = 60.0
"""How much a monitor holds for `record`, s."""

LONG_PARTS = ('protocol.duration="86400 s"', 'protocol.part="600 s"')
"""What an endless monitor plays, round by round: spikes are forgotten part by part."""

SILENT = 2.0
"""Time without a spike after which the rate counts as 0, s."""

SEEN = {
    "": "",
    BETWEEN_SAMPLES: " of spikes seen, not of all",
    TOO_FAST: ", too fast for the circuit: raise the threshold",
}
"""What a rate is of."""


@dataclass(frozen=True)
class SensorState:
    """The sensor at rest, just now.

    Attributes:
        critical_V_C1: the sensor fires below it, V.
        V_C1, V_C2: mean of the newest samples, V; None before there is any.
        rate: of the last two spikes, Hz; 0 where they are long ago.
        counted: whether all spikes are seen: none falls between two samples.
        held: how much `record` would keep, s.
        shortest_interval: less than any between two spikes of the sensor, s.
    """

    critical_V_C1: float
    V_C1: float | None = None
    V_C2: float | None = None
    rate: float = 0.0
    held: float = 0.0
    counted: bool = True
    shortest_interval: float = 0.0

    @property
    def unrated(self) -> str:
        """Why the rate is not the circuit's, as of a trial; "" where it is."""
        if not self.counted:
            return BETWEEN_SAMPLES
        return TOO_FAST if self.rate * self.shortest_interval > 1 else ""

    @property
    def distance(self) -> float | None:
        """V_C1 less the critical one, V; above 0 the sensor is silent."""
        return None if self.V_C1 is None else self.V_C1 - self.critical_V_C1

    def __str__(self) -> str:
        """For a person who trims V_GS."""
        if self.V_C1 is None or self.distance is None:
            return "no V_C1 yet"
        side = "above threshold: silent" if self.distance > 0 else "below it: fires"
        seen = SEEN[self.unrated]
        second = "" if self.V_C2 is None else f"  V_C2 {self.V_C2:.3f} V"
        return (
            f"V_C1 {self.V_C1:.3f} V, {1e3 * abs(self.distance):.0f} mV {side}{second}"
            f"  {self.rate:.2f} Hz{seen}"
        )
