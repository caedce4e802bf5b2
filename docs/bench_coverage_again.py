"""Whether a case of docs/bench-coverage.md still stands: its first seeds, run again.

docs/bench-coverage.csv keeps what the first seeds of each case told at the commit at
which all of them were run. Whoever tells the same of each today, to a part of the
interval that no count of hits would notice, has not moved the case: minutes instead of
the hours of a thousand runs.
"""

from __future__ import annotations

import csv
from collections import defaultdict
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

KEPT = Path(__file__).parent / "bench-coverage.csv"
HEAD = ("case", "seed", "commit", "number", "value", "low", "high")
SEEDS = 30
"""So many of each case are kept."""
SAME = 2e-3
"""Of an interval's half-width: less is no other number."""

Told = list[tuple[str, float, float, float]]
"""(number, value, low, high), as a run told them one after another."""
Runs = dict[str, dict[int, tuple[str, Told]]]
"""Of each case and seed the commit, and what the run told."""


def read(file: Path = KEPT) -> Runs:
    """What is kept."""
    found: Runs = defaultdict(dict)
    with file.open(newline="", encoding="utf-8") as lines:
        for row in csv.DictReader(lines):
            run = found[row["case"]].setdefault(int(row["seed"]), (row["commit"], []))
            value, low, high = (float(row[name]) for name in HEAD[4:])
            run[1].append((row["number"], value, low, high))
    return found


def keep(rows: Iterable[dict[str, Any]], file: Path = KEPT) -> None:
    """Put the first seeds of what was measured in the place of what was kept of it.

    Of a case that was stopped before they were all run, what was kept stays.
    """
    runs = read(file) if file.exists() else {}
    new: Runs = defaultdict(dict)
    for row in rows:
        if row["seed"] < SEEDS:
            told = [(name, *numbers[:3]) for name, *numbers in row["told"]]
            new[row["case"]][row["seed"]] = row["commit"], told
    runs |= {case: seeds for case, seeds in new.items() if len(seeds) == SEEDS}
    with file.open("w", newline="", encoding="utf-8") as lines:
        made = csv.writer(lines, lineterminator="\n")
        made.writerow(HEAD)
        for case, seeds in sorted(runs.items()):
            for seed, (commit, told) in sorted(seeds.items()):
                made.writerows(
                    (case, seed, commit, name, *(f"{one:.9g}" for one in numbers))
                    for name, *numbers in told
                )


def moved(before: Told, now: Told) -> float:
    """Most that a number or an end of its interval has moved, in half-widths.

    Infinite where other numbers are told.
    """
    if [name for name, *_ in before] != [name for name, *_ in now]:
        return float("inf")
    return max(
        (
            abs(one - other) / ((was[3] - was[2]) / 2)
            for was, new in zip(before, now, strict=True)
            for one, other in zip(was[1:], new[1:], strict=True)
        ),
        default=0.0,
    )


def again(
    runs: dict[int, tuple[str, Told]], repeat: Callable[[int], dict[str, Any]]
) -> float:
    """Most that any number of these seeds has moved, in half-widths; see `moved`."""
    most = 0.0
    for seed, (_, before) in runs.items():
        now = [(name, *numbers[:3]) for name, *numbers in repeat(seed)["told"]]
        most = max(most, moved(before, now))
    return most
