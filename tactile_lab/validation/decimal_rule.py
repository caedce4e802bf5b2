"""Collocation with 32 Radau nodes in 40-digit decimals, for the reference."""

from __future__ import annotations

from decimal import Decimal
from functools import lru_cache

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model.tableau import differentiation, radau_nodes

NODES = 32
ONE, ZERO = Decimal(1), Decimal(0)
Numbers = list[Decimal]


class Rule:
    """Nodes, derivatives and interpolation weights, refined to all digits."""

    def __init__(self) -> None:
        rough = radau_nodes(NODES)
        self.u = [ZERO, *(_refined(Decimal(float(c))) for c in rough[:-1]), ONE]
        n = len(self.u)
        self.weight = []
        for i in range(n):
            product = ONE
            for j in range(n):
                if j != i:
                    product *= self.u[i] - self.u[j]
            self.weight.append(ONE / product)
        self.D = [
            [
                ZERO if i == j
                else self.weight[j] / self.weight[i] / (self.u[i] - self.u[j])
                for j in range(n)
            ]
            for i in range(n)
        ]  # fmt: skip
        for i in range(n):
            self.D[i][i] = -sum(self.D[i], ZERO)
        self.D_float = differentiation(np.array([float(u) for u in self.u]))[1:, 1:]
        grid = np.linspace(0.0, 1.0, 161)
        w = np.array([float(x) for x in self.weight])
        rows = w / (grid[1:-1, None] - np.array([float(u) for u in self.u])[None, :])
        self.grid, self.to_grid = grid, np.zeros((grid.size, w.size))
        self.to_grid[1:-1] = rows / rows.sum(axis=1, keepdims=True)
        self.to_grid[0, 0] = self.to_grid[-1, -1] = 1.0

    def at(self, values: Numbers, u: Decimal) -> Decimal:
        """The polynomial through `values` at u (barycentric)."""
        above = below = ZERO
        for x, w, value in zip(self.u, self.weight, values, strict=True):
            if x == u:
                return value
            part = w / (u - x)
            above += part * value
            below += part
        return above / below

    def slope(self, values: Numbers) -> Numbers:
        """Derivative of the polynomial through `values`, at the same points."""
        return [
            sum((d * v for d, v in zip(row, values, strict=True)), ZERO)
            for row in self.D
        ]

    def root(self, values: Numbers, low: Decimal, high: Decimal) -> Decimal:
        """Where the polynomial is zero between two points where its signs differ."""
        f_low, f_high = self.at(values, low), self.at(values, high)
        u = high
        for _ in range(60):
            if f_low == f_high:
                break
            u = low - f_low * (high - low) / (f_high - f_low)
            f = self.at(values, u)
            if abs(f) < Decimal("1e-28") or high - low < Decimal("1e-30"):
                break
            if (f < 0) == (f_low < 0):
                low, f_low, f_high = u, f, f_high / 2
            else:
                high, f_high, f_low = u, f, f_low / 2
        return u

    def tail(self, values: Numbers) -> Decimal:
        """Size of the last Chebyshev coefficient."""
        total = sum((w * v for w, v in zip(self.weight, values, strict=True)), ZERO)
        return abs(total) / Decimal(2) ** (2 * NODES - 1)


def _refined(c: Decimal) -> Decimal:
    """A root of P_(n-1) - P_n at x = 2c - 1 by Newton's method."""
    x = 2 * c - 1
    for _ in range(5):
        p, q, dp, dq = ONE, x, ZERO, ONE
        for k in range(1, NODES):
            p, q, dp, dq = (
                q,
                ((2 * k + 1) * x * q - k * p) / (k + 1),
                dq,
                ((2 * k + 1) * (q + x * dq) - k * dp) / (k + 1),
            )
        x -= (p - q) / (dp - dq)
    return (x + 1) / 2


def solved(matrix: FloatArray, right: Numbers) -> Numbers | None:
    """A correction good to some ten digits of itself; iterating gives all."""
    largest = max(abs(x) for x in right)
    if largest == 0:
        return [ZERO] * len(right)
    if not largest.is_finite():
        return None
    x = np.linalg.solve(matrix, np.array([float(r / largest) for r in right]))
    if not np.all(np.isfinite(x)):
        return None
    return [Decimal(float(v)) * largest for v in x]


@lru_cache(maxsize=1)
def rule() -> Rule:
    """The rule, made once; the caller sets the digits."""
    return Rule()
