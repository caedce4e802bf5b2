"""Many circuits under one force, solved without returning to Python in between."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.model import derived, kernel, packed, spiking
from tactile_lab.model.circuit import LARGEST, LARGEST_VOLTAGE, SMALLEST, Circuit, units
from tactile_lab.model.compiled import entry, inner, inner_making_arrays, source_stamp
from tactile_lab.model.need import INTEGRATOR, NODE_A, SPIKES, checked_tolerance
from tactile_lab.model.rest_pair import rest_of_cascade
from tactile_lab.model.scratch import read_only
from tactile_lab.model.solver import MOST_SPIKES
from tactile_lab.model.state import Start
from tactile_lab.model.transistor import ALL_PARAMETERS
from tactile_lab.spikes.trains import Trains
from tactile_lab.waveform import Waveform

FIRING = ("fire_voltage", "reset_voltage", "reset_time")
"""Fields of a record beside a circuit's own: `firing` resolved."""
CHUNK = 1 << 14
"""Spike times for which there is room at first."""

Records = NDArray[np.void]


def records(circuit: Circuit, changes: Mapping[str, FloatArray]) -> Records:
    """A record for each of n circuits, as compiled code takes them.

    Args:
        circuit: what does not change.
        changes: numbers by their name, each of shape (n,), SI.
    """
    names = tuple(units())
    size = next(iter(changes.values())).size if changes else 1
    made = np.empty(size, [(name, np.float64) for name in (*names, *FIRING)])
    for name in names:
        value = changes.get(name, getattr(circuit, name))
        made[name] = math.nan if value is None else value
    for name, wanted in zip(FIRING, ("V_fire", "V_reset", "t_eps"), strict=True):
        made[name] = changes.get(wanted, getattr(circuit, name))
    if circuit.V_fire is None and circuit.firing == "lif" and "V_fire" not in changes:
        made["fire_voltage"] = made["V_th"]
    return made


def certain(circuit: Circuit, many: Records, start: Start | None) -> NDArray[np.bool_]:
    """Which records `Circuit` surely accepts, shape (n,); it says what the others are.

    Args:
        circuit: what the records were made of.
        many: see `records`.
        start: where they start, None for the equilibrium.
    """
    good = np.ones(many.size, dtype=bool)
    with np.errstate(all="ignore"):
        for name, unit in units().items():
            if name in ("V_fire", "V_reset", "t_eps"):
                continue
            least = SMALLEST if unit.above is not None else -LARGEST
            most = LARGEST_VOLTAGE if unit.symbol == "V" else LARGEST
            good &= (many[name] >= least) & (many[name] <= most)
        fire, reset = many["fire_voltage"], many["reset_voltage"]
        good &= (np.abs(fire) <= LARGEST_VOLTAGE) & (np.abs(reset) <= LARGEST_VOLTAGE)
        good &= (reset < fire) & (many["V_GS"] >= -LARGEST_VOLTAGE)
        good &= (many["reset_time"] >= 0) & (many["reset_time"] <= LARGEST)
        good &= (many["d"] >= 0) & (many["d"] < many["L"]) & (many["R_k"] >= 0)
        view = many.view(np.recarray)
        tau_L = view.R_L * view.C2
        for tau in (tau_L, derived.tau_A(view)):
            good &= (tau >= 1e-30) & (tau <= 1e30)
        good &= np.abs(derived.k_F(view)) <= 1e30
        if start is not None:
            good &= (start.V_C1 >= 0) & (start.V_C1 <= view.V_S)
            good &= (start.V_C2 < fire) & (abs(start.V_C2) <= LARGEST_VOLTAGE)
            good &= abs(start.V_P) <= LARGEST_VOLTAGE
    return good


def spike_trains(
    circuit: Circuit,
    many: Records,
    force: Waveform,
    *,
    until: float,
    start: Start | None = None,
    tolerance: float = 1e-9,
    keep_times: bool = True,
) -> tuple[Trains, NDArray[np.bool_]]:
    """The spikes of many circuits, each to the last bit those of `simulate`.

    Args:
        circuit: what the records were made of; T1 must not saturate.
        many: circuits that `certain` accepts.
        force: N over s, the same for each.
        until: end, s.
        start: voltages at time 0; equilibrium if None.
        tolerance: of spike times, s.
        keep_times: whether spike times are wanted, or number, first and last alone.

    Returns:
        The trains, and for each whether it was solved: `simulate` says why not.

    Raises:
        ParameterError: the tolerance cannot be asked for.
    """
    begin = np.full(3, math.nan)
    if start is not None:
        begin[:] = start.V_P, start.V_C1, start.V_C2
    count, first, last, status, times = run(
        many, circuit.t1 == "direct", begin, force.time, force.value, until,
        checked_tolerance(tolerance), keep_times, MOST_SPIKES,
    )  # fmt: skip
    return Trains(count, first, last, times), status == kernel.DONE


