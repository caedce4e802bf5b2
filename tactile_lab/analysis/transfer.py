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
"""A point tells the line from this many times the leakage floor up."""
LEAST = 1e-12
"""Scatter of ln I_DS below which it is but rounding."""
ROUNDS = 30
"""So often, at most, points are weighed by what the fit before left of them."""
PAIRS = 100
"""Ratios of an ammeter's noise to what grows with the current that are tried."""
LARGEST = 300.0
"""Of the logarithm of a current that is tried."""


@dataclass(frozen=True, kw_only=True)
class Transfer:
    """A fitted subthreshold line, Eq. (1) with V_DS far above V_T.

    Where no range was asked for, what leaks beside it, or the ammeter is off by, was
    fitted with it, to all points below threshold: five times above its floor, leakage
    is still a fifth of the current.

    Attributes:
        I_S: A; its interval is symmetric on the logarithm.
        m: slope factor.
        swing: V per decade, m V_T ln 10.
        leakage: constant current beside the line, A, either sign; None: none fitted.
        V_T: thermal voltage used, V.
        points: number of points in the range.
        range: (lowest, highest) V_GS of the points that tell the line, V: where it is
            five times what leaks and what the ammeter scatters by.
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
    """Fit I_DS = I_S exp(V_GS/(m V_T)) + leakage below threshold.

    Args:
        V_GS: gate-source voltage, V.
        I_DS: drain current, A.
        V_T: thermal voltage, V.
        between: V_GS to fit, V, its ends in either order, and by a line without
            leakage; by default up to 2.75 V.

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
    if between is not None:
        between = min(between), max(between)
    low, high = between or (-math.inf, SUBTHRESHOLD_END)
    inside, positive = (volts >= low) & (volts <= high), amperes > 0
    use = inside & positive
    if between is None and positive.any():
        floor = amperes[positive].min()
        bent = amperes < ABOVE_FLOOR * floor
        # a curve without a leakage floor starts on its line: keep its first points
        use &= ~(bent & _flat(volts, amperes, floor))
    x, y = volts[use], np.log(amperes[use])
    if x.size < FEWEST:
        raise NotIdentifiableError(_too_few(int(x.size), volts, between))
    line = Line.through(x, y) if np.ptp(x) > 0 else None
    leakage = None
    if line is not None and line.slope.value > 0:
        x = volts[inside]
        found = _weighed(x, amperes[inside], line, leaks=between is None)
        line = found.line
        if between is None:
            leakage = found.leakage
            over = ABOVE_FLOOR * max(abs(leakage), found.noise) or math.ulp(0)
            x = x[line.offset.value + line.slope.value * x >= math.log(over)]
        if x.size < FEWEST:
            raise NotIdentifiableError(_too_few(int(x.size), volts, between))
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


@dataclass(frozen=True, eq=False)
class _Weighed:
    """A line and a constant current, of which a curve consists.

    Attributes:
        line: ln I_DS of the line alone; its scatter is what grows with the current.
        leakage: the constant current, A, either sign; 0 where none was sought.
        noise: standard deviation of what scatters alike at all currents, A.
    """

    line: Line
    leakage: float
    noise: float


def _weighed(
    x: FloatArray, amperes: FloatArray, line: Line, *, leaks: bool
) -> _Weighed:
    """Of what the current at x (V) consists: a line, and a constant one if it `leaks`.

    A part of the current scatters, and so does the ammeter, whatever the current: what
    each point tells is weighed by both, which its own points tell. So points are taken
    whatever their sign: to leave out those that noise took below 0 A is to take too
    much current for the others.
    """
    from scipy.optimize import least_squares

    middle = float(x.mean())
    apart = x - middle

    def of(p: FloatArray) -> FloatArray:
        return np.asarray(np.exp(np.minimum(p[0] + p[1] * apart, LARGEST)))

    p = np.array([line.offset.value + line.slope.value * middle, line.slope.value])
    lowest = np.argsort(x)[: max(FEWEST // 2, x.size // 4)]
    over = (amperes - of(p))[lowest]
    leakage = float(np.median(over)) if leaks else 0.0
    scatter, noise = max(line.scatter, LEAST), float(np.abs(over).max())
    if not noise > LEAST * float(np.abs(amperes).max()) and line.scatter < LEAST:
        return _Weighed(line, 0.0, 0.0)

    def left(p: FloatArray, unit: float, spread: FloatArray) -> FloatArray:
        return np.asarray((of(p) + p[2:].sum() * unit - amperes) / spread)

    p = np.append(p, [0.0] * leaks)
    for _ in range(ROUNDS):
        unit = noise or float(np.abs(amperes).min())
        spread = np.hypot(scatter * (of(p) + abs(leakage)), noise)
        p[2:] = leakage / unit
        found = least_squares(left, p, x_scale="jac", method="lm", args=(unit, spread))
        moved = np.abs(found.x - p)
        p = np.asarray(found.x, dtype=np.float64)
        leakage = float(p[2:].sum()) * unit
        alone = of(p)
        before = scatter, noise
        scatter, noise = _scatters(alone + leakage - amperes, alone + abs(leakage))
        if np.allclose((scatter, noise), before, rtol=1e-4) and moved.max() < 1e-6:
            break
    freedom = x.size - p.size - (1 if noise else 0)
    slopes = np.asarray(found.jac, dtype=np.float64)
    size = x.size / freedom  # what the fit took of the scatter
    covariance = np.linalg.pinv(slopes.T @ slopes) * size
    at_zero = np.array([1.0, -middle, 0.0])[: p.size]
    errors = np.sqrt([covariance[1, 1], at_zero @ covariance @ at_zero])
    steep, offset = (
        Estimate.of(float(value), float(error), freedom)
        for value, error in zip((p[1], p[0] - p[1] * middle), errors, strict=True)
    )
    root = math.sqrt(size)
    return _Weighed(Line(steep, offset, scatter * root), leakage, noise * root)


def _scatters(left: FloatArray, current: FloatArray) -> tuple[float, float]:
    """The part of `current` and the amperes that most likely scatter, making `left`."""
    apart = np.geomspace(0.1 * current.min(), 10 * current.max(), PAIRS)
    apart = np.append(0.0, apart)  # amperes over part
    shape = current**2 + apart[:, np.newaxis] ** 2
    part = np.maximum(np.mean(left**2 / shape, axis=1), LEAST**2)
    unlikely = left.size * np.log(part) + np.log(shape).sum(axis=1)
    best = int(unlikely.argmin())
    found = math.sqrt(part[best])
    return found, found * float(apart[best])


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
