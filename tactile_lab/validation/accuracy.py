"""Error against run time: our solver and others on seven scenes, easy to stiff."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from tactile_lab.errors import ParameterError
from tactile_lab.model.circuit import Circuit
from tactile_lab.quantity import show
from tactile_lab.validation.contest import OURS, Row, contest, methods
from tactile_lab.validation.problem import Problem
from tactile_lab.validation.table import markdown, provenance
from tactile_lab.waveform import Waveform

COLUMNS = (
    "scene", "method", "setting", "verdict", "spikes", "spike_error_s",
    "V_C1_error_V", "run_time_s", "note",
)  # fmt: skip


def _four_pulses() -> Waveform:
    points = [(0.0, 0.0)]
    for k, level in enumerate((0.08, 0.12, 0.16, 0.2)):
        t = 4.5 * k
        points += [
            (t + 0.25, level), (t + 2.25, level), (t + 2.5, 0.0), (t + 4.5, 0.0)
        ]  # fmt: skip
    return Waveform.through(points)


def accuracy_scenes() -> tuple[Problem, ...]:
    """Seven scenes, from easy to stiff."""
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
        Problem(
            "jump270", table, Waveform.through([(0, 0), (0.5, 0), (0.5, 0.27)]), 2.5,
            note="a jump to 270 mN, V_C1 starts to collapse",
        ),
        Problem(
            "jump300", table, Waveform.through([(0, 0), (0.5, 0), (0.5, 0.3)]), 2.5,
            note="a jump to 300 mN, V_C1 collapses",
        ),
        Problem(
            "jump400", table, Waveform.through([(0, 0), (0.5, 0), (0.5, 0.4)]), 2.5,
            note="a jump to 400 mN, rate of V_C1 8e4 /s",
        ),
        Problem(
            "jump1000", table, Waveform.through([(0, 0), (0.5, 0), (0.5, 1.0)]), 2.5,
            note="a jump to 1 N, rate of V_C1 7e7 /s",
        ),
    )  # fmt: skip


def compete(
    names: Sequence[str], repeats: int, cap: float, say: Callable[[str], None]
) -> tuple[list[Problem], list[Row]]:
    """Every method on the scenes of those names, on all where none is named.

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
    return chosen, list(contest(chosen, methods(repeats), cap, say))


def report(scenes: Sequence[Problem], rows: Sequence[Row], cap: float) -> str:
    """accuracy.md."""
    heads = (
        "scene", "what", "stiffness ratio", "ours, default", "error (s)",
        "ours, fastest", "other, fastest", "its time", "ratio", "at default",
    )  # fmt: skip
    by_scene = {s.name: [row for row in rows if row.scene == s.name] for s in scenes}
    parts = [
        "# Error against run time\n",
        f"{provenance()} Written by `tactile-lab validate accuracy --out docs`.\n",
        "Errors are the largest true error of any spike time and that of V_C1 at the "
        "end, against a 40-digit reference. Times are CPU time, the least of several, "
        f"interleaved in one process (ngspice in its own); the cap is {cap:g} s. The "
        "right-hand side is compiled for every solver. A wrong count, NaN, failure or "
        "time-out is shown as such.\n",
        "![work-precision diagram](accuracy.svg)\n",
        '"Fastest": the setting that takes the least time among those whose true '
        'error is 1e-9 s or better, chosen alike for ours and the others; "ratio" '
        "compares these two. The last column compares ours at its default tolerance.\n",
        markdown(heads, [_summary(scene, by_scene[scene.name]) for scene in scenes]),
    ]
    for scene in scenes:
        parts += [f"\n## {scene.name}: {scene.note}\n", table(by_scene[scene.name])]
    return "\n".join(parts) + "\n"


