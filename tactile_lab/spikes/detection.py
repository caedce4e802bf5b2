"""Settings of spike detection, as chosen before a run and stored with it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

DEVIATIONS = 7.0
"""Height of an estimated threshold over the rest, in standard deviations of the noise.

Gaussian noise crosses it once in 1e12 samples.
"""


@dataclass(frozen=True, kw_only=True)
class Detection:
    """How spikes were detected on one channel, as stored with a run.

    Attributes:
        signal: name of the channel.
        threshold: code; for kind "reset" the fall in codes.
        hysteresis: codes; not used for kind "reset".
        refractory: samples.
        polarity: +1 or -1.
        kind: "crossing" of a threshold, or "reset" of V_C2.
        span: samples a reset may take.
    """

    signal: str
    threshold: int
    hysteresis: int
    refractory: int = 0
    polarity: Literal[1, -1] = 1
    kind: Literal["crossing", "reset"] = "crossing"
    span: int = 2

    def amplitude_scale(self, gain: float, offset: float) -> tuple[float, float]:
        """Gain and offset, V, that make volts of a spike's amplitude in codes.

        Args:
            gain: of the channel, V a code.
            offset: of the channel, V.
        """
        if self.kind == "reset":  # half the fall is kept, see `ResetDetector`
            return 2 * gain, 0.0
        return gain, offset