def critical_forces(circuit: Circuit, many: Records) -> FloatArray:
    """The critical force of each, N, NaN where there is none; see `derived`."""
    found: FloatArray = forces(many, circuit.t1 == "direct")
    return found


def rests(circuit: Circuit, many: Records) -> FloatArray:
    """V_C1 of each at rest, V."""
    found: FloatArray = rest_voltages(many, circuit.t1 == "direct")
    return found


_per_newton, _decay = inner(derived.k_F), inner(derived.tau_A)
_critical_V_C1 = inner(derived.critical_V_C1)
_critical_force = inner(derived.critical_force)
_fill = inner(packed.fill)


@inner_making_arrays
def appended(whole: FloatArray, size: int, part: FloatArray, more: int) -> FloatArray:
    """The array with `more` of `part` after its first `size`, moved if need be."""
    if size + more > whole.size:
        larger = np.empty(max(2 * whole.size, size + more))
        for i in range(size):
            larger[i] = whole[i]
        whole = larger
    for i in range(more):
        whole[size + i] = part[i]
    return whole


@inner
def numbers_of(c: Any, direct: bool, par: FloatArray) -> float:
    """Fill `par` with a record's numbers, and give its k_F, V/N."""
    _fill(c, _decay(c), _critical_V_C1(c, direct), direct, par)
    return float(_per_newton(c))


@inner
def begun(V_P: float, y: float, v: float, force: float, S: FloatArray) -> None:
    """Set the kernel's memory to these voltages, V, under `force` N, at 0 s."""
    for i in range(S.size):
        S[i] = kernel.FRESH[i]
    S[kernel.Y], S[spiking.VOLTAGE] = y, v
    S[kernel.V_P] = S[kernel.V_P_HIGHEST] = V_P
    S[kernel.FORCE] = force


@inner_making_arrays
def train(
    c: Any,
    k_F: float,
    begin: FloatArray,
    time: FloatArray,
    force: FloatArray,
    until: float,
    tolerance: float,
    asked: int,
    most: float,
    par: FloatArray,
    S: FloatArray,
) -> Any:
    """One record's spikes; `begin` holds V_P, V_C1, V_C2 or NaN for the equilibrium.

    Hand it `read_only` arrays but for `begin` and `S`, or it is compiled again.

    Returns:
        The kernel's status, and spike times, of which `S` tells the number.
    """
    V_P, y, v = begin[0], begin[1], begin[2]
    if not V_P == V_P:
        V_P = 0.0
        y, v = rest_of_cascade(par)
        if v >= c.fire_voltage:
            v = c.reset_voltage
    begun(V_P, y, v, force[0], S)
    return kernel.run(time, force, until, k_F, par, S, tolerance, asked, most)


def _build(stamp: int) -> tuple[Callable[..., Any], ...]:
    @entry
    def run(
        many: Any,
        direct: bool,
        begin: FloatArray,
        time: FloatArray,
        force: FloatArray,
        until: float,
        tolerance: float,
        keep_times: bool,
        most: float,
    ) -> Any:
        _ = stamp
        n = many.size
        count, status = np.zeros(n, np.int64), np.zeros(n, np.int64)
        first, last = np.full(n, np.nan), np.full(n, np.nan)
        times, size = np.empty(CHUNK if keep_times else 0), 0
        asked = NODE_A | INTEGRATOR | (SPIKES if keep_times else 0)
        par = np.empty(ALL_PARAMETERS)
        S = np.empty(kernel.FRESH.size)
        for i in range(n):
            k_F = numbers_of(many[i], direct, par)
            status[i], spikes = train(
                many[i], k_F, begin, time, force, until, tolerance, asked, most,
                read_only(par), S,
            )  # fmt: skip
            if status[i] != kernel.DONE:
                continue
            count[i] = int(S[spiking.COUNT])
            if count[i]:
                first[i], last[i] = S[spiking.FIRST], S[spiking.LAST]
            if keep_times:
                times = appended(times, size, spikes, count[i])
                size += count[i]
        return count, first, last, status, times[:size].copy()

    @entry
    def forces(many: Any, direct: bool) -> FloatArray:
        _ = stamp
        found = np.empty(many.size)
        for i in range(many.size):
            c = many[i]
            found[i] = _critical_force(c, _critical_V_C1(c, direct), _per_newton(c))
        return found

    @entry
    def rest_voltages(many: Any, direct: bool) -> FloatArray:
        _ = stamp
        found = np.empty(many.size)
        par = np.empty(ALL_PARAMETERS)
        for i in range(many.size):
            numbers_of(many[i], direct, par)
            found[i] = rest_of_cascade(read_only(par))[0]
        return found

    return run, forces, rest_voltages


run, forces, rest_voltages = _build(source_stamp())
