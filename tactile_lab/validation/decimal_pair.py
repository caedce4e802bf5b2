"""The 40-digit reference where T1 saturates: V_C1 and V_C2 in one collocation.

Ebers and Moll's currents in decimal arithmetic; only corrections are solved for in
double precision, and repeated until nothing changes in the thirtieth digit.
"""

from __future__ import annotations

import math
from decimal import Decimal

import numpy as np

from tactile_lab.model.equations import rest_point, wright_omega
from tactile_lab.validation.decimal_cascade import TAIL, Cascade
from tactile_lab.validation.decimal_rule import NODES, ONE, ZERO, Numbers, solved

Four = tuple[float, float, float, float]


class Pair(Cascade):
    """Both voltages at once."""

    def T1(self, y: Decimal, v: Decimal) -> tuple[Decimal, Decimal, Four]:
        """I_B and I_C, and their derivatives (I_B by y and v, I_C by y and v)."""
        d = self.d
        V_T, I_s, r = d["V_T"], d["I_T1s"], ONE + ONE / d["beta_R"]
        e = ((v - y) / V_T).exp()
        J, J_v = I_s * (e - 1), float(I_s * e / V_T)
        U = d["V_S"] - y
        if self.c.t1 == "direct":
            I_F = I_s * ((U / V_T).exp() - 1)
            F_y, F_v = -float((I_F + I_s) / V_T), 0.0
        else:
            R = d["R3"] * (ONE + ONE / d["beta_F"])
            z = (U + d["R3"] * J + I_s * R) / V_T + (I_s * R / V_T).ln()
            w = Decimal(float(wright_omega(float(z)))) if z > -500 else z.exp()
            for _ in range(2):
                w += (z - w - w.ln()) * w / (1 + w)
            I_F = V_T / R * w - I_s
            g = float(w / (1 + w) / R)
            F_v = g * float(d["R3"]) * J_v
            F_y = -g - F_v
        per_F, per_R = 1 / self.c.beta_F, 1 / self.c.beta_R
        slopes = (
            F_y * per_F - J_v * per_R, F_v * per_F + J_v * per_R,
            F_y + J_v * float(r), F_v - J_v * float(r),
        )  # fmt: skip
        return I_F / d["beta_F"] + J / d["beta_R"], I_F - J * r, slopes

    def slopes(
        self, B: Decimal, y: Decimal, v: Decimal
    ) -> tuple[Decimal, Decimal, Four]:
        """dV_C1/dt, dV_C2/dt and their derivatives; V_C2 at V_reset during a reset."""
        d, held = self.d, self.held is not None
        I_B, I_C, (a, b, c, e) = self.T1(y, self.V_r if held else v)
        q = (-y / d["V_T"]).exp()
        one = ((d["V_S"] - y) / d["R1"] - y / d["R2"] + I_B) / d["C1"] - B * (1 - q)
        C1, C2 = self.c.C1, self.c.C2
        by_y = a / C1 - float(self.G / d["C1"] + B * q / d["V_T"])
        if held:
            return one, ZERO, (by_y, 0.0, 0.0, 0.0)
        two = (I_C + d["I_bias"]) / d["C2"] - v / self.tau_L
        return one, two, (by_y, b / C1, c / C2, e / C2 - 1 / float(self.tau_L))

    def B(self, V_P: Decimal) -> Decimal:
        """I_DS of an open channel over C1, Eq. (8)."""
        d = self.d
        return d["I_S"] / d["C1"] * ((d["V_GS"] + V_P) / (d["m"] * d["V_T"])).exp()

    def rest(self) -> tuple[Decimal, Decimal]:
        """Newton from the double-precision equilibrium."""
        y, v = (Decimal(x) for x in rest_point(self.c))
        self.held = None
        for _ in range(8):
            one, two, (a, b, c, e) = self.slopes(self.B(ZERO), y, v)
            det = Decimal(a * e - b * c)
            y -= (one * Decimal(e) - two * Decimal(b)) / det
            v -= (two * Decimal(a) - one * Decimal(c)) / det
        return y, v

    def both(
        self, V0: Decimal, p: Decimal, s: Decimal, h: Decimal
    ) -> tuple[Numbers, Numbers | None] | None:
        """V_C1 and V_C2 at the nodes of one step; None: too long."""
        rule, n, r = self.rule, NODES, float(h)
        B = [self.B(self.V_P_at(V0, p, s + h * u)) for u in rule.u[1:]]
        most = Decimal(self._reach(float(max(B)))) + self.d["V_T"]
        most = max(most, self.V2 - self.y)
        W = [ZERO] * (2 * n)
        for _ in range(60):
            matrix = np.zeros((2 * n, 2 * n))
            matrix[:n, :n] = matrix[n:, n:] = rule.D_float
            scale, right = np.ones(2 * n), []
            for i in range(n):
                one, two, four = self.slopes(B[i], self.y + W[i], self.V2 + W[n + i])
                row = rule.D[i + 1]
                for k, f in ((0, one), (n, two)):
                    total = h * f
                    for j in range(n):
                        total -= row[j + 1] * W[k + j]
                    right.append((k + i, total))
                matrix[i, i] -= r * four[0]
                matrix[i, n + i] -= r * four[1]
                matrix[n + i, i] -= r * four[2]
                matrix[n + i, n + i] -= r * four[3]
                scale[i] = 1 / (1 + r * (abs(four[0]) + abs(four[1])))
                scale[n + i] = 1 / (1 + r * (abs(four[2]) + abs(four[3])))
            sides = [x * Decimal(scale[i]) for i, x in sorted(right)]
            change = solved(matrix * scale[:, None], sides)
            if change is None:
                return None
            W = [w + x for w, x in zip(W, change, strict=True)]
            for i in range(n):
                if self.held is None:
                    W[n + i] = min(W[n + i], self.y + W[i] + most - self.V2)
                if self.y + W[i] < -self.d["V_T"]:
                    return None
            if max(abs(x) for x in change) < Decimal("1e-30"):
                break
        else:
            return None
        ys = [self.y, *(self.y + w for w in W[:n])]
        vs = [self.V2, *(self.V2 + w for w in W[n:])]
        if rule.tail(ys) > TAIL or rule.tail(vs) > TAIL:
            return None
        return ys, None if self.held is not None else vs

    def _reach(self, B: float) -> float:
        """V_C2 - V_C1 at which C2 would lose more than all that may come."""
        c = self.c
        if c.t1 == "direct":
            most = c.I_T1s * math.exp(min(c.V_S / c.V_T, 600.0))
        else:
            most = (c.V_S + c.V_T) / c.R3
        most += abs(c.I_bias) + c.C2 * (B + c.V_S / c.tau_A)
        return c.V_T * math.log1p(most * c.beta_R / c.I_T1s)
