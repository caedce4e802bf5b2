"""Time and error of every compiled method while one thing about a scene grows.

Stiffness (the force of a jump), the distance by which a spike only just happens, and
the number of spikes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tactile_lab.model.circuit import Circuit
from tactile_lab.validation.contest import (
    CAPPED,
    COMPILED,
    EXACT,
    OURS,
    Method,
    Row,
    Truth,
    judge,
    methods,
    ours,
)
from tactile_lab.validation.extremes import formula, grazing
from tactile_lab.validation.problem import Problem
from tactile_lab.validation.table import markdown, provenance, save
from tactile_lab.waveform import Waveform
from tactile_lab.whole_file import write_rows, write_text

SETTINGS = {
    OURS: "tol 1e-09", "Dormand-Prince 5(4)": "tol 1e-09", "Rodas5P": "tol 1e-09",
    "Euler": "dt 1e-05", "RK4": "dt 1e-05", "Euler, interpolated": "dt 1e-05",
    "RK4, interpolated": "dt 1e-05", EXACT: "dt 1e-05",
}  # fmt: skip
AXES = {
    "stiffness": "force of the jump (N)",
    "grazing": "height of V_C2 over V_fire, relative",
    "spikes": "number of spikes",
}


@dataclass(frozen=True)
class Point:
    """One method at one place of a sweep."""

    sweep: str
    at: float
    row: Row


def problems() -> Iterator[tuple[str, float, Problem, Truth]]:
    """Sweep, place, scene and truth.

    Truth is ours at 1e-13 s, which the 40-digit reference judges elsewhere (stability),
    and for the number of spikes Eq. (15) at constant current: count and last spike.
    """
    for F in (0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.6, 1.0, 2.0, 5.0, 10.0):
        jump = Waveform.through([(0, 0), (0.1, 0), (0.1, F)])
        problem = Problem(f"{F:g} N", Circuit(), jump, 0.6)
        yield "stiffness", F, problem, _own(problem)
    for n in range(2, 13):
        problem = grazing(10.0**-n).problem
        yield "grazing", 10.0**-n, problem, _own(problem)
    for n in range(1, 6):
        firing = Problem("", Circuit(V_GS=1.6), Waveform.constant(0.0), 10.0**n / 11.4)
        count, last = formula(firing)
        yield "spikes", count, firing, Truth(np.array([last]), 0.0)


def _own(problem: Problem) -> Truth:
    found = ours(problem, np.inf, 1e-13)
    return Truth(found.spike_times, found.V_C1)


def sweep(cap: float, repeats: int, say: Callable[[str], None]) -> list[Point]:
    """Every compiled method along every sweep, each stopped after `cap` s."""
    entrants = [
        m
        for m in methods(1, spice_too=False)
        if m.runs == COMPILED and SETTINGS.get(m.name) == m.setting
    ]
    kind, at, problem, truth = next(problems())
    for method in entrants:  # compiled, or read from the disk, before a clock runs
        _judged(kind, at, problem, method, truth, cap)
    found = []
    for kind, at, problem, truth in problems():
        say(f"{kind} {at:g}")
        for method in entrants:
            rows: list[Row] = []
            while len(rows) < repeats and all(row.run_time <= 0.1 for row in rows):
                rows.append(_judged(kind, at, problem, method, truth, cap))
            found.append(Point(kind, at, min(rows, key=lambda row: row.run_time)))
    return found


def _judged(
    kind: str, at: float, problem: Problem, method: Method, truth: Truth, cap: float
) -> Row:
    if kind != "spikes":
        return judge(problem, method, truth, cap)

    def last_only(given: Problem, cap: float) -> Any:
        answer = method.answer(method.solve(given, cap=cap))
        if answer.spike_times.size != at:
            return answer._replace(spike_times=np.zeros(2))
        return answer._replace(spike_times=answer.spike_times[-1:])

    counted = Method(method.name, method.setting, last_only, 1, method.runs)
    return judge(problem, counted, truth, cap)


def write(points: Sequence[Point], cap: float, out: Path) -> None:
    """sweeps.md, sweeps.csv and sweeps.svg."""
    heads = "sweep at method setting verdict error_s evaluations time_s".split()
    rows = (
        (
            p.sweep, f"{p.at:g}", p.row.method, p.row.setting, p.row.verdict,
            "" if p.row.spike_error is None else f"{p.row.spike_error:.3g}",
            p.row.evaluations, f"{p.row.run_time:.4g}",
        )
        for p in points
    )  # fmt: skip
    write_rows(out / "sweeps.csv", heads, rows)
    parts = [
        "# Three sweeps\n",
        f"{provenance()} Written by `tactile-lab validate sweeps --cap {cap:g} --out "
        "docs`.\n",
        "Every compiled method at one setting (tolerance 1e-9; fixed steps of 10 µs) "
        f"along three axes, each stopped after {cap:g} s{CAPPED}. CPU time of "
        "one call, the least of several. Truth is our own answer at 1e-13 s for "
        "stiffness and grazing, Eq. (15) at constant current for the number of "
        "spikes. A wrong count, NaN or time-out is a cross at the top of the error "
        "panel. The table says in which share of its places a method was right.\n",
        "![sweeps](sweeps.svg)\n",
        markdown(("method", "setting", *AXES), list(_shares(points))),
    ]
    write_text(out / "sweeps.md", "\n".join(parts) + "\n")
    _figure(points, out / "sweeps.svg")


def _shares(points: Sequence[Point]) -> Iterator[list[str]]:
    for name, setting in SETTINGS.items():
        cells = []
        for kind in AXES:
            some = [p for p in points if p.sweep == kind and p.row.method == name]
            right = sum(p.row.verdict == "right" for p in some)
            cells.append(f"{right} of {len(some)}")
        yield [name, setting, *cells]


def _figure(points: Sequence[Point], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    plot, axes = plt.subplots(
        2, 3, figsize=(11.5, 6.4), sharex="col", sharey="row", layout="constrained"
    )
    colours = plt.get_cmap("tab10")
    for column, (kind, label) in enumerate(AXES.items()):
        for k, name in enumerate(SETTINGS):
            some = [p for p in points if p.sweep == kind and p.row.method == name]
            right = [p for p in some if p.row.spike_error is not None]
            wrong = [p for p in some if p.row.spike_error is None]
            style = {
                "color": "black" if name == OURS else colours(k),
                "linewidth": 2.0 if name == OURS else 1.0,
                "marker": "os^vD<>p"[k], "markersize": 4,
            }  # fmt: skip
            axes[0, column].plot(
                [p.at for p in right], [p.row.run_time for p in right], label=name,
                **style,
            )  # fmt: skip
            axes[1, column].plot(
                [p.at for p in right],
                [max(p.row.spike_error or 0.0, 1e-17) for p in right], **style,
            )  # fmt: skip
            style |= {"marker": "x", "linestyle": "none"}
            high = 1.0 * 2.0**-k
            axes[1, column].plot([p.at for p in wrong], [high] * len(wrong), **style)
        axes[1, column].set_xlabel(label)
        for axis in axes[:, column]:
            axis.set(xscale="log", yscale="log")
            axis.grid(visible=True, color="0.92")
    axes[0, 1].invert_xaxis()
    axes[0, 0].set_ylabel("CPU time of one call (s)\nwhere it is right")
    axes[1, 0].set_ylabel("largest error of a spike time (s)\nx: wrong, NaN, no answer")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    plot.legend(
        handles, labels, loc="outside lower center", ncols=4, frameon=False, fontsize=9
    )
    save(plot, path)
