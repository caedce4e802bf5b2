"""A slow, independent reference with 40 digits, to measure the solver's true error.

It shares no code with the solver: 32 Radau nodes in decimal arithmetic, V_C1 and V_C2
integrated as they stand, restarted at every spike, spikes found on a fine grid. Errors
of its answers are around 1e-20 s and V.
"""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal, localcontext

from tactile_lab.model.circuit import Circuit
from tactile_lab.model.state import Start
from tactile_lab.validation.decimal_cascade import Cascade, Reference
from tactile_lab.validation.decimal_pair import Pair
from tactile_lab.waveform import Waveform

DIGITS = 40


def reference(
    circuit: Circuit,
    force: Waveform,
    until: float,
    *,
    start: Start | None = None,
    times: Sequence[float] = (),
) -> Reference:
    """Solve Eqs. (3)-(18) from time 0 to `until` s; see `simulate` for arguments.

    Raises:
        SolverError: the steps do not converge.
    """
    with localcontext() as context:
        context.prec = DIGITS
        return _solver(circuit)(circuit, force, until, start, times).solve()


def constant_firing(circuit: Circuit) -> Decimal:
    """Interval between spikes at rest, the inverse of Eq. (15), s.

    The circuit must fire at rest (see `fires_at_rest`).
    """
    run = _solver(circuit)(circuit, Waveform.constant(0.0), 1.0, None, ())
    Q = run.Q(run.y)
    return run.t_eps - run.tau_L * ((Q - run.V_f) / (Q - run.V_r)).ln()


def _solver(circuit: Circuit) -> type[Cascade]:
    return Pair if circuit.saturation else Cascade
