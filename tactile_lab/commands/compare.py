"""``tactile-lab compare``: what differs between two runs, and what each found."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactile_lab.commands.options import json_option
from tactile_lab.commands.runs import shown
from tactile_lab.commands.terminal import print_json, refusing, say

if TYPE_CHECKING:
    from tactile_lab.store.facts import Fact

NOT_RESULTS = frozenset(
    {"name", "started", "title", "note", "tag", "starred", "status"}
)
FOLDER = click.Path(path_type=Path, file_okay=False)


@click.command()
@click.argument("first", metavar="A", type=FOLDER)
@click.argument("second", metavar="B", type=FOLDER)
@json_option
def command(first: Path, second: Path, as_json: bool) -> None:
    """Say what differs between the runs in folders A and B.

    Parameters and results side by side, then environment, calibration and the stored
    samples themselves.
    """
    with refusing():
        from tactile_lab.store.catalogue import summary
        from tactile_lab.store.compare import differences
        from tactile_lab.store.facts import facts, grouped

        rows = []
        one, other = (grouped(facts(summary(run))) for run in (first, second))
        for key in dict.fromkeys((*one, *other)):
            a, b = _beside(one.get(key, ()), other.get(key, ()))
            if key not in NOT_RESULTS and a != b:
                rows.append((key, a, b))
        found = differences(first, second)
    if as_json:
        print_json(
            {
                "values": {key: [a, b] for key, a, b in rows},
                "environment": found.environment,
                "calibration": found.calibration,
                "results": found.results,
            }
        )
        return
    wide = [max((len(row[k]) for row in rows), default=0) for k in (0, 1)]
    for key, a, b in rows:
        say(f"{key:<{wide[0]}}  {a:<{wide[1]}}  {b}".rstrip())
    if rows:
        say()
    say(str(found))


def _beside(one: Sequence[Fact], other: Sequence[Fact]) -> tuple[str, str]:
    """The values of one key; with their trials where the two have not the same ones."""
    if [fact.trial for fact in one] == [fact.trial for fact in other]:
        return shown(one), shown(other)
    first, second = (
        ", ".join(f"{fact.trial}: {shown([fact])}".removeprefix(": ") for fact in found)
        for found in (one, other)
    )
    return first, second
