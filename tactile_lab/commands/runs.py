"""``tactile-lab runs``: the runs that were recorded."""

from __future__ import annotations

import sys
from datetime import datetime
from pathlib import Path

import click

from tactile_lab.commands.options import json_option, runs_folder
from tactile_lab.commands.terminal import print_json, refusing, say

DAY = click.DateTime(["%Y-%m-%d"])


@click.command()
@click.argument("root", default=runs_folder, type=click.Path(path_type=Path))
@click.option("--protocol", metavar="NAME", help="Only runs of this protocol.")
@click.option("--sensor", metavar="TEXT", help="Only runs whose noted sensor has this.")
@click.option("--since", type=DAY, metavar="DATE", help="Not before this day.")
@click.option("--until", type=DAY, metavar="DATE", help="Not after this day.")
@click.option(
    "--search", default="", metavar="WORDS",
    help="Only runs with these words in names, notes, tags or parameters.",
)  # fmt: skip
@json_option
def command(
    root: Path,
    protocol: str | None,
    sensor: str | None,
    since: datetime | None,
    until: datetime | None,
    search: str,
    as_json: bool,
) -> None:
    """List the runs in folder ROOT (./runs, or as lab.toml says), oldest first."""
    with refusing():
        from tactile_lab.quantity import count
        from tactile_lab.store.catalogue import catalogue

        entries = catalogue(
            root,
            protocol=protocol,
            sensor=sensor,
            since=since.date() if since else None,
            until=until.date() if until else None,
            words=search,
        )
    if as_json:
        print_json({"runs": [entry.to_dict() for entry in entries]})
        return
    for entry in entries:
        kind = {True: "sim", False: "real", None: "?"}[entry.simulated]
        length = "" if entry.duration is None else f"{entry.duration:.1f} s"
        spikes = "" if entry.spikes is None else count(entry.spikes, "spike")
        say(
            f"{entry.name:<44} {entry.status:<10} {kind:<4} {length:>9} {spikes:>12}"
            f"  {entry.trouble or entry.loss}".rstrip()
        )
    if not entries:
        say(f"No run in {root} matches.", sys.stderr)
