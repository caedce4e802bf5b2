"""Error against run time: every method on every scene, interleaved and repeated."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from math import ceil
from time import process_time
from typing import Any

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import TactileLabError
from tactile_lab.model import kernel
from tactile_lab.model.simulate import Result, simulate
from tactile_lab.validation import general, rivals, spice
from tactile_lab.validation.exact_firing import exact_firing
from tactile_lab.validation.problem import Answer, OutOfTimeError, Problem
from tactile_lab.validation.problem import spent as spent_with_children
from tactile_lab.validation.reference import reference

SPAN = 1e-3
"""Least CPU time, s, of the calls in a row that are timed together, as `timeit` has it:
a short call alone is timed with the clock's own, and with caches that others left."""
OURS = "tactile_lab"
EXACT = "exact integrate-and-fire"


TIMED_OUT = "timed out"
"""Verdict on a call that was stopped at the cap."""
CAPPED = (
    f" (compiled methods: {rivals.EVALUATIONS_PER_SECOND:.0e} evaluations for each "
    "second of it, about half of what they do in one; fixed steps that need more are "
    "not begun)"
)
"""What the cap means for each kind of method, for a report."""
COMPILED, CALLED, PROCESS = "compiled", "called from Python", "own process"
"""Where a method's inner loop runs."""


def _itself(found: Any) -> Any:
    return found


@dataclass(frozen=True)
class Method:
    """One solver at one setting.

    Attributes:
        name: of the solver.
        setting: tolerance or step, for tables.
        solve: what it finds for a problem, within `cap` s of CPU time.
        repeats: how often it is timed; the least counts.
        runs: "compiled" whole, "called from Python" at each evaluation of the
            right-hand side, or in its "own process".
        answer: what it found, as all are compared; no part of its time.
    """

    name: str
    setting: str
    solve: Callable[..., Any]
    repeats: int = 1
    runs: str = CALLED
    answer: Callable[[Any], Answer] = _itself


@dataclass(frozen=True)
class Row:
    """One result.

    Attributes:
        scene: name.
        method: name.
        setting: tolerance or step.
        runs: see `Method`.
        verdict: "right", "wrong count", "NaN", "timed out" or "failed".
        spikes: count found, None without an answer.
        spike_error: largest true error of a spike time, s, where the count is right.
        V_C1_error: true error of V_C1 at the end, V.
        estimate: our own estimate of `spike_error`, s; None for others.
        evaluations: of the right-hand side, None where unknown.
        run_time: least CPU time of a call, s, over `SPAN` of calls in a row.
        note: why it failed.
    """

    scene: str
    method: str
    setting: str
    runs: str
    verdict: str
    spikes: int | None = None
    spike_error: float | None = None
    V_C1_error: float | None = None
    estimate: float | None = None
    evaluations: int | None = None
    run_time: float = 0.0
    note: str = ""


def ours(problem: Problem, cap: float, tolerance: float = 1e-9) -> Answer:
    """Our solver, spikes kept."""
    return answered(simulated(problem, cap, tolerance))


def simulated(problem: Problem, cap: float, tolerance: float) -> Result:
    """What a script calls, and no more: this is timed."""
    return simulate(
        problem.circuit, problem.force, until=problem.until, start=problem.start,
        tolerance=tolerance,
    )  # fmt: skip


def answered(found: Result) -> Answer:
    """What our solver found, as all are compared."""
    solved = found.solution
    return Answer(
        solved.spike_times, solved.memory.item(kernel.Y), solved.evaluations,
        solved.error_spike_time,
    )  # fmt: skip


def methods(
    repeats: int, spice_too: bool = True, *, called: bool = True
) -> list[Method]:
    """All that are installed, each at several settings; without `called` the compiled.

    Args:
        repeats: how often slow ones are timed; fast ones 20 times as often.
        spice_too: ngspice takes part.
        called: those called from Python take part.
    """

    def at(
        name: str, tolerance: float, solve: partial[Any], times: int = 1,
        runs: str = CALLED,
    ) -> Method:  # fmt: skip
        return Method(name, f"tol {tolerance:g}", solve, times, runs)

    fast = 20 * repeats
    found = [
        Method(
            OURS, f"tol {tol:g}", partial(simulated, tolerance=tol), fast, COMPILED,
            answered,
        )
        for tol in [10.0**-n for n in range(2, 14)]
    ]  # fmt: skip
    for name, kind in (
        ("Dormand-Prince 5(4)", rivals.DORMAND_PRINCE), ("Rodas5P", rivals.RODAS),
    ):  # fmt: skip
        for tol in [10.0**-n for n in range(3, 14)]:
            solve = partial(rivals.stepped, method=kind, tolerance=tol)
            found.append(at(name, tol, solve, fast, COMPILED))
    for dt in (1e-3, 1e-4, 1e-5, 1e-6):
        for name, order, events in (
            ("Euler", rivals.EULER, rivals.ON_GRID),
            ("Euler, interpolated", rivals.EULER, rivals.INTERPOLATED),
            ("RK4", rivals.RK4, rivals.ON_GRID),
            ("RK4, interpolated", rivals.RK4, rivals.INTERPOLATED),
        ):
            solve = partial(rivals.fixed_step, order=order, events=events, dt=dt)
            times = repeats if dt > 1e-5 else 1
            found.append(Method(name, f"dt {dt:g}", solve, times, COMPILED))
        solve = partial(exact_firing, dt=dt)
        times = repeats if dt > 1e-6 else 1
        found.append(Method(EXACT, f"dt {dt:g}", solve, times, COMPILED))
    if not called:
        return found
    for tol in (1e-6, 1e-9, 1e-12):
        for name in general.SCIPY:
            solve = partial(general.scipy_solver, method=name, tolerance=tol)
            found.append(at(name, tol, solve))
    if find_spec("sksundae") is not None:
        for tol in (1e-6, 1e-9, 1e-11, 1e-12, 1e-13):
            for name in ("Adams", "BDF"):
                solve = partial(general.cvode, method=name, tolerance=tol)
                found.append(at(f"CVODE {name}", tol, solve, repeats))
    if spice_too and spice.installed():
        for tol in (1e-3, 1e-5, 1e-6):
            solve = partial(spice.ngspice, reltol=tol)
            found.append(Method("ngspice", f"reltol {tol:g}", solve, 1, PROCESS))
    return found


