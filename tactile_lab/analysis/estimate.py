"""A fitted number with its uncertainty, and the quantile that makes it 95 %."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from tactile_lab.quantity import PREFIXES, prefix_of, printed

if TYPE_CHECKING:
    from tactile_lab.arrays import FloatArray


Z95 = 1.959963984540054
"""Two-sided 95 % quantile of a normal distribution."""


@dataclass(frozen=True)
class Estimate:
    """A fitted number with its standard error and 95 % interval, in its own unit."""

    value: float
    error: float
    low: float
    high: float

    @classmethod
    def of(cls, value: float, error: float, freedom: int) -> Estimate:
        """A symmetric interval for `freedom` degrees of freedom."""
        half = student_95(freedom) * error
        return cls(float(value), float(error), float(value - half), float(value + half))

    @classmethod
    def share(cls, good: int, size: int) -> Estimate:
        """The share of `good` among `size` independent draws, by Wilson's interval."""
        value, z = good / size, Z95 * Z95 / size
        error = math.sqrt(value * (1 - value) / size)
        centre = (value + z / 2) / (1 + z)
        half = Z95 / (1 + z) * math.hypot(error, Z95 / (2 * size))
        return cls(value, error, max(centre - half, 0.0), min(centre + half, 1.0))

    @property
    def half(self) -> float:
        """Half the width of the 95 % interval."""
        return (self.high - self.low) / 2

    def text(self, unit: str, factor: float = 1.0, level: str = ", 95 %") -> str:
        """For a person: "3.10 s (2.90 to 3.30 s, 95 %)"; `factor`: from SI to `unit`.

        All three end at one digit: the third, or the one that tells the ends apart.
        `level` is empty where what stands beside it says how sure an interval is.
        """
        half = self.half * abs(factor)
        first = _power(max(abs(self.value * factor), half))
        last = min(first - 2, _power(half)) if half else first - 2
        value, low, high = (
            printed(_ending(number * factor, last, first))
            for number in (self.value, self.low, self.high)
        )
        behind = f" {unit}".rstrip()
        if self.value == self.low < self.high:
            return f"{low}{behind} (at its bound; below {high}{behind}{level})"
        return f"{value}{behind} ({low} to {high}{behind}{level})"

    def shown(self, unit: str) -> str:
        """The same with the prefix before the SI `unit` that suits it: in pA, not A."""
        prefix = prefix_of(max(abs(self.low), abs(self.high)), unit)
        return self.text(prefix + unit, 1 / PREFIXES[prefix])

    def widened(self, *halves: float) -> Estimate:
        """With further independent causes of error, half-widths of their 95 % bands."""
        more = sum(half**2 for half in halves)
        return Estimate(
            self.value,
            math.sqrt(self.error**2 + more / Z95**2),
            self.value - math.sqrt((self.value - self.low) ** 2 + more),
            self.value + math.sqrt((self.high - self.value) ** 2 + more),
        )

    def spanned(self, *ends: tuple[float, float]) -> Estimate:
        """With further independent causes: what it is at the ends of their 95 % bands.

        Each side of the interval grows by what lies on it, which half of the distance
        does not tell where a number does not follow its causes in proportion.
        """
        below = sum((self.value - min(*pair, self.value)) ** 2 for pair in ends)
        above = sum((max(*pair, self.value) - self.value) ** 2 for pair in ends)
        return Estimate(
            self.value,
            math.sqrt(self.error**2 + (below + above) / 2 / Z95**2),
            self.value - math.sqrt((self.value - self.low) ** 2 + below),
            self.value + math.sqrt((self.high - self.value) ** 2 + above),
        )

    def scaled(self, factor: float) -> Estimate:
        """In another unit: times a `factor` that is exact."""
        low, high = sorted((self.low * factor, self.high * factor))
        return Estimate(self.value * factor, abs(self.error * factor), low, high)

    def to_dict(self) -> dict[str, float]:
        """For JSON; units are in the key it is put under."""
        return {
            "value": self.value,
            "error": self.error,
            "low_95": self.low,
            "high_95": self.high,
        }


WRITTEN_OUT = range(-5, 7)
"""Powers of ten of the first digit of numbers that are shown without an exponent."""


