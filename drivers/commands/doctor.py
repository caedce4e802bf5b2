"""``tactile-lab doctor``: can this computer run an experiment, and if not, why."""

from __future__ import annotations

from pathlib import Path

import click

from tactile_lab.commands.options import json_option, runs_option
from tactile_lab.commands.terminal import print_json, refusing, say

PROBLEM = 1
BYTES_PER_SAMPLE = 2


@click.command()
@runs_option
@click.option(
    "--rate",
    type=click.FloatRange(min=0, min_open=True),
    default=4e6,
    show_default=True,
    metavar="SAMPLES/S",
    help="Samples a second over all channels that a run must store.",
)
@click.option(
    "--bench",
    metavar="FILE",
    help="Look for PicoSDK where this bench file says; the lab's unless given.",
)
@json_option
def command(out: Path, rate: float, bench: str | None, as_json: bool) -> None:
    """Look at environment, drivers, permissions, timing and disk.

    Opens no port and no instrument. Exit code 1 if there is a problem.
    """
    from drivers.diagnosis import diagnose
    from tactile_lab.lab import lab
    from tactile_lab.scene.load import load_bench

    with refusing():
        scope = load_bench(bench or lab().bench).scope
        library = None if scope is None else scope.library
        findings = diagnose(out, rate * BYTES_PER_SAMPLE, library)
    problems = sum(one["state"] == "problem" for one in findings)
    if as_json:
        print_json({"problems": problems, "findings": findings})
    else:
        for one in findings:
            say(f"{one['state']:8} {one['topic']:9} {one['text']}")
            if one["remedy"]:
                say(f"{'':18} remedy: {one['remedy']}")
        say(f"{problems or 'no'} problem{'' if problems == 1 else 's'}")
    if problems:
        raise click.exceptions.Exit(PROBLEM)
