"""``tactile-lab runs``: the runs that were recorded."""

from __future__ import annotations

import csv
import sys
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactile_lab.commands.options import json_option, runs_folder
from tactile_lab.commands.terminal import print_json, refusing, say
from tactile_lab.errors import SceneError, choices

if TYPE_CHECKING:
    from tactile_lab.store.facts import Fact
    from tactile_lab.store.summary import RunSummary

    Known = dict[str, list[Fact]]


@click.command()
@click.argument("root", default=runs_folder, type=click.Path(path_type=Path))
@click.option(
    "--search", default="", metavar="WORDS",
    help="Only runs with these words in names, notes, tags or parameters.",
)  # fmt: skip
@click.option(
    "--where",
    default="",
    metavar="CONDITION",
    help="Only runs for which this holds: 'protocol.levels > 100 mN and note ~ cal'.",
)
@click.option(
    "--sort",
    "sort",
    metavar="KEY",
    help="By this key, such as critical_force or -started; - for the largest first.",
)
@click.option(
    "--keys", is_flag=True, help="List the keys that --where and --sort know."
)
@click.option("--csv", "as_csv", is_flag=True, help="Print a table with every key.")
@json_option
def command(
    root: Path,
    search: str,
    where: str,
    sort: str | None,
    keys: bool,
    as_csv: bool,
    as_json: bool,
) -> None:
    """List the runs in folder ROOT (./runs, or as lab.toml says), oldest first.

    CONDITION is KEY SIGN VALUE, joined by and, or, not and brackets; signs are
    = != > >= < <= and ~ (contains). Values may have units: 'sensor = S12 and
    started >= 2026-11-01'.
    """
    with refusing():
        if as_csv and (as_json or keys):
            raise SceneError("--csv prints a table; leave out --json and --keys.")
        from tactile_lab.store.catalogue import Catalogue

        with Catalogue(root) as found:
            entries = found.runs(words=search, where=where)
            key = sort.removeprefix("-") if sort else None
            if key is not None:
                _check_key(key, found.keys())
            whole = keys or as_csv
            facts = found.known(entries, None if whole else key or "")
        if key is not None:
            order = ordered(facts, key, backwards=sort != key)
            entries, facts = [entries[i] for i in order], [facts[i] for i in order]
    if keys and as_json:
        print_json({"keys": examples(facts)})
    elif keys:
        for name, example in sorted(examples(facts).items()):
            say(f"{name:<34} {example}")
    elif as_csv:
        print_csv(facts)
    elif as_json:
        print_json({"runs": [entry.to_dict() for entry in entries]})
    else:
        print_list(entries, key, facts)
    if not entries:
        asked = " matches" if search or where else ""
        say(f"No run in {root}{asked}.", sys.stderr)


def _check_key(key: str, keys: Collection[str]) -> None:
    """Refuse a key that no run has and none could be known to have."""
    from tactile_lab.store.facts import KNOWN

    if keys and key not in (known := {*keys, *KNOWN}):
        told = choices(key, sorted(known), "Keys")
        raise SceneError(f'--sort: no run has "{key}"; {told}')


def ordered(facts: Sequence[Known], key: str, *, backwards: bool) -> list[int]:
    """The order of runs by a key, those without it last."""

    def place(i: int) -> tuple[float, str]:
        first = facts[i][key][0]
        return (
            first.number if first.number is not None else 0.0,
            first.text.casefold(),
        )

    having = [i for i in range(len(facts)) if key in facts[i]]
    rest = [i for i in range(len(facts)) if key not in facts[i]]
    return [*sorted(having, key=place, reverse=backwards), *rest]


def examples(facts: Sequence[Known]) -> dict[str, str]:
    """Of each key what the newest run that has it says."""
    return {key: shown(found) for table in facts for key, found in table.items()}


def shown(found: Sequence[Fact]) -> str:
    """The values of one key for a person."""
    from tactile_lab.quantity import show

    return ", ".join(
        one.text if one.number is None else show(one.number, one.unit) for one in found
    )


def print_list(
    entries: Sequence[RunSummary], key: str | None, facts: Sequence[Known]
) -> None:
    """One line a run, under headings."""
    from tactile_lab.quantity import count
    from tactile_lab.signals import DAGGER, NO_COUNT

    rows = [("run", "status", "", "length", "spikes", "")]
    for i, entry in enumerate(entries):
        kind = {True: "sim", False: "real", None: "?"}[entry.simulated]
        length = "" if entry.duration is None else f"{entry.duration:.1f} s"
        spikes = "" if entry.spikes is None else count(entry.spikes, "spike")
        spikes += DAGGER if entry.uncounted else ""
        empty = "" if entry.recorded else "none recorded"
        told = entry.trouble or entry.loss or empty
        if key is not None:
            told = shown(facts[i].get(key, ()))
        elif not entry.trouble:
            star = "* " if entry.starred else ""
            told = f"{star}{' '.join(f'#{tag}' for tag in entry.tags)} {told}".strip()
        rows.append((entry.name, entry.status, kind, length, spikes, told))
    if len(rows) == 1:
        return
    rows[0] = (*rows[0][:-1], key or "samples")
    wide = max(len(row[0]) for row in rows)
    for name, status, kind, length, spikes, told in rows:
        line = f"{name:<{wide}} {status:<10} {kind:<4} {length:>9} {spikes:>12}  {told}"
        say(line.rstrip())
    if any(entry.uncounted for entry in entries):
        say(NO_COUNT)


def print_csv(facts: Sequence[Known]) -> None:
    """A table for other programs: a column a key, numbers in SI, lists with spaces."""
    columns: dict[str, str] = {}
    for table in facts:
        for key, found in table.items():
            columns.setdefault(key, next((one.unit for one in found if one.unit), ""))
    table_of = csv.writer(sys.stdout, lineterminator="\n")
    table_of.writerow(
        f"{key} ({unit})" if unit else key for key, unit in columns.items()
    )
    for table in facts:
        table_of.writerow(
            " ".join(
                one.text if one.number is None else repr(one.number)
                for one in table.get(key, ())
            )
            for key in columns
        )