@dataclass(frozen=True)
class Truth:
    """Spike times and the last V_C1, from the reference or by a formula."""

    spike_times: FloatArray
    V_C1: float


def truth(problem: Problem) -> Truth:
    """By the 40-digit reference; takes seconds to minutes."""
    exact = reference(
        problem.circuit, problem.force, problem.until, start=problem.start,
        times=[problem.until],
    )  # fmt: skip
    return Truth(np.array([float(t) for t in exact.spike_times]), float(exact.V_C1[0]))


def judge(problem: Problem, method: Method, exact: Truth, cap: float) -> Row:
    """Run once and compare; failures become verdicts."""
    failed = Row(problem.name, method.name, method.setting, method.runs, "failed")
    spent = _clock(method)
    began = spent()
    try:
        found = method.solve(problem, cap=cap)
    except (TactileLabError, ArithmeticError, ValueError, RuntimeError) as error:
        note = " ".join(str(error).split())[:120]
        verdict = "NaN" if "NaN" in note else "failed"
        if isinstance(error, OutOfTimeError):
            verdict = TIMED_OUT
        return replace(failed, verdict=verdict, note=note, run_time=spent() - began)
    took = spent() - began
    answer = method.answer(found)
    spikes = answer.spike_times
    right = spikes.size == exact.spike_times.size
    gap = np.abs(spikes - exact.spike_times).max(initial=0.0) if right else None
    return replace(
        failed,
        verdict="right" if right else "wrong count",
        spikes=int(spikes.size),
        spike_error=None if gap is None else float(gap),
        V_C1_error=abs(answer.V_C1 - exact.V_C1),
        estimate=answer.estimate,
        evaluations=answer.evaluations,
        run_time=took,
    )


def timed(problem: Problem, method: Method, cap: float, calls: int) -> float:
    """CPU time of a call, s: the mean of so many in a row."""
    spent = _clock(method)
    began = spent()
    for _ in range(calls):
        method.solve(problem, cap=cap)
    return (spent() - began) / calls


def _clock(method: Method) -> Callable[[], float]:
    """CPU time so far, s, of all that the method computes in."""
    return spent_with_children if method.runs == PROCESS else process_time


def contest(
    problems: Sequence[Problem],
    entrants: Sequence[Method],
    cap: float,
    say: Callable[[str], None],
) -> Iterator[Row]:
    """Rows of every entrant on every scene; repeats are interleaved."""
    for problem in problems:
        say(f"{problem.name}: reference")
        exact = truth(problem)
        # compilation is no part of it
        ours(problem, cap)
        with suppress(TactileLabError):  # nor is this answer, which may be NaN
            rivals.fixed_step(problem, cap, rivals.EULER, rivals.ON_GRID, 1e-2)
            rivals.stepped(problem, cap, rivals.RODAS, 1e-3)
            exact_firing(problem, cap, 1e-2)
        rows: dict[int, Row] = {}
        for turn in range(max(m.repeats for m in entrants)):
            for k, method in enumerate(entrants):
                if turn >= method.repeats:
                    continue
                old = rows.get(k)
                if old is None:
                    old = judge(problem, method, exact, cap)
                    say(f"{problem.name}: {method.name} {method.setting} {old.verdict}")
                if _answered(old) and old.run_time <= 0.2:
                    took = timed(problem, method, cap, ceil(SPAN / old.run_time))
                    old = replace(old, run_time=min(took, old.run_time))
                rows[k] = old
        yield from (rows[k] for k in sorted(rows))


def _answered(row: Row) -> bool:
    return row.verdict in ("right", "wrong count")
