"""Rows as Markdown, CSV and a work-precision figure."""

from __future__ import annotations

import csv
import os
import platform
import subprocess
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import Any

from tactile_lab.quantity import show
from tactile_lab.validation.contest import OURS, Row

COLUMNS = (
    "scene", "method", "setting", "verdict", "spikes", "spike_error_s",
    "V_C1_error_V", "run_time_s", "note",
)  # fmt: skip


def write_csv(rows: Sequence[Row], path: Path) -> None:
    """All rows with full digits."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for row in rows:
            writer.writerow(
                "" if value is None else value for value in vars(row).values()
            )


def provenance() -> str:
    """Commit, date and machine, for the head of a report."""
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True,
        check=False, cwd=Path(__file__).parent,
    ).stdout.strip()  # fmt: skip
    return (
        f"Commit {commit or 'unknown'}, {date.today().isoformat()}, "
        f"{platform.machine()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}, one thread."
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
    lines = [
        "| method | setting | verdict | spike error (s) | V_C1 error (V) | time |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        name = f"**{row.method}**" if row.method == OURS else row.method
        lines.append(f"| {name} | {row.setting} | " + " | ".join(cell(row)) + " |")
    return "\n".join(lines)


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
