"""Extreme cases: jumps, collapse, tiny and huge parameters, grazing, long times."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from decimal import Decimal, localcontext
from functools import partial
from typing import Literal

import numpy as np

from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.model.state import Start
from tactile_lab.validation.problem import Problem
from tactile_lab.validation.reference import constant_firing
from tactile_lab.waveform import Waveform

Truth = Literal["reference", "formula", "refuse", "limit", "finite"]


@dataclass(frozen=True)
class Extreme:
    """One extreme case.

    Attributes:
        problem: the scene.
        truth: "reference" (40 digits), "formula" (Eq. (15) at constant current),
            "refuse" (has no answer and must be refused), "limit" (has one, which the
            solver refuses to count up to) or "finite" (too long for either: right
            answer unknown, must be finite, and the same at another tolerance).
        statistics: keep no spikes, only count.
    """

    problem: Problem
    truth: Truth = "reference"
    statistics: bool = False


def _step(level: float, at: float = 0.1) -> Waveform:
    return Waveform.through([(0, 0), (at, 0), (at, level)])


def _case(
    name: str, circuit: Circuit, force: Waveform, until: float,
    truth: Truth = "reference", statistics: bool = False, start: Start | None = None,
) -> Extreme:  # fmt: skip
    return Extreme(Problem(name, circuit, force, until, start), truth, statistics)


def extremes() -> Iterator[Callable[[], Extreme]]:
    """Every case, built only when it is run."""
    table = Circuit()
    for F in (10.0, -10.0, 0.3, 0.6, 1.0, 2.0):
        yield partial(_case, f"jump {F:+g} N", table, _step(F), 0.4)
    ramp = [(0.1, 0.0), (0.1 + 1e-12, 0.2)]
    yield partial(_case, "ramp 0.2 N in 1e-12 s", table, Waveform.through(ramp), 0.4)
    back = [*ramp[:1], (0.1 + 1e-12, 10.0), (0.2, 10.0), (0.2 + 1e-12, -10.0)]
    yield partial(_case, "ramps ±10 N in 1e-12 s", table, Waveform.through(back), 0.4)
    for V_P in (15.0, -15.0):
        start = Start(V_P=V_P, V_C1=4.3, V_C2=0.0)
        yield partial(
            _case, f"V_P = {V_P:+g} V", table, Waveform.constant(0), 0.3, start=start
        )
    cold = Start(V_P=0.0, V_C1=0.0, V_C2=0.0)
    yield partial(_case, "cold start", table, _step(0.2), 0.4, start=cold)
    yield partial(_case, "cold start, 10 N", table, _step(10.0), 0.4, start=cold)
    for C1 in (1e-15, 1e-9, 1e-6):
        yield partial(_case, f"C1 = {C1:g} F", Circuit(C1=C1), _step(0.2), 0.4)
    yield partial(
        _case, "C2 = 20 fF (1e5 /s)", Circuit(C2=20e-15), _step(0.3, 1e-4), 3e-3
    )
    fast = Circuit(C2=1e-15, V_GS=2.0)
    yield partial(
        _case, "C2 = 1 fF (1.3e7 /s)", fast, Waveform.constant(0), 0.7, "formula", True
    )
    for tau in (1e-9, 1e-6, 1e-3, 1e3, 1e12):
        slow = Waveform.through([(0, 0), (0.1, 0), (0.11, 0.2)])
        yield partial(_case, f"tau = {tau:g} s", Circuit(tau=tau), slow, 0.4)
    yield partial(_case, "R_k = 0", Circuit(R_k=0.0), _step(0.2), 0.4)
    yield partial(_case, "1e6 s of silence", table, Waveform.constant(0), 1e6, "finite")
    after = Waveform.pulse(0.2, ramp=0.01, hold=0.3, rest=1.0)
    yield partial(_case, "spikes, then 1e6 s", table, after, 1e6, "finite")
    firing, rest = Circuit(V_GS=1.6), Waveform.constant(0)
    yield partial(_case, "8e5 s of firing", firing, rest, 8e5, "formula", True)
    yield partial(_case, "1e6 s of firing", firing, rest, 1e6, "limit", True)
    for gap in (1e-3, 1e-6, 1e-9, 1e-12, -1e-12, -1e-9):
        yield partial(grazing, gap)
    yield partial(near_double)
    still = [(0, 0), (0, 0.2), (0.1, 0.2), (0.1, 0.1), (0.1 + 5e-17, 0.3)]
    yield partial(_case, "zero-length segments", table, Waveform.through(still), 0.4)
    yield partial(_million)
    tiny = [(0, 0), (5e-324, 1e-310), (0.1, 5e-324), (0.11, 0.2)]
    yield partial(_case, "subnormal force, time", table, Waveform.through(tiny), 0.4)
    yield partial(_case, "I_S = 1e-60 A", Circuit(I_S=1e-60), _step(0.2), 0.4)
    yield partial(_case, "V_GS = 40 V", Circuit(V_GS=40.0), _step(0.2), 0.3)
    yield partial(_case, "V_GS = 1e4 V", Circuit(V_GS=1e4), _step(0.2), 0.4, "finite")
    yield partial(_case, "V_T = 1e-6 V", Circuit(V_T=1e-6), _step(0.2), 0.4, "finite")
    yield partial(_case, "force 1e300 N", table, _step(1e300), 0.4, "refuse")
    direct = Circuit(t1="direct", I_T1s=2.873e-20)
    yield partial(_case, "direct T1, 20 mN", direct, _step(0.02, 0.01), 0.03)
    yield partial(_case, "direct T1, 200 mN", direct, _step(0.2), 0.4, "refuse", True)
    never = Circuit(V_reset=3.213 - 1e-12)
    yield partial(_case, "V_reset 1 pV below", never, _step(0.2), 0.4, "refuse", True)
    yield from _saturated()


def _saturated() -> Iterator[Callable[[], Extreme]]:
    """T1 saturates: V_C2 empties into node A as that collapses, and clamps."""
    T1 = Circuit(saturation=True)
    for F in (0.2, 0.3, 1.0, 10.0, -10.0):
        yield partial(_case, f"saturated, jump {F:+g} N", T1, _step(F), 0.2)
    cold = Start(V_P=0.0, V_C1=0.0, V_C2=3.0)
    yield partial(_case, "saturated, cold, C2 full", T1, _step(0.2), 0.2, start=cold)
    fast = Circuit(saturation=True, C2=20e-15)
    yield partial(_case, "saturated, C2 = 20 fF", fast, _step(0.2, 1e-4), 4e-3)
    light = Circuit(saturation=True, C1=1e-15)
    yield partial(_case, "saturated, C1 = 1 fF", light, _step(0.2), 0.2)
    still = Waveform.constant(0)
    yield partial(_case, "saturated, 1e6 s of silence", T1, still, 1e6, "finite")
    firing = Circuit(saturation=True, V_GS=1.6)
    yield partial(
        _case, "saturated, 1e6 s of firing", firing, still, 1e6, "limit", True
    )


def grazing(gap: float) -> Extreme:
    """Force so that the highest V_C2 lies `gap` (relative) above V_fire."""
    wave = Waveform.through([(0, 0), (0.01, 0.11), (3, 0.11)])
    calm = Circuit(V_th=1000.0)
    found = simulate(calm, wave, until=3.0, keep=("V_C2",))
    low, high = 0.02, 3.0
    for _ in range(60):
        times = np.linspace(low, high, 401)
        V = found.sample("V_C2", times)
        k = int(np.argmax(V))
        low, high = times[max(k - 1, 0)], times[min(k + 1, 400)]
    top = float(V[k])
    return _case(f"grazing {gap:+g}", Circuit(V_th=top * (1 - gap)), wave, 1.0)


def near_double() -> Extreme:
    """Q passes V_fire twice within a microsecond or so."""
    wave = Waveform.through([(0, 0), (0.5, 0.1), (0.5 + 1e-6, 0.0)])
    calm = simulate(Circuit(), wave, until=0.6, keep=("I_C", "V_C2"))
    times = 0.5 + np.linspace(0.0, 1e-4, 2001)
    top = float(np.max(Circuit().R_L * calm.sample("I_C", times)))
    return _case("near-double root of Q", Circuit(V_th=top * (1 - 1e-13)), wave, 0.6)


def _million() -> Extreme:
    time = np.linspace(0.0, 100.0, 1_000_001)
    wave = Waveform(time, 0.15 * np.abs(np.sin(time)))
    return _case("a million segments", Circuit(), wave, 100.0, "finite")


def formula(problem: Problem) -> tuple[int, float]:
    """Count and last spike at a constant current from V_reset on, Eq. (15)."""
    with localcontext() as context:
        context.prec = 40
        period = constant_firing(problem.circuit)
        count = int(Decimal(problem.until) / period)
        return count, float(count * period)
