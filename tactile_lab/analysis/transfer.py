"""The transfer curve of a PiezoFET: I_S, m and swing from I_DS(V_GS) (Fig. 1c)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactile_lab.analysis.estimate import Estimate, Line
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import NotIdentifiableError, ParameterError

FEWEST = 6
SUBTHRESHOLD_END = 2.75
ABOVE_FLOOR = 5.0
"""A point counts from this many times the leakage floor up."""
LEAST = 1e-12
"""Scatter of ln I_DS below which it is but rounding."""


@dataclass(frozen=True, kw_only=True)
class Transfer:
    """A fitted subthreshold line, Eq. (1) with V_DS far above V_T.

    Where no range was asked for, what leaks beside it, or the ammeter is off by, was
    fitted with it: five times above its floor, leakage is still a fifth of the current.

    Attributes:
        I_S: A; its interval is symmetric on the logarithm.
        m: slope factor.
        swing: V per decade, m V_T ln 10.
        leakage: constant current beside the line, A, either sign; None: none fitted.
        V_T: thermal voltage used, V.
        points: number of points in the fit.
        range: (lowest, highest) V_GS in the fit, V.
        scatter: standard deviation of ln I_DS about the line.
    """

    I_S: Estimate
    m: Estimate
    swing: Estimate
    leakage: float | None
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
    """Fit I_DS = I_S exp(V_GS/(m V_T)) + leakage, on its logarithm, below threshold.

    Args:
        V_GS: gate-source voltage, V.
        I_DS: drain current, A; points at or below 0 A are left out.
        V_T: thermal voltage, V.
        between: V_GS to fit, V, its ends in either order, and by a line without
            leakage; by default up to 2.75 V and from five times the smallest current
            up.

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
        between = min(between), max(between)
        use &= (volts >= between[0]) & (volts <= between[1])
    elif use.any():
        floor = amperes[use].min()
        bent = amperes < ABOVE_FLOOR * floor
        # a curve without a leakage floor starts on its line: keep its first points
        use &= (volts <= SUBTHRESHOLD_END) & ~(bent & _flat(volts, amperes, floor))
    x, y = volts[use], np.log(amperes[use])
    if x.size < FEWEST:
        raise NotIdentifiableError(_too_few(int(x.size), volts, between))
    line = Line.through(x, y) if np.ptp(x) > 0 else None
    leakage: float | None = None
    if line is not None and line.slope.value > 0 and between is None:
        line, leakage = _beside_leakage(x, y, line)
    if line is None or line.slope.value <= 0:
        raise NotIdentifiableError(
            f"I_DS does not rise with V_GS in the {x.size} points fitted: check which "
            "column is which, or fit another range (--between)"
        )
    log_I_S, steep = line.offset, line.slope
    I_S = math.exp(log_I_S.value)
    return Transfer(
        I_S=Estimate(
            I_S, I_S * log_I_S.error, math.exp(log_I_S.low), math.exp(log_I_S.high)
        ),
        m=_reciprocal(steep, 1 / V_T),
        swing=_reciprocal(steep, math.log(10)),
        leakage=leakage,
        V_T=V_T,
        points=int(x.size),
        range=(float(x.min()), float(x.max())),
        scatter=line.scatter,
    )


def _beside_leakage(x: FloatArray, y: FloatArray, line: Line) -> tuple[Line, float]:
    """The line of which, and of a constant current, A, y = ln I_DS consists."""
    from scipy.optimize import least_squares

    middle, unit = float(x.mean()), math.exp(float(y.min()))
    apart = x - middle

    def left(p: FloatArray) -> FloatArray:
        alone = np.exp(p[0] + p[1] * apart)
        return np.asarray(np.log(np.maximum(alone + p[2] * unit, 1e-3 * alone)) - y)

    level = line.offset.value + line.slope.value * middle
    begin = np.array([level, line.slope.value, 0.0])
    found = least_squares(left, begin, x_scale="jac", method="lm")
    freedom = x.size - begin.size
    scatter = math.sqrt(2 * found.cost / freedom)
    if scatter < LEAST:
        return line, 0.0
    slopes = np.asarray(found.jac, dtype=np.float64)
    covariance = np.linalg.pinv(slopes.T @ slopes) * scatter**2
    at_zero = np.array([1.0, -middle, 0.0])
    level, slope, part = map(float, found.x)
    errors = np.sqrt([covariance[1, 1], at_zero @ covariance @ at_zero])
    steep, offset = (
        Estimate.of(value, float(error), freedom)
        for value, error in zip((slope, level - slope * middle), errors, strict=True)
    )
    return Line(steep, offset, scatter), part * unit


def _too_few(
    usable: int, volts: FloatArray, between: tuple[float, float] | None
) -> str:
    """How many points can be fitted, of which, and how to have more."""
    where = f"up to {SUBTHRESHOLD_END:g} V and above the leakage"
    remedy = "Measure in finer steps of V_GS there"
    if between is not None:
        where = f"between {between[0]:g} V and {between[1]:g} V"
        low, high = (volts.min(), volts.max()) if volts.size else (0.0, 0.0)
        remedy += f", or widen --between; the curve goes from {low:g} V to {high:g} V"
    return (
        f"{usable} of {volts.size} points can be fitted, {where} and with a current "
        f"over 0 A; {FEWEST} are needed. {remedy}."
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
