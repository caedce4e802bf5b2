"""The transfer curve of a PiezoFET: I_S, m and swing from I_DS(V_GS) (Fig. 1c)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactile_lab.analysis.estimate import Estimate
from tactile_lab.errors import NotIdentifiableError, ParameterError

FloatArray = NDArray[np.float64]

FEWEST = 6
SUBTHRESHOLD_END = 2.75
ABOVE_FLOOR = 5.0
"""A point counts from this many times the leakage floor up."""


@dataclass(frozen=True, kw_only=True)
class Transfer:
    """A fitted subthreshold line, Eq. (1) with V_DS far above V_T.

    Attributes:
        I_S: A; its interval is symmetric on the logarithm.
        m: slope factor.
        swing: V per decade, m V_T ln 10.
        V_T: thermal voltage used, V.
        points: number of points in the fit.
        range: (lowest, highest) V_GS in the fit, V.
        scatter: standard deviation of ln I_DS about the line.
    """

    I_S: Estimate
    m: Estimate
    swing: Estimate
    V_T: float
    points: int
    range: tuple[float, float]
    scatter: float

    def current(self, V_GS: ArrayLike) -> FloatArray:
        """The fitted line at `V_GS` (any shape, V), A."""
        volts = np.asarray(V_GS, dtype=np.float64)
        values: FloatArray = self.I_S.value * np.exp(volts / (self.m.value * self.V_T))
        return values


def fit_transfer(
    V_GS: ArrayLike,
    I_DS: ArrayLike,
    *,
    V_T: float = 0.025,
    between: tuple[float, float] | None = None,
) -> Transfer:
    """Fit ln I_DS = ln I_S + V_GS/(m V_T) in the subthreshold regime.

    Args:
        V_GS: gate-source voltage, V.
        I_DS: drain current, A; points at or below 0 A are left out.
        V_T: thermal voltage, V.
        between: V_GS to fit, V; by default up to 2.75 V and from five times the
            smallest current up, where leakage no longer bends the line.

    Raises:
        ParameterError: unequal shapes or values that are not finite.
        NotIdentifiableError: fewer than 6 usable points, or a current that does not
            rise.
    """
    volts = np.asarray(V_GS, dtype=np.float64)
    amperes = np.asarray(I_DS, dtype=np.float64)
    if volts.shape != amperes.shape or volts.ndim != 1:
        raise ParameterError(
            f"A transfer curve needs as many currents as voltages; got shapes "
            f"{volts.shape} and {amperes.shape}."
        )
    if not (np.all(np.isfinite(volts)) and np.all(np.isfinite(amperes))):
        raise ParameterError("A transfer curve must hold finite numbers only.")
    use = amperes > 0
    if between is not None:
        use &= (volts >= between[0]) & (volts <= between[1])
    elif use.any():
        floor = amperes[use].min()
        bent = amperes < ABOVE_FLOOR * floor
        # a curve without a leakage floor starts on its line: keep its first points
        use &= (volts <= SUBTHRESHOLD_END) & ~(bent & _flat(volts, amperes, floor))
    x, y = volts[use], np.log(amperes[use])
    if x.size < FEWEST:
        raise NotIdentifiableError(
            f"{x.size} points lie in the subthreshold regime, {FEWEST} are needed"
        )
    centre = x.mean()
    spread = np.sum((x - centre) ** 2)
    slope = float(np.sum((x - centre) * y) / spread) if spread > 0 else 0.0
    if slope <= 0:
        raise NotIdentifiableError("I_DS does not rise with V_GS")
    at_centre = float(y.mean())
    residual = y - at_centre - slope * (x - centre)
    freedom = x.size - 2
    scatter = float(np.sqrt(np.sum(residual**2) / freedom))
    slope_error = scatter / math.sqrt(spread)
    intercept_error = scatter * math.sqrt(1 / x.size + centre**2 / spread)
    log_I_S = Estimate.of(at_centre - slope * centre, intercept_error, freedom)
    steep = Estimate.of(slope, slope_error, freedom)
    I_S = math.exp(log_I_S.value)
    return Transfer(
        I_S=Estimate(
            I_S, I_S * intercept_error, math.exp(log_I_S.low), math.exp(log_I_S.high)
        ),
        m=_reciprocal(steep, 1 / V_T),
        swing=_reciprocal(steep, math.log(10)),
        V_T=V_T,
        points=int(x.size),
        range=(float(x.min()), float(x.max())),
        scatter=scatter,
    )


def _flat(volts: FloatArray, amperes: FloatArray, floor: float) -> NDArray[np.bool_]:
    """Whether several points lie on the floor: within a factor 1.5 of the smallest."""
    near = (amperes > 0) & (amperes < 1.5 * floor)
    return np.full(volts.shape, np.count_nonzero(near) >= 3)


def _reciprocal(slope: Estimate, scale: float) -> Estimate:
    """`scale` / slope."""
    high = scale / slope.low if slope.low > 0 else math.inf
    error = scale * slope.error / slope.value**2
    return Estimate(scale / slope.value, error, scale / slope.high, high)
