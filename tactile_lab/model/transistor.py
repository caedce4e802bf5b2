"""T1 that saturates: Ebers and Moll's currents instead of Eq. (17).

With J = I_T1s (exp((V_C2 - V_C1)/V_T) - 1) through its collector junction and
I_F = I_T1s (exp(V_EB/V_T) - 1) through its emitter junction,

    I_C = I_F - J (1 + 1/beta_R)                         into C2
    I_B = I_F/beta_F + J/beta_R                          into node A
    V_EB + R3 (I_F (1 + 1/beta_F) - J) = V_S - V_C1

so once V_C2 is some 0.4 V above V_C1, T1's current goes to node A and not to C2.
"""

from __future__ import annotations

import math

from tactile_lab.arrays import FloatArray
from tactile_lab.model.compiled import inner
from tactile_lab.model.integrator import DIRECT, PARAMETERS, V_S, omega_near
from tactile_lab.model.node_a import V_T

I_S1, R_E, PER_F, PER_R, T1_C1, T1_C2, T1_BIAS, E_DROP, E_LOG, SATURATES = range(
    PARAMETERS, PARAMETERS + 10
)
"""Where `par` holds I_T1s, R3, 1/beta_F, 1/beta_R, C1, C2, I_bias, a R3 I_T1s and
ln(a R3 I_T1s/V_T) with a = 1 + 1/beta_F, and whether T1 saturates at all."""
ALL_PARAMETERS = PARAMETERS + 10
EXPONENT_CAP = 230.0
TO_A, TO_C2, A_BY_1, A_BY_2, C2_BY_1, C2_BY_2, OF_B, OF_Q, OF_X, OF_W = range(10)
"""Where `pair.flow` puts both slopes, V/s, their derivatives by either voltage, 1/s,
and what they are made of: B, exp(-V_C1/V_T) - 1, J/I_T1s and omega or, with "direct",
I_F + I_T1s."""
FLOW = 10
"""Numbers of a flow."""


@inner
def of_junctions(X: float, W: float, par: FloatArray, out: FloatArray) -> None:
    """Fill `out` from the collector junction's state X and the emitter junction's W.

    I_B/C1 and (I_C + I_bias)/C2, V/s, then their derivatives by V_C1 and V_C2, 1/s.
    """
    out[OF_X], out[OF_W] = X, W
    J = par[I_S1] * X
    per_t, per_1, per_2 = 1.0 / par[V_T], 1.0 / par[T1_C1], 1.0 / par[T1_C2]
    J_v = (J + par[I_S1]) * per_t
    if par[DIRECT] != 0.0:
        I_F = W - par[I_S1]
        F_y, F_v = -W * per_t, 0.0
    else:
        per_R = 1.0 / ((1.0 + par[PER_F]) * par[R_E])
        I_F = par[V_T] * per_R * W - par[I_S1]
        g = W / (1.0 + W) * per_R
        F_v = g * par[R_E] * J_v
        F_y = -g - F_v
    J_1, J_2 = par[PER_R], 1.0 + par[PER_R]
    out[TO_A] = (I_F * par[PER_F] + J * J_1) * per_1
    out[TO_C2] = (I_F - J * J_2 + par[T1_BIAS]) * per_2
    out[A_BY_1] = (F_y * par[PER_F] - J_v * J_1) * per_1
    out[A_BY_2] = (F_v * par[PER_F] + J_v * J_1) * per_1
    out[C2_BY_1] = (F_y + J_v * J_2) * per_2
    out[C2_BY_2] = (F_v - J_v * J_2) * per_2


@inner
def currents(y: float, v: float, near: float, par: FloatArray, out: FloatArray) -> None:
    """Fill `out` at V_C1 = y, V_C2 = v with the junctions' state and `of_junctions`.

    `near` is what omega may be near, nothing if not known.
    """
    per_t = 1.0 / par[V_T]
    X = math.exp(min((v - y) * per_t, EXPONENT_CAP)) - 1.0
    U = par[V_S] - y
    if par[DIRECT] != 0.0:
        W = par[I_S1] * math.exp(min(U * per_t, 600.0))
    else:
        J = par[I_S1] * X
        z = (U + par[R_E] * J + par[E_DROP]) * per_t + par[E_LOG]
        W = omega_near(z, near)
    of_junctions(X, W, par, out)


@inner
def reach(low: float, fastest: float, par: FloatArray) -> float:
    """What V_C2 - V_C1 cannot rise above, V: there C2 loses more than all that comes.

    It loses J/beta_R at least, since R3 lets J leave through the emitter only as far as
    I_F does not bring it back. `low` is the least V_C1, V, `fastest` its fall, V/s.
    """
    U = par[V_S] - low
    if par[DIRECT] != 0.0:
        most = par[I_S1] * math.exp(min(U / par[V_T], 600.0))
    else:
        most = U / par[R_E]
    most += abs(par[T1_BIAS]) + fastest * par[T1_C2]
    return float(par[V_T] * math.log1p(most / (par[I_S1] * par[PER_R])))