def _power(size: float) -> int:
    """Of ten, of the first digit of `size` as it is printed."""
    return int(f"{size:.2e}".partition("e")[2])


def _ending(number: float, last: int, first: int) -> str:
    """A number down to the digit of 10^last, of a size about 10^first."""
    if first not in WRITTEN_OUT:
        return f"{number:.{first - last}e}"
    return f"{round(number, -last) + 0.0:.{max(-last, 0)}f}"


@dataclass(frozen=True, eq=False)
class Line:
    """The straight line of least squares through points.

    Attributes:
        slope: with what the scatter about the line leaves open.
        offset: y at x = 0, likewise.
        scatter: standard deviation of y about the line.
    """

    slope: Estimate
    offset: Estimate
    scatter: float

    @classmethod
    def through(cls, x: FloatArray, y: FloatArray) -> Line:
        """The line through points of shape (n,), n above 2, of which two x differ."""
        import numpy as np

        middle, mean, freedom = float(x.mean()), float(y.mean()), x.size - 2
        apart = x - middle
        spread = float(np.sum(apart**2))
        slope = float(np.sum(apart * y) / spread)
        left = y - mean - slope * apart
        scatter = math.sqrt(float(np.sum(left**2)) / freedom)
        offset = mean - slope * middle
        # of points on a line, only what rounding leaves: no error, and no offset
        least = 16 * np.finfo(float).eps * float(np.abs(y).max())
        scatter = scatter if scatter > least else 0.0
        offset = offset if abs(offset) > least else 0.0
        error = scatter * math.sqrt(1 / x.size + middle**2 / spread)
        return cls(
            Estimate.of(slope, scatter / math.sqrt(spread), freedom),
            Estimate.of(offset, error, freedom),
            scatter,
        )


def standard_error(values: FloatArray) -> float:
    """Of the mean of independent values, shape (n,), in their unit; 0 below two."""
    return (
        float(values.std(ddof=1)) / math.sqrt(values.size) if values.size > 1 else 0.0
    )


def correlated(
    residual: FloatArray, group: FloatArray | None = None, *, swings: bool = False
) -> float:
    """How many neighbouring points err alike, at least 1.

    That is 1 + 2 times the sum of the residual's correlations, to the first that noise
    alone could make. The variance of a fit by independent points is so much too small.

    Args:
        residual: shape (n,), in order.
        group: shape (n, k), 1 in the column of a point's group: only points of one
            group are neighbours.
        swings: what neighbours have in common swings back further on, such as what a
            converter's steps leave: the farther ones count less, by the weights of
            Newey and West (1987).
    """
    import numpy as np

    power, alike = float(np.sum(residual**2)), list[float]()
    member = np.ones((residual.size, 1)) if group is None else group
    if power == 0:
        return 1.0
    for lag in range(1, residual.size // 4):
        same = np.sum(member[lag:] * member[:-lag], axis=1)
        correlation = float(np.sum(same * residual[lag:] * residual[:-lag])) / power
        if correlation < 2 / math.sqrt(residual.size):
            break
        alike.append(correlation)
    weight = 1 - np.arange(1, len(alike) + 1) / (len(alike) + 1) * swings
    return 1 + 2 * float(weight @ alike)


@cache
def student_95(freedom: int) -> float:
    """Two-sided 95 % quantile of Student's t; at least one degree of freedom.

    By Newton's method on the integral of its density, which comes from below; within
    1e-8 of SciPy's, whose special functions take 0.3 s and 17 MB to import.
    """
    import numpy as np

    n, t = max(freedom, 1), Z95
    at, weight = np.polynomial.legendre.leggauss(40)
    power = math.lgamma((n + 1) / 2) - math.lgamma(n / 2) - math.log(n * math.pi) / 2

    def density(x: FloatArray) -> FloatArray:
        return np.exp(power - (n + 1) / 2 * np.log1p(x * x / n))

    for _ in range(9):  # 8 for one degree of freedom
        inside = t * float(weight @ density(t * (1 + at) / 2))
        t += (0.95 - inside) / (2 * float(density(np.array(t))))
    return t
