"""ngspice: the same equations as behavioural sources, spikes read from its output."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import SolverError
from tactile_lab.validation.problem import Answer, OutOfTimeError, Problem

RESET_RESISTANCE = 100.0
"""Of the switch that empties C2, Ohm."""


def installed() -> bool:
    """Whether ngspice can be run."""
    return shutil.which("ngspice") is not None


def netlist(problem: Problem, reltol: float, step: float, output: str) -> str:
    """The circuit of Eqs. (7) to (18) for ngspice.

    T1's emitter resistor is a real resistor and (17) a behavioural source; the firing
    stage is a hysteretic switch across C2.
    """
    c = problem.circuit
    if c.t1 != "emitter_resistor" or c.reset_time > 0 or c.saturation:
        raise SolverError("the netlist has Eq. (17) with R3 and no reset time only")
    points = [(t0, V0, p) for t0, _, V0, p in problem.segments]
    edges = " ".join(f"{t:.17g} {F:.17g}" for t, F in _force_points(problem))
    V_C1, V_C2 = problem.first
    low = c.reset_voltage + 1e-4
    middle, half = (c.fire_voltage + low) / 2, (c.fire_voltage - low) / 2
    V_P = points[0][1]
    return f"""tactile sensor, Eqs. (7)-(18)
* V_P: V_P' = k_F F' - V_P/tau is a high-pass of k_F F
VF force 0 PWL({edges})
BF kf 0 V={c.k_F:.17g}*V(force)
CP kf vp 1
RP vp 0 {c.tau:.17g}
VS vs 0 {c.V_S:.17g}
R1 vs a {c.R1:.17g}
R2 a 0 {c.R2:.17g}
C1 a 0 {c.C1:.17g} IC={V_C1:.17g}
BDS a 0 I={c.I_S:.17g}*exp(({c.V_GS:.17g}+V(vp))/{c.m * c.V_T:.17g})
+ *(1-exp(-V(a)/{c.V_T:.17g}))
R3 vs e {c.R3:.17g}
BC e c2 I={c.I_T1s:.17g}*(exp(V(e,a)/{c.V_T:.17g})-1)
RL c2 0 {c.R_L:.17g}
C2 c2 0 {c.C2:.17g} IC={V_C2:.17g}
VR r 0 {c.reset_voltage:.17g}
S1 c2 r c2 0 fire OFF
.model fire sw vt={middle:.17g} vh={half:.17g} ron={RESET_RESISTANCE:g} roff=1e18
.ic V(vp)={V_P:.17g} V(a)={V_C1:.17g} V(c2)={V_C2:.17g}
.options reltol={reltol:g} abstol=1e-16 vntol={reltol * 1e-3:g} chgtol=1e-18
+ method=gear maxord=2 gmin=1e-18 itl4=100
.control
set numdgt=16
set wr_singlescale
tran {step:g} {problem.until:.17g} 0 {step:g} uic
wrdata {output} v(c2) v(a)
quit
.endc
.end
"""


def _force_points(problem: Problem) -> list[tuple[float, float]]:
    """The force without jumps: one of 1 ns instead, which ngspice can take."""
    found: list[tuple[float, float]] = []
    for t, F in zip(problem.force.time, problem.force.value, strict=True):
        at = float(t)
        if found and at <= found[-1][0]:
            at = found[-1][0] + 1e-9
        found.append((at, float(F)))
    if found[0][0] > 0:
        found.insert(0, (0.0, found[0][1]))
    return found


def ngspice(problem: Problem, reltol: float, cap: float) -> Answer:
    """Run ngspice in a process of its own; spikes by interpolation of its output.

    Raises:
        OutOfTimeError: it took more than `cap` s and was stopped.
        SolverError: it failed or wrote nothing.
    """
    step = min(0.3 * reltol**0.5, 1e-2)
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.txt"
        deck = Path(folder) / "deck.cir"
        deck.write_text(netlist(problem, reltol, step, str(out)))
        try:
            done = subprocess.run(
                ["ngspice", "-b", str(deck)], capture_output=True, timeout=cap,
                check=False, text=True,
            )  # fmt: skip
        except subprocess.TimeoutExpired as error:
            raise OutOfTimeError(f"stopped after {cap:g} s") from error
        if not out.exists():
            lines = [x for x in done.stderr.splitlines() if "rror" in x] or [""]
            raise SolverError(f"ngspice wrote no result: {lines[0]}")
        table = np.loadtxt(out, ndmin=2)
    c = problem.circuit
    spikes = resets(table[:, 0], table[:, 1], c.fire_voltage, c.reset_voltage, c.tau_L)
    return Answer(spikes, float(table[-1, 2]))


def resets(
    t: FloatArray, V: FloatArray, fire: float, reset: float, tau: float
) -> FloatArray:
    """When the firing stage emptied C2, read from V_C2: where it met `fire`, s.

    A reset is a fall from a peak through the lowest tenth of the swing in less than
    half the time in which C2 could leak that far through R_L, `tau` s. How high the
    peak was plays no part: a charge that peaks just below `fire` leaks away slowly.
    """
    low = reset + 0.1 * (fire - reset)
    found = []
    for k in np.flatnonzero((V[:-1] >= low) & (V[1:] < low)):
        peak = k
        while peak > 0 and V[peak - 1] >= V[peak]:
            peak -= 1
        leaks = tau * np.log(V[peak] / low) if low > 0 else np.inf
        if t[k + 1] - t[peak] > 0.5 * leaks:
            continue
        while peak > 0 and V[peak - 1] >= fire:
            peak -= 1
        if peak > 0 and V[peak] > fire > V[peak - 1]:
            part = (fire - V[peak - 1]) / (V[peak] - V[peak - 1])
            found.append(t[peak - 1] + part * (t[peak] - t[peak - 1]))
        else:
            found.append(t[peak])
    return np.array(found)
