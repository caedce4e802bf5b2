"""Error against run time: our solver and others on nine scenes, easy to stiff."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from tactile_lab.errors import ParameterError
from tactile_lab.model.circuit import Circuit
from tactile_lab.quantity import show
from tactile_lab.validation.contest import (
    CALLED,
    CAPPED,
    COMPILED,
    OURS,
    SPAN,
    TIMED_OUT,
    Row,
    contest,
    methods,
)
from tactile_lab.validation.problem import Problem
from tactile_lab.validation.table import markdown, provenance, save
from tactile_lab.waveform import Waveform
from tactile_lab.whole_file import write_rows

COLUMNS = (
    "scene", "method", "setting", "runs", "verdict", "spikes", "spike_error_s",
    "V_C1_error_V", "estimate_s", "evaluations", "run_time_s", "note",
)  # fmt: skip
ERRORS = (1e-9, 1e-6)
"""True errors of spike times at which methods are compared, s."""


JUMPS = (
    (0.27, "V_C1 starts to collapse"),
    (0.3, "V_C1 collapses"),
    (0.4, "rate of V_C1 8e4 /s"),
    (1.0, "rate of V_C1 7e7 /s"),
)
"""Forces reached at once, N, and what is hard about them."""


def _four_pulses() -> Waveform:
    points = [(0.0, 0.0)]
    for k, level in enumerate((0.08, 0.12, 0.16, 0.2)):
        t = 4.5 * k
        points += [(t + 0.25, level), (t + 2.25, level), (t + 2.5, 0.0), (t + 4.5, 0.0)]
    return Waveform.through(points)


def accuracy_scenes() -> tuple[Problem, ...]:
    """Seven scenes from easy to stiff, one with a reset time, one with saturation."""
    table = Circuit()
    return (
        Problem(
            "pulses", table, _four_pulses(), 18.0,
            note="the demo: 80, 120, 160, 200 mN, 0.25 s ramps",
        ),
        Problem(
            "hold150", table,
            Waveform.through(
                [(0, 0), (1, 0), (1.01, 0.15), (11, 0.15), (11.01, 0), (13, 0)]
            ),
            13.0, note="150 mN for 10 s, 10 ms ramps",
        ),
        Problem(
            "fig5b", Circuit(V_GS=1.54141),
            Waveform.through([(0, 0), (5, 0), (5.01, 0.05), (105, 0.05)]),
            105.0, note="50 mN for 100 s, close to threshold",
        ),
        *(
            Problem(
                f"jump{1000 * force:g}", table,
                Waveform.through([(0, 0), (0.5, 0), (0.5, force)]), 2.5,
                note=f"a jump to {show(force, 'N')}, {what}",
            )
            for force, what in JUMPS
        ),
        Problem(
            "put", Circuit(firing="put"),
            Waveform.through([(0, 0), (0.5, 0), (0.51, 0.2)]), 2.5,
            note="200 mN, every reset takes 8 µs",
        ),
        Problem(
            "saturated", Circuit(saturation=True),
            Waveform.through([(0, 0), (0.05, 0), (0.05, 0.2)]), 0.3,
            note="a jump to 200 mN, T1 saturates: V_C2 acts back on V_C1",
        ),
    )  # fmt: skip


def compete(
    names: Sequence[str],
    repeats: int,
    cap: float,
    say: Callable[[str], None],
    *,
    called: bool = True,
) -> tuple[list[Problem], list[Row]]:
    """Every method on the scenes of those names, on all where none is named.

    Without `called`, those called from Python stay out.

    Raises:
        ParameterError: there is no such scene.
    """
    scenes = accuracy_scenes()
    unknown = set(names) - {s.name for s in scenes}
    if unknown:
        raise ParameterError(
            f"There is no scene {min(unknown)!r}; choose from "
            f"{', '.join(s.name for s in scenes)}."
        )
    chosen = [s for s in scenes if not names or s.name in names]
    return chosen, list(contest(chosen, methods(repeats, called=called), cap, say))


def report(scenes: Sequence[Problem], rows: Sequence[Row], cap: float) -> str:
    """accuracy.md."""
    by_scene = {s.name: [row for row in rows if row.scene == s.name] for s in scenes}
    called = any(row.runs == CALLED for row in rows)
    parts = [
        "# Error against run time\n",
        f"{provenance()} Written by `tactile-lab validate accuracy"
        f"{'' if called else ' --compiled'} --out docs`.\n",
        "Errors are the largest true error of any spike time and that of V_C1 at the "
        "end, against a 40-digit reference. Times are CPU time of a call from a "
        f"script: the mean of {1e3 * SPAN:g} ms of calls in a row, the least of "
        "several, interleaved in one process (ngspice in its own), so that other work "
        "on the machine, which the load average tells of, lengthens all of them alike: "
        "trust ratios more than times. The cap is "
        f"{cap:g} s{CAPPED}. A wrong count, NaN, failure or time-out is shown as "
        "such.\n",
        '"Compiled" methods are machine code from end to end, as ours is: Dormand and '
        "Prince's 5(4) and the Rosenbrock method Rodas5P, both with spikes located on "
        "their dense output, Euler and RK4 with spikes on the grid and interpolated, "
        "and exact integrate-and-fire as simulators with precise spike times have it. "
        'Those "called from Python" spend about 99 % of their time in calls of the '
        "right-hand side, itself compiled: their times say what a script pays, not "
        "what the method costs.\n",
        "![work-precision diagram](accuracy.svg)\n",
        "## Against the fastest compiled method\n",
        "Of every method the setting that takes the least time among those whose true "
        "error reaches the bound, chosen alike for ours and the others. Asked for are "
        "ratios of 10 at 1e-9 s and 3 at 1e-6 s on every scene, and 20 in the median "
        f"of the first {FIRST} at 1e-9 s "
        "([where our time goes](decisions/what-bounds-the-solver.md)).\n",
    ]
    for error in ERRORS:
        lines = [_summary(scene, by_scene[scene.name], error) for scene in scenes]
        ratios = [float(line[-3]) for line in lines if line[-3]]
        middle = f"{statistics.median(ratios):.1f}" if ratios else "unknown"
        if len(ratios) > FIRST:
            first = statistics.median(ratios[:FIRST])
            middle += f", of the first {FIRST} {first:.1f}"
        parts += [
            f"### True error at most {error:g} s\n",
            markdown(SUMMARY, lines),
            f"\nMedian of the ratios to the fastest compiled method: {middle}; least "
            f"{min(ratios, default=math.nan):.1f}.\n",
        ]
    parts += [
        "## Measured order\n",
        "Slope of log(true error) against log(evaluations of the right-hand side), by "
        "least squares over errors between 1e-3 s and 1e-12 s where the evaluations "
        f"grow by {100 * (GROWN - 1):.0f} % or more from one setting to the next: "
        "where stability, spikes or the corners of the force set the steps there is no "
        "order. Dormand-Prince and Rodas5P are of order 5 with dense output of order "
        "4, exact integrate-and-fire of order 2; with spikes on the grid every method "
        "is of order 1.\n",
        markdown(("method", *by_scene), _orders(by_scene)),
    ]
    for scene in scenes:
        parts += [f"\n## {scene.name}: {scene.note}\n", table(by_scene[scene.name])]
    return "\n".join(parts) + "\n"


FIRST = 7
"""Scenes of which the median is asked for."""
SUMMARY = (
    "scene", "stiffness ratio", "ours", "setting", "evaluations",
    "compiled, fastest", "its time", "its evaluations", "ratio",
    "called from Python, fastest", "its time",
)  # fmt: skip


def _summary(scene: Problem, rows: Sequence[Row], error: float) -> tuple[str, ...]:
    best = fastest(rows, ours=True, error=error)
    rival = fastest(rows, ours=False, error=error, runs=COMPILED)
    called = fastest(rows, ours=False, error=error, runs=CALLED)

    def told(row: Row | None) -> tuple[str, str, str]:
        if row is None:
            return "none", "", ""
        evaluations = "" if row.evaluations is None else str(row.evaluations)
        return f"{row.method} {row.setting}", show(row.run_time, "s", 3), evaluations

    own = told(best)
    ratio = ""
    if best is not None and rival is not None:
        ratio = f"{rival.run_time / best.run_time:.1f}"
    return (
        scene.name, f"{scene.stiffness:.1e}", own[1], best.setting if best else "none",
        own[2], *told(rival), ratio, *told(called)[:2],
    )  # fmt: skip


GROWN = 1.25
"""Evaluations rise so from one setting to the next where accuracy sets the steps."""


def order(rows: Sequence[Row]) -> float | None:
    """Measured order of one method on one scene; None below three settings.

    Where stability, spikes or the corners of the force set the steps, evaluations stay
    the same while the error falls: there is no order.
    """
    told: dict[float, float] = {}
    for pair in pairwise(rows):
        fewer, more = (row.evaluations or math.nan for row in pair)
        if more >= GROWN * fewer:
            told |= {
                math.log(row.evaluations or math.nan): math.log(row.spike_error)
                for row in pair
                if row.spike_error and 1e-12 < row.spike_error < 1e-3
            }
    points = list(told.items())
    if len(points) < 3:
        return None
    return -statistics.linear_regression(*zip(*points, strict=True)).slope


def _orders(by_scene: Mapping[str, Sequence[Row]]) -> list[list[str]]:
    every = [row for rows in by_scene.values() for row in rows if row.method != OURS]
    lines = []
    for name in dict.fromkeys(row.method for row in every if row.runs == COMPILED):
        found = [
            order([row for row in rows if row.method == name])
            for rows in by_scene.values()
        ]
        lines.append([name, *("" if p is None else f"{p:.1f}" for p in found)])
    return lines


def write_csv(rows: Sequence[Row], path: Path) -> None:
    """All rows with full digits."""
    write_rows(path, COLUMNS, (vars(row).values() for row in rows))


def cell(row: Row) -> tuple[str, ...]:
    """Verdict, errors, evaluations and run time for a person."""
    verdict = row.verdict
    if verdict == "wrong count":
        verdict = f"**wrong: {row.spikes} spikes**"
    elif verdict != "right":
        verdict = f"**{verdict}**"
    return (
        verdict,
        "" if row.spike_error is None else f"{row.spike_error:.1e}",
        "" if row.V_C1_error is None else f"{row.V_C1_error:.1e}",
        "" if row.evaluations is None else str(row.evaluations),
        "" if row.verdict == TIMED_OUT else show(row.run_time, "s", 3),
    )


def table(rows: Sequence[Row]) -> str:
    """One scene's rows as a Markdown table."""
    heads = (
        "method", "setting", "runs", "verdict", "spike error (s)", "V_C1 error (V)",
        "evaluations", "time",
    )  # fmt: skip
    names = [f"**{row.method}**" if row.method == OURS else row.method for row in rows]
    return markdown(
        heads,
        [
            (name, row.setting, row.runs, *cell(row))
            for name, row in zip(names, rows, strict=True)
        ],
    )


