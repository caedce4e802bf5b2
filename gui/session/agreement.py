"""How well the model follows the run on screen."""

from __future__ import annotations

from dataclasses import dataclass

from gui.lanes.lane import BAND


@dataclass(frozen=True)
class Agreement:
    """Measured V_C1 less the model's, as its root mean square.

    Attributes:
        error: over the range that was measured (NRMSE).
        rms: V.
    """

    error: float
    rms: float

    @property
    def text(self) -> str:
        """The NRMSE as a percentage."""
        return f"{100 * self.error:.1f} %"

    @property
    def in_step(self) -> bool:
        """Whether the residual stays within its band, by and large."""
        return self.rms <= BAND