def _summary(scene: Problem, rows: Sequence[Row]) -> tuple[str, ...]:
    mine = own(rows)
    best, rival = fastest(rows, ours=True), fastest(rows, ours=False)
    other: tuple[str, ...] = ("none", "", "", "")
    if rival is not None and best is not None:
        other = (
            f"{rival.method} {rival.setting}",
            show(rival.run_time, "s", 3),
            f"{rival.run_time / best.run_time:.0f}",
            f"{rival.run_time / mine.run_time:.0f}",
        )
    return (
        scene.name,
        scene.note,
        f"{scene.stiffness:.1e}",
        show(mine.run_time, "s", 3),
        "" if mine.spike_error is None else f"{mine.spike_error:.1e}",
        "none" if best is None else show(best.run_time, "s", 3),
        *other,
    )


def write_csv(rows: Sequence[Row], path: Path) -> None:
    """All rows with full digits."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for row in rows:
            writer.writerow(
                "" if value is None else value for value in vars(row).values()
            )


def cell(row: Row) -> tuple[str, str, str, str]:
    """Verdict, spike error, V_C1 error and run time for a person."""
    verdict = row.verdict
    if verdict == "wrong count":
        verdict = f"**wrong: {row.spikes} spikes**"
    elif verdict != "right":
        verdict = f"**{verdict}**"
    return (
        verdict,
        "" if row.spike_error is None else f"{row.spike_error:.1e}",
        "" if row.V_C1_error is None else f"{row.V_C1_error:.1e}",
        show(row.run_time, "s", 3),
    )


def table(rows: Sequence[Row]) -> str:
    """One scene's rows as a Markdown table."""
    heads = "method", "setting", "verdict", "spike error (s)", "V_C1 error (V)", "time"
    names = [f"**{row.method}**" if row.method == OURS else row.method for row in rows]
    return markdown(
        heads,
        [
            (name, row.setting, *cell(row))
            for name, row in zip(names, rows, strict=True)
        ],
    )


def fastest(rows: Sequence[Row], *, ours: bool, error: float = 1e-9) -> Row | None:
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
    ]
    return min(able, key=lambda row: row.run_time, default=None)


def own(rows: Sequence[Row], setting: str = "tol 1e-09") -> Row:
    """Our row at the default tolerance."""
    return next(r for r in rows if r.method == OURS and r.setting == setting)


def figure(rows: Sequence[Row], path: Path) -> None:
    """Log-log work-precision diagram, one panel per scene."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    scenes = list(dict.fromkeys(row.scene for row in rows))
    names = list(dict.fromkeys(row.method for row in rows))
    columns = min(4, len(scenes))
    lines = -(-len(scenes) // columns)
    plot, axes = plt.subplots(
        lines, columns, figsize=(3.6 * columns, 3.5 * lines + 0.8), squeeze=False,
        sharex=True, sharey=True, layout="constrained",
    )  # fmt: skip
    markers = "os^vD<>ph*XP"
    colours = plt.get_cmap("tab10")
    for axis, scene in zip(axes.flat, scenes, strict=False):
        for k, name in enumerate(names):
            points = [
                (row.run_time, max(row.spike_error, 1e-17))
                for row in rows
                if row.scene == scene
                and row.method == name
                and row.spike_error is not None
            ]
            if points:
                ours = name == OURS
                axis.plot(
                    *zip(*sorted(points), strict=True),
                    marker=markers[k % len(markers)],
                    color="black" if ours else colours(k % 10),
                    linewidth=2.0 if ours else 0.8, markersize=6 if ours else 4.5,
                    label=name, zorder=3 if ours else 2,
                )  # fmt: skip
        axis.set(xscale="log", yscale="log", title=scene)
        axis.axhline(1e-9, color="0.6", linewidth=0.8, linestyle=":")
        axis.grid(visible=True, color="0.92")
    for axis in axes.flat[len(scenes) :]:
        axis.set_visible(False)
    for axis in axes[-1, :]:
        axis.set_xlabel("run time (s)")
    for axis in axes[:, 0]:
        axis.set_ylabel("largest error of a spike time (s)")
    handles: dict[str, Any] = {}
    for axis in axes.flat:
        for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    plot.legend(
        list(handles.values()), list(handles), loc="outside lower center", ncols=6,
        frameon=False, fontsize=9,
    )  # fmt: skip
    plot.savefig(path)
    plt.close(plot)