def fastest(
    rows: Sequence[Row], *, ours: bool, error: float = 1e-9, runs: str = ""
) -> Row | None:
    """The fastest row, ours or another's, with a true spike error of `error` s at most.

    The setting is free on both sides: what counts is the error that was reached.
    """
    able = [
        row
        for row in rows
        if (row.method == OURS) == ours
        and row.verdict == "right"
        and row.spike_error is not None
        and row.spike_error <= error
        and runs in ("", row.runs)
    ]
    return min(able, key=lambda row: row.run_time, default=None)


def figure(rows: Sequence[Row], path: Path) -> None:
    """Log-log work-precision diagram, one panel per scene.

    Methods that failed are told by a cross at the foot of the panel, at the time they
    took; those stopped at the cap took no time of their own, and are in the table.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    scenes = list(dict.fromkeys(row.scene for row in rows))
    names = list(dict.fromkeys(row.method for row in rows))
    columns = min(3, len(scenes))
    lines = -(-len(scenes) // columns)
    plot, axes = plt.subplots(
        lines, columns, figsize=(4.2 * columns, 3.4 * lines + 1.0), squeeze=False,
        sharex=True, sharey=True, layout="constrained",
    )  # fmt: skip
    markers = "os^vD<>ph*XP"
    colours = plt.get_cmap("tab10")
    handles: dict[str, Any] = {}
    for axis, scene in zip(axes.flat, scenes, strict=False):
        for k, name in enumerate(names):
            some = [r for r in rows if r.scene == scene and r.method == name]
            if not some:
                continue
            points = [  # joined from setting to setting
                (row.run_time, max(row.spike_error, 1e-17))
                for row in some
                if row.spike_error is not None
            ]
            compiled = some[0].runs == COMPILED
            style = {
                "color": "black" if name == OURS else colours(k % 10),
                "marker": markers[k % len(markers)],
                "linestyle": "-" if compiled else ":",
                "linewidth": 2.0 if name == OURS else 1.0,
                "markersize": 6 if name == OURS else 4,
                "markerfacecolor": None if compiled else "white",
                "zorder": 3 if name == OURS else 2,
            }
            if points:
                label = name if compiled else f"{name} ({some[0].runs})"
                (handles[label],) = axis.plot(*zip(*points, strict=True), **style)
            failed = [
                row.run_time
                for row in some
                if row.spike_error is None and row.verdict != TIMED_OUT
            ]
            style |= {"marker": "x", "linestyle": "none", "markersize": 4}
            axis.plot(failed, [1e-17] * len(failed), **style)
        axis.set(xscale="log", yscale="log", title=scene, ylim=(3e-18, 1))
        for error in ERRORS:
            axis.axhline(error, color="0.6", linewidth=0.8, linestyle=":")
        axis.text(
            0.99, 1e-9, "1e-9 s", transform=axis.get_yaxis_transform(), fontsize=8,
            ha="right", va="bottom", color="0.4",
        )  # fmt: skip
        axis.text(
            0.01, 2e-17, "x: wrong count, NaN or failed", fontsize=7,
            transform=axis.get_yaxis_transform(), color="0.4",
        )  # fmt: skip
        axis.grid(visible=True, color="0.92")
        axis.tick_params(labelbottom=True, labelleft=True)
    for axis in axes.flat[len(scenes) :]:
        axis.set_visible(False)
    for axis in axes[-1]:
        axis.set_xlabel("CPU time of one call (s)")
    for axis in axes[:, 0]:
        axis.set_ylabel("error of a spike time (s)")
    plot.legend(
        list(handles.values()), list(handles), loc="outside lower center", ncols=4,
        frameon=False, fontsize=9,
    )  # fmt: skip
    save(plot, path)
