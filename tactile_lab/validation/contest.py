"""Error against run time: every method on every scene, interleaved and repeated."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial

import numpy as np

from tactile_lab.errors import TactileLabError
from tactile_lab.model.circuit import FloatArray
from tactile_lab.model.simulate import simulate
from tactile_lab.validation import general, spice
from tactile_lab.validation.problem import OutOfTimeError, Problem
from tactile_lab.validation.reference import reference
from tactile_lab.validation.stopwatch import spent

OURS = "tactile_lab"
Solve = Callable[[Problem, float], general.Answer]


@dataclass(frozen=True)
class Method:
    """One solver at one setting.

    Attributes:
        name: of the solver.
        setting: tolerance or step, for tables.
        solve: spike times and last V_C1 within a cap on CPU time.
        repeats: how often it is timed; the least counts.
    """

    name: str
    setting: str
    solve: Solve
    repeats: int = 1


@dataclass(frozen=True)
class Row:
    """One result.

    Attributes:
        scene: name.
        method: name.
        setting: tolerance or step.
        verdict: "right", "wrong count", "NaN", "timed out" or "failed".
        spikes: count found, None without an answer.
        spike_error: largest true error of a spike time, s, where the count is right.
        V_C1_error: true error of V_C1 at the end, V.
        run_time: least CPU time, s.
        note: why it failed.
    """

    scene: str
    method: str
    setting: str
    verdict: str
    spikes: int | None
    spike_error: float | None
    V_C1_error: float | None
    run_time: float
    note: str = ""


def ours(problem: Problem, cap: float, tolerance: float = 1e-9) -> general.Answer:
    """Our solver, spikes kept."""
    found = simulate(
        problem.circuit, problem.force, until=problem.until, start=problem.start,
        tolerance=tolerance,
    )  # fmt: skip
    assert found.spike_times is not None
    return found.spike_times, found.end.V_C1


def methods(repeats: int, spice_too: bool = True) -> list[Method]:
    """All that are installed, each at several settings."""
    found = [
        Method(OURS, f"tol {tol:g}", partial(ours, tolerance=tol), 20 * repeats)
        for tol in (1e-3, 1e-6, 1e-9, 1e-12)
    ]
    for dt in (1e-3, 1e-4, 1e-5, 1e-6):
        found += [
            Method(
                name, f"dt {dt:g}",
                partial(_fixed, order=order, dt=dt), repeats if dt > 1e-5 else 1,
            )
            for name, order in (("Euler", 1), ("RK4", 4))
        ]  # fmt: skip
    for tol in (1e-6, 1e-9, 1e-12):
        for name in general.SCIPY:
            found.append(
                Method(name, f"tol {tol:g}", partial(_scipy, method=name, tol=tol))
            )
    if _has_cvode():
        for tol in (1e-6, 1e-9, 1e-11, 1e-12, 1e-13):
            for name in ("Adams", "BDF"):
                found.append(
                    Method(
                        f"CVODE {name}", f"tol {tol:g}",
                        partial(_cvode, method=name, tol=tol), repeats,
                    )
                )  # fmt: skip
    if spice_too and spice.installed():
        found += [
            Method("ngspice", f"reltol {tol:g}", partial(_spice, reltol=tol))
            for tol in (1e-3, 1e-5, 1e-6)
        ]
    return found


def _fixed(problem: Problem, cap: float, order: int, dt: float) -> general.Answer:
    return general.fixed_step(problem, order, dt, cap)


def _scipy(problem: Problem, cap: float, method: str, tol: float) -> general.Answer:
    return general.scipy_solver(problem, method, tol, cap)


def _cvode(problem: Problem, cap: float, method: str, tol: float) -> general.Answer:
    return general.cvode(problem, method, tol, cap)


def _spice(problem: Problem, cap: float, reltol: float) -> general.Answer:
    return spice.ngspice(problem, reltol, cap)


def _has_cvode() -> bool:
    try:
        import sksundae.cvode  # noqa: F401
    except ImportError:
        return False
    return True


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
    began = spent()

    def row(verdict: str, note: str = "") -> Row:
        took = spent() - began
        return Row(
            problem.name, method.name, method.setting, verdict, None, None, None,
            took, note,
        )  # fmt: skip

    try:
        spikes, V_C1 = method.solve(problem, cap)
    except OutOfTimeError as error:
        return row("timed out", str(error))
    except (TactileLabError, ArithmeticError, ValueError, RuntimeError) as error:
        verdict = "NaN" if "NaN" in str(error) else "failed"
        return row(verdict, " ".join(str(error).split())[:120])
    took = spent() - began
    right = spikes.size == exact.spike_times.size
    gap = np.abs(spikes - exact.spike_times).max(initial=0.0) if right else None
    return Row(
        problem.name, method.name, method.setting,
        "right" if right else "wrong count", int(spikes.size),
        None if gap is None else float(gap), abs(V_C1 - exact.V_C1), took,
    )  # fmt: skip


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
            general.fixed_step(problem, 1, 1e-2, cap)
        rows: dict[int, Row] = {}
        for turn in range(max(m.repeats for m in entrants)):
            for k, method in enumerate(entrants):
                if turn >= method.repeats:
                    continue
                if k in rows and rows[k].verdict in ("timed out", "failed", "NaN"):
                    continue
                if k in rows and rows[k].run_time > 2.0:
                    continue
                new = judge(problem, method, exact, cap)
                if turn == 0:
                    say(f"{problem.name}: {method.name} {method.setting} {new.verdict}")
                if k not in rows or new.run_time < rows[k].run_time:
                    rows[k] = new
        yield from (rows[k] for k in sorted(rows))
