"""The 40-digit reference where T1 does not saturate, in steps of 32 Radau nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal

import numpy as np

from tactile_lab.errors import SolverError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.equations import rest_V_C1, wright_omega
from tactile_lab.model.state import Start
from tactile_lab.validation.decimal_rule import NODES, ONE, ZERO, Numbers, rule, solved
from tactile_lab.waveform import Waveform

TAIL = Decimal("1e-23")


@dataclass(frozen=True)
class Reference:
    """Exact to about 20 digits.

    Attributes:
        spike_times: s.
        V_C1: at the asked times, V.
        V_C2: at the asked times, V.
    """

    spike_times: tuple[Decimal, ...]
    V_C1: tuple[Decimal, ...]
    V_C2: tuple[Decimal, ...]


class Cascade:
    """One solution in the making: V_C1, then V_C2 driven by it."""

    def __init__(
        self,
        circuit: Circuit,
        force: Waveform,
        until: float,
        start: Start | None,
        times: Sequence[float],
    ) -> None:
        c = circuit
        self.c, self.force, self.until = c, force, Decimal(until)
        d = {name: Decimal(getattr(c, name)) for name in (
            "I_S V_GS m V_T g31 h L d a b tau R1 R2 R3 R_L C1 C2 V_S I_T1s I_bias "
            "beta_F beta_R"
        ).split()}  # fmt: skip
        self.d = d
        self.k_F = 6 * d["g31"] * d["h"] * (d["L"] - d["d"]) / (d["a"] * d["b"] ** 2)
        self.G = ONE / d["R1"] + ONE / d["R2"]
        self.tau_L = d["R_L"] * d["C2"]
        self.V_f, self.V_r = Decimal(c.fire_voltage), Decimal(c.reset_voltage)
        self.t_eps = Decimal(c.reset_time)
        self.rule = rule()
        self.V_P = ZERO
        if start is None:
            self.y, self.V2 = self.rest()
            if self.V2 >= self.V_f:
                self.V2 = self.V_r
        else:
            self.V_P, self.y = Decimal(start.V_P), Decimal(start.V_C1)
            self.V2 = Decimal(start.V_C2)
        self.times = [Decimal(float(t)) for t in times]
        self.found_1: Numbers = []
        self.found_2: Numbers = []
        self.spikes: Numbers = []
        self.held: Decimal | None = None

    def rest(self) -> tuple[Decimal, Decimal]:
        """V_C1 and V_C2 at equilibrium."""
        d, y = self.d, Decimal(rest_V_C1(self.c))
        B = d["I_S"] * (d["V_GS"] / (d["m"] * d["V_T"])).exp()
        for _ in range(6):
            q = (-y / d["V_T"]).exp()
            f = (d["V_S"] - y) / d["R1"] - y / d["R2"] - B * (1 - q)
            y += f / (self.G + B * q / d["V_T"])
        return y, self.Q(y)

    def Q(self, y: Decimal) -> Decimal:
        """R_L (I_C + I_bias), Eq. (17)."""
        d = self.d
        U = d["V_S"] - y
        if self.c.t1 == "direct":
            return d["R_L"] * (d["I_T1s"] * ((U / d["V_T"]).exp() - 1) + d["I_bias"])
        drop = d["I_T1s"] * d["R3"]
        z = (U + drop) / d["V_T"] + (drop / d["V_T"]).ln()
        # each iteration doubles the digits: 16, 32, 64
        w = Decimal(float(wright_omega(float(z)))) if z > -500 else z.exp()
        for _ in range(2):
            w += (z - w - w.ln()) * w / (1 + w)
        return d["R_L"] * (d["V_T"] / d["R3"] * w - d["I_T1s"] + d["I_bias"])

    def solve(self) -> Reference:
        """From time 0 to the end, segment by segment."""
        t = ZERO
        points = [
            (Decimal(float(x)), Decimal(float(F)))
            for x, F in zip(self.force.time, self.force.value, strict=True)
        ]
        F = points[0][1]
        for when, value in points:
            end = min(when, self.until)
            if end > t:
                before = F
                F = before + (value - before) * (end - t) / (when - t)
                self._segment(t, end, self.k_F * (F - before) / (end - t))
                t = end
            elif when <= self.until:
                self.V_P += self.k_F * (value - F)
                F = value
            if when > self.until:
                break
        if t < self.until:
            self._segment(t, self.until, ZERO)
        while len(self.found_1) < len(self.times):
            self.found_1.append(self.y)
            self.found_2.append(self.V_f if self.held is not None else self.V2)
        return Reference(tuple(self.spikes), tuple(self.found_1), tuple(self.found_2))

    def V_P_at(self, V0: Decimal, p: Decimal, s: Decimal) -> Decimal:
        """Closed form of Eq. (7) at s after V0 under a slope p."""
        tau = self.d["tau"]
        x = s / tau
        if x < Decimal("1e-8"):
            decay = x - x * x / 2 + x**3 / 6 - x**4 / 24 + x**5 / 120
        else:
            decay = 1 - (-x).exp()
        return V0 * (1 - decay) + p * tau * decay

    def _segment(self, t0: Decimal, t1: Decimal, p: Decimal) -> None:
        V0, s, T = self.V_P, ZERO, t1 - t0
        size = T
        fails = 0
        while s < T:
            size = min(size, 4 * self.tau_L)
            h = min(size, T - s)
            if self.held is not None and t0 + s + h > self.held:
                h = self.held - t0 - s
            both = self.both(V0, p, s, h) if h > 0 else ([self.y], None)
            if both is None:
                size, fails = h / 3, fails + 1
                if fails > 2000:
                    raise SolverError("The reference does not converge.")
                continue
            ys, leak = both
            done, end = h, False
            if leak is not None:
                u = self._fires(leak)
                if u is not None:
                    done, end = u * h, True
            if h > 0:
                self._record(t0 + s, h, done, ys, leak)
                self.y = self.rule.at(ys, done / h)
                if leak is not None:
                    self.V2 = self.rule.at(leak, done / h)
            s += done
            if self.held is not None and t0 + s >= self.held:
                self.held, self.V2 = None, self.V_r
            if end:
                self.spikes.append(t0 + s)
                self.V2 = self.V_r
                if self.t_eps > 0:
                    self.held = t0 + s + self.t_eps
            if done == size:
                size *= 2
        self.V_P = self.V_P_at(V0, p, T)

    def both(
        self, V0: Decimal, p: Decimal, s: Decimal, h: Decimal
    ) -> tuple[Numbers, Numbers | None] | None:
        """V_C1, and V_C2 unless held, at the nodes of one step; None: too long."""
        ys = self._step(V0, p, s, h)
        if ys is None or self.rule.tail(ys) > TAIL:
            return None
        if self.held is not None:
            return ys, None
        leak = self._integrate([self.Q(y) for y in ys], h)
        return None if self.rule.tail(leak) > TAIL else (ys, leak)

    def _step(self, V0: Decimal, p: Decimal, s: Decimal, h: Decimal) -> Numbers | None:
        d, rule, n = self.d, self.rule, NODES
        V_T = d["V_T"]
        B = [
            d["I_S"] / d["C1"]
            * ((d["V_GS"] + self.V_P_at(V0, p, s + h * u)) / (d["m"] * V_T)).exp()
            for u in rule.u[1:]
        ]  # fmt: skip
        W = [ZERO] * n
        rate0 = self.G / d["C1"]
        drive = d["V_S"] / d["R1"] / d["C1"]
        last = Decimal("Infinity")
        for _ in range(40):
            residual, rates = [], []
            for i in range(n):
                y = self.y + W[i]
                if y < -V_T:
                    return None
                q = (-y / V_T).exp()
                f = drive - rate0 * y - B[i] * (1 - q)
                row = rule.D[i + 1]
                total = h * f
                for j in range(n):
                    total -= row[j + 1] * W[j]
                residual.append(total)
                rates.append(h * (rate0 + B[i] * q / V_T))
            scale = np.array([1 / (1 + float(r)) for r in rates])
            matrix = rule.D_float + np.diag([float(r) for r in rates])
            right = [r / (1 + k) for r, k in zip(residual, rates, strict=True)]
            change = solved(matrix * scale[:, None], right)
            if change is None:
                return None
            largest = max(abs(x) for x in change)
            W = [w + x for w, x in zip(W, change, strict=True)]
            if largest < Decimal("1e-30"):
                return [self.y, *(self.y + w for w in W)]
            if largest > 10 and largest > last:
                return None
            last = largest
        return None

    def _integrate(self, Q: Numbers, h: Decimal) -> Numbers:
        """V_C2 by collocation of its linear equation, refined to all digits."""
        rule, n, r = self.rule, NODES, h / self.tau_L
        matrix = rule.D_float + np.eye(n) * float(r)
        W = [ZERO] * n
        for _ in range(40):
            residual = []
            for i in range(n):
                row = rule.D[i + 1]
                total = r * (Q[i + 1] - self.V2 - W[i])
                for j in range(n):
                    total -= row[j + 1] * W[j]
                residual.append(total)
            change = solved(matrix, residual)
            assert change is not None
            W = [w + x for w, x in zip(W, change, strict=True)]
            if max(abs(x) for x in change) < Decimal("1e-30"):
                break
        return [self.V2, *(self.V2 + w for w in W)]

    def _fires(self, leak: Numbers) -> Decimal | None:
        """Fraction of the step at which V_C2 first reaches V_fire.

        Between two points of the grid that lie below, it may touch V_fire at a
        maximum: that is looked for wherever the grid bends enough to hold one.
        """
        rule = self.rule
        gap = [v - self.V_f for v in leak]
        on_grid = rule.to_grid @ np.array([float(g) for g in gap])
        above = np.flatnonzero(on_grid[1:] >= 0) + 1
        end = int(above[0]) if above.size else rule.grid.size - 1
        # a parabola's top is an eighth of its second difference above the grid
        padded = np.concatenate([on_grid[1:2], on_grid, on_grid[-2:-1]])
        bend = 2.0 * on_grid - padded[:-2] - padded[2:]
        tops = (padded[:-2] <= on_grid) & (padded[2:] <= on_grid)
        near = on_grid + np.abs(bend) >= -1e-12
        slope = None
        for k in np.flatnonzero(tops & near):
            if k > end or on_grid[k] >= 0:
                break
            slope = rule.slope(gap) if slope is None else slope
            low = Decimal(float(rule.grid[k - 1 if k else 0]))
            high = Decimal(float(rule.grid[k + 1 if k < end else end]))
            if rule.at(slope, low) > 0 > rule.at(slope, high):
                top = rule.root(slope, low, high)
                if rule.at(gap, top) >= 0:
                    return rule.root(gap, low, top)
        if above.size == 0:
            return None
        low, high = (Decimal(float(rule.grid[i])) for i in (end - 1, end))
        return rule.root(gap, low, high)

    def _record(
        self, t: Decimal, h: Decimal, done: Decimal, ys: Numbers, leak: Numbers | None
    ) -> None:
        while len(self.found_1) < len(self.times):
            u = (self.times[len(self.found_1)] - t) / h
            if u * h >= done:
                return
            self.found_1.append(self.rule.at(ys, u))
            self.found_2.append(self.V_f if leak is None else self.rule.at(leak, u))
