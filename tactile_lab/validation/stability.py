"""Extreme cases: ours right on every one, and what the others do."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from tactile_lab.errors import ParameterError, TactileLabError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import Result, simulate
from tactile_lab.model.solver import MOST_COUPLED, MOST_SPIKES
from tactile_lab.quantity import show
from tactile_lab.validation.contest import (
    CAPPED,
    TIMED_OUT,
    Method,
    Row,
    Truth,
    judge,
    methods,
    truth,
)
from tactile_lab.validation.extremes import Extreme, extremes, formula
from tactile_lab.validation.problem import Problem, spent
from tactile_lab.validation.table import markdown, provenance
from tactile_lab.waveform import Waveform

RIVALS = {
    name: "tol 1e-09"
    for name in (
        "Dormand-Prince 5(4)", "Rodas5P", "RK45", "DOP853", "LSODA", "Radau", "BDF",
        "CVODE BDF",
    )
} | {"Euler": "dt 1e-05"}  # fmt: skip
"""Other solvers, and the setting they take part with."""

MOST_SEGMENTS = 10_000
"""More are not given to the others, which restart at each, nor to the stiffness."""


def report(
    names: Sequence[str], cap: float, rivals: bool, say: Callable[[str], None]
) -> tuple[str, int]:
    """stability.md, and on how many cases ours was not right.

    Args:
        names: parts of the names of the cases wanted; all where there are none.
        cap: most CPU time for each of the others, s.
        rivals: let the others take part.
        say: told of each case.
    """
    for circuit in (Circuit(), Circuit(saturation=True)):
        # compilation is no part of any time in the table
        simulate(circuit, Waveform.constant(0.1), until=0.1)
    known = {(m.name, m.setting): m for m in methods(1, spice_too=False)}
    others = [known.get(rival) for rival in RIVALS.items()] if rivals else []
    begun = Problem("begun", Circuit(), Waveform.constant(0.1), 0.1)
    for method in others:
        if method is not None:
            method.solve(begun, cap=1.0)
    lines, bad = [], 0
    for build in extremes():
        case = build()
        name = case.problem.name
        if names and not any(text in name for text in names):
            continue
        verdict, line = _line(case, others, cap)
        bad += verdict.startswith("**")
        lines.append(line)
        say(f"{name}: {verdict}")
    if not lines:
        raise ParameterError(f"There is no case with {' or '.join(names)} in its name.")
    heads = ["case", "stiffness ratio", "truth", "ours", "error (s)", "time"]
    return "\n".join(
        [
            "# Stability on extreme cases\n",
            f"{provenance()} Written by `tactile-lab validate stability --cap {cap:g} "
            "--out docs`.\n",
            "Ours at the default tolerance 1e-9 s, the others at 1e-9 with events, "
            "Dormand-Prince, Rodas5P and Euler compiled whole, the rest called from "
            "Python "
            f"(Euler: 10 µs steps), each stopped after {cap:g} s{CAPPED}; times are "
            "CPU time. Error: largest error "
            'of a spike time. Truth: "reference" is 40-digit arithmetic, "formula" '
            'Eq. (15) at constant current, "refuse" a case that has no answer and must '
            'be refused with a clear error, "limit" a case that has one, but with more '
            f"spikes than the {MOST_SPIKES:.0e} that a simulation counts, or the "
            f"{MOST_COUPLED:.0e} of a slice where T1 saturates: refused, an answer is "
            'owed, "finite" a case too long for the '
            "reference, where ours is compared with itself at tolerance 1e-12.\n",
            markdown([*heads, *(RIVALS if rivals else ())], lines),
            "",
        ]
    ), bad


def _line(
    case: Extreme, others: Sequence[Method | None], cap: float
) -> tuple[str, list[str]]:
    problem = case.problem
    few = problem.force.time.size <= MOST_SEGMENTS
    exact = truth(problem) if case.truth == "reference" else None
    verdict, error, took = _ours(case, exact)
    cells = [
        problem.name, f"{problem.stiffness:.0e}" if few else "", case.truth, verdict,
        error, took,
    ]  # fmt: skip
    for method in others:
        if method is None or case.truth in ("refuse", "limit"):
            cells.append("")
        elif not few:
            cells.append("not run")
        else:
            exact = exact or _own_truth(case)
            cells.append(_rival(judge(problem, method, exact, cap)))
    return verdict, cells


def _solve(case: Extreme, tolerance: float = 1e-9) -> Result:
    p = case.problem
    keep = ("statistics",) if case.statistics else ("spikes", "statistics")
    return simulate(
        p.circuit, p.force, until=p.until, start=p.start, keep=keep, tolerance=tolerance
    )


def _ours(case: Extreme, exact: Truth | None) -> tuple[str, str, str]:
    """Verdict, error and time of ours; a verdict in bold is a defeat."""
    began = spent()
    try:
        found = _solve(case)
    except TactileLabError as error:
        took = show(spent() - began, "s", 3)
        verdict = {"refuse": "refused", "limit": "refused at its limit"}.get(
            case.truth, f"**refused: {error}**"
        )
        return verdict, "", took
    took = show(spent() - began, "s", 3)
    if not np.all(np.isfinite([found.end.V_P, found.end.V_C1, found.end.V_C2])):
        return "**NaN**", "", took
    if case.truth in ("refuse", "limit"):
        return "**answered**", "", took
    statistics = found.solution.statistics
    assert statistics is not None
    estimate, last = found.error.spike_time or 0.0, statistics.last or 0.0
    if case.truth == "formula":
        count, true_last = formula(case.problem)
        gap, allowed = abs(last - true_last), estimate
    elif exact is None:
        other = _solve(case, 1e-12).solution.statistics
        assert other is not None
        count, gap = other.count, abs((other.last or 0.0) - last)
        allowed = 1e-9 + estimate
    else:
        count, gap, allowed = exact.spike_times.size, 0.0, max(estimate, 1e-9)
        if statistics.count == count and count and found.spike_times is not None:
            gap = float(np.max(np.abs(found.spike_times - exact.spike_times)))
    shown = f"{gap:.1e}" if count else ""
    if statistics.count == count and gap <= allowed:
        return f"right, {count} spikes", shown, took
    return f"**wrong: {statistics.count} for {count}**", shown, took


def _rival(row: Row) -> str:
    took = show(row.run_time, "s", 2)
    if row.verdict == "right":
        error = "" if not row.spikes else f" {row.spike_error:.0e}"
        return f"right{error}, {took}"
    if row.verdict == "wrong count":
        return f"wrong: {row.spikes}, {took}"
    return row.verdict if row.verdict == TIMED_OUT else f"{row.verdict}, {took}"


def _own_truth(case: Extreme) -> Truth:
    """What the others are judged by where there is no table of true spike times."""
    p = case.problem
    if case.truth == "formula":  # too many to list: only the count can be judged
        return Truth(np.zeros(formula(p)[0]), 0.0)
    found = simulate(p.circuit, p.force, until=p.until, tolerance=1e-12)
    return Truth(found.solution.spike_times, found.end.V_C1)
