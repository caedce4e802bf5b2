"""``tactile-lab chart``: one number over many runs, with what is usual."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import click

from tactile_lab.commands.options import json_option, runs_folder
from tactile_lab.commands.terminal import print_json, refusing, say, working


@click.command()
@click.argument("key")
@click.argument("root", default=runs_folder, type=click.Path(path_type=Path))
@click.option("--where", default="", metavar="CONDITION", help="As for `runs`.")
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.html",
    help="Also write a page with the chart, and its figure beside it.",
)
@json_option
def command(key: str, root: Path, where: str, out: Path | None, as_json: bool) -> None:
    """Follow KEY, such as rest_V_C1 or tau, over the runs in folder ROOT.

    Says what is usual (Shewhart's chart of single values), which runs lie outside,
    whether it drifts, and mean and standard error of each sensor.
    """
    with refusing():
        from tactile_lab.errors import ParameterError
        from tactile_lab.report.over_runs import OverRuns, RunValue
        from tactile_lab.store.catalogue import Catalogue

        if out is not None and out.suffix.lower() != ".html":
            raise ParameterError(f"--out {out}: end the page's name in .html.")
        points, unit = [], ""
        with Catalogue(root) as listed:
            entries = listed.runs(where=where)
            known = listed.known(entries, key)
        for entry, facts in zip(entries, known, strict=True):
            told = facts.get(key, [])
            numbers = [one.number for one in told if one.number is not None]
            if numbers and entry.started:
                unit = told[0].unit or unit
                points.append(
                    RunValue(
                        entry.name,
                        datetime.fromisoformat(entry.started),
                        entry.sensor,
                        sum(numbers) / len(numbers),
                        bool(entry.simulated),
                    )
                )
        found = OverRuns.of(key, unit, points)
        if out is not None:
            with working("drawing"):
                found.write(out)
    if as_json:
        chart = found.chart
        print_json(
            {
                "key": key,
                "unit": unit,
                "runs": {one.run: one.value for one in found.points},
                "mean": None if chart is None else chart.mean,
                "limits": None if chart is None else [chart.low, chart.high],
                "outside": []
                if chart is None
                else [found.points[i].run for i in chart.outside],
            }
        )
        return
    for text in found.sentences:
        say(text)
    say()
    say(found.table.text)
    if out is not None:
        say(f"\nreport  {out}")
