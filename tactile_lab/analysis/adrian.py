"""Adrian and Zotterman's adaptation, as far as the paper gives it: coefficients.

The paper prints the fits alpha exp(beta t) + gamma of Fig. 5d (left), no data points.
Curves drawn from them must be marked so.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.arrays import FloatArray

MARK = "curves from printed coefficients, no data"


@dataclass(frozen=True)
class Coefficients:
    """One printed fit.

    Attributes:
        stimulus: mass that pulled on the muscle.
        alpha: Hz.
        beta: 1/s.
        gamma: Hz.
    """

    stimulus: str
    alpha: float
    beta: float
    gamma: float

    def rate(self, time: ArrayLike) -> FloatArray:
        """The curve at `time` s after the onset, Hz."""
        t = np.asarray(time, dtype=np.float64)
        values: FloatArray = self.alpha * np.exp(self.beta * t) + self.gamma
        return values


ADRIAN = (
    Coefficients("500 g", 341.6, -0.763, 201.679),
    Coefficients("250 g", 216.413, -0.978, 112.859),
)
