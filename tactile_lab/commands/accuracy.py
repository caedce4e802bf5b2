"""``tactile-lab accuracy``: error against run time, ours and other solvers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactile_lab.commands.terminal import refusing

if TYPE_CHECKING:
    from tactile_lab.validation.campaign import Case
    from tactile_lab.validation.contest import Row
    from tactile_lab.validation.problem import Problem


@click.command()
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="Write accuracy.md, accuracy.csv and accuracy.svg there.",
)
@click.option("--scene", "names", multiple=True, metavar="NAME", help="Only this one.")
@click.option(
    "--cap", default=20.0, show_default=True, help="Most CPU time per run, s."
)
@click.option("--repeats", default=3, show_default=True, help="Timings; least counts.")
@click.option(
    "--campaign",
    default=0,
    metavar="N",
    help="Check the error estimate on N random scenes instead; writes honesty.md.",
)
def command(
    out: Path | None, names: tuple[str, ...], cap: float, repeats: int, campaign: int
) -> None:
    """Compare solvers on seven scenes from easy to stiff.

    Truth is a 40-digit reference. CVODE (scikit-sundae) and ngspice take part where
    they are installed.
    """
    with refusing():
        import os

        # before numpy starts its threads
        for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
            os.environ.setdefault(name, "1")
        if campaign:
            _write(_honesty(campaign), out, "honesty.md")
            return
        from tactile_lab.errors import ParameterError
        from tactile_lab.validation.contest import contest, methods
        from tactile_lab.validation.scenes import accuracy_scenes
        from tactile_lab.validation.tables import figure, write_csv

        scenes = accuracy_scenes()
        unknown = set(names) - {s.name for s in scenes}
        if unknown:
            raise ParameterError(
                f"There is no scene {min(unknown)!r}; choose from "
                f"{', '.join(s.name for s in scenes)}."
            )
        chosen = [s for s in scenes if not names or s.name in names]
        rows = list(contest(chosen, methods(repeats), cap, _say))
        text = _report(chosen, rows, cap)
        _write(text, out, "accuracy.md")
        if out is None:
            return
        write_csv(rows, out / "accuracy.csv")
        figure(rows, out / "accuracy.svg")
        click.echo(f"Wrote accuracy.csv and accuracy.svg to {out}.")


def _write(text: str, out: Path | None, name: str) -> None:
    if out is None:
        click.echo(text)
        return
    out.mkdir(parents=True, exist_ok=True)
    (out / name).write_text(text, encoding="utf-8")
    click.echo(f"Wrote {out / name}.")


def _say(text: str) -> None:
    click.echo(text, err=True)


def _report(scenes: Sequence[Problem], rows: Sequence[Row], cap: float) -> str:
    from tactile_lab.quantity import show
    from tactile_lab.validation.tables import fastest, own, provenance, table

    parts = [
        "# Error against run time\n",
        f"{provenance()} Written by `tactile-lab accuracy --out docs`.\n",
        "Errors are the largest true error of any spike time and that of V_C1 at the "
        "end, against a 40-digit reference. Times are CPU time, the least of several, "
        f"interleaved in one process (ngspice in its own); the cap is {cap:g} s. The "
        "right-hand side is compiled for every solver. A wrong count, NaN, failure or "
        "time-out is shown as such.\n",
        "![work-precision diagram](accuracy.svg)\n",
        '"Fastest": the setting that takes the least time among those whose true '
        'error is 1e-9 s or better, chosen alike for ours and the others; "ratio" '
        "compares these two. The last column compares ours at its default tolerance.\n",
        "| scene | what | stiffness ratio | ours, default | error (s) | ours, fastest "
        "| other, fastest | its time | ratio | at default |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for scene in scenes:
        here = [row for row in rows if row.scene == scene.name]
        mine = own(here)
        best, rival = fastest(here, ours=True), fastest(here, ours=False)
        error = "" if mine.spike_error is None else f"{mine.spike_error:.1e}"
        ours = "none" if best is None else show(best.run_time, "s", 3)
        other = "none | | |"
        if rival is not None and best is not None:
            other = (
                f"{rival.method} {rival.setting} | {show(rival.run_time, 's', 3)} | "
                f"{rival.run_time / best.run_time:.0f} | "
                f"{rival.run_time / mine.run_time:.0f}"
            )
        parts.append(
            f"| {scene.name} | {scene.note} | {scene.stiffness:.1e} | "
            f"{show(mine.run_time, 's', 3)} | {error} | {ours} | {other} |"
        )
    for scene in scenes:
        here = [row for row in rows if row.scene == scene.name]
        parts += [f"\n## {scene.name}: {scene.note}\n", table(here)]
    return "\n".join(parts) + "\n"


def _honesty(count: int) -> str:
    from tactile_lab.validation.campaign import random_case, saturated_case

    fewer = -(-count // 5)
    return "\n".join(
        [
            "# Is the error estimate honest?\n",
            f"Written by `tactile-lab accuracy --campaign {count} --out docs`. "
            "Random scenes and parameters (`tactile_lab/validation/campaign.py`), half "
            "at random tolerances, against the 40-digit reference.\n",
            "## The cascade, Eqs. (16) to (18)\n",
            *_section(random_case, count),
            "\n## T1 saturates\n",
            *_section(saturated_case, fewer),
            "",
        ]
    )


def _section(draw: Callable[[int], Case], count: int) -> list[str]:
    import numpy as np

    from tactile_lab.validation.campaign import compare
    from tactile_lab.validation.tables import provenance

    found = []
    for seed in range(count):
        found.append(compare(draw(seed)))
        if (seed + 1) % 50 == 0:
            _say(f"{seed + 1} of {count} random scenes")
    honest = sum(c.honest for c in found)
    spiking = [c for c in found if c.spikes]
    ratios = (
        [c.spike_time_estimate / c.spike_time for c in spiking if c.spike_time > 0],
        [c.V_C1_estimate / c.V_C1 for c in found if c.V_C1 > 0],
    )
    time_ratio, V_ratio = (f"{np.median(r):.0f}" if r else "unknown" for r in ratios)
    default = [c for c in found if c.case.tolerance == 1e-9]
    lines = [
        f"{provenance()}\n",
        f"- {count} scenes, {len(spiking)} of them with spikes",
        f"- count right and true errors below the estimates: {honest} of {count} "
        f"({honest / count:.1%})",
        f"- estimate over true error, median: {time_ratio} for spike times, {V_ratio} "
        "for V_C1",
        "- largest true error at the default tolerance: "
        f"{max((c.spike_time for c in default), default=0.0):.1e} s, "
        f"{max((c.V_C1 for c in default), default=0.0):.1e} V",
    ]
    for c in found:
        if not c.honest:
            lines.append(
                f"- not honest: seed {c.case.seed}, {c.spikes} of "
                f"{c.spikes_reference} spikes, error {c.spike_time:.1e} s (estimate "
                f"{c.spike_time_estimate:.1e} s), {c.V_C1:.1e} V (estimate "
                f"{c.V_C1_estimate:.1e} V)"
            )
    return lines
