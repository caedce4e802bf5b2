"""Write docs/bench-coverage.md: how often an interval holds the truth on a bench.

Each repeat is a whole run on the simulated bench, drivers, converter, clocks, lags and
noise included; bench_coverage_cases.py has them, bench_coverage_page.py the text.

Run by `make reports`, or alone (``--help``). It goes on where it was stopped:
``runs/bench-coverage.jsonl`` keeps what was done. Each case counts at the newest commit
at which it was measured, with ``--since`` at that commit and all later ones: whoever
says so holds that nothing between them moved an interval, and the page names both ends.
Cases of which nothing is kept here stay on the page as they stood; ``--again`` runs
their first seeds once more (bench_coverage_again.py) and, where they tell the same,
adds this commit to their rows.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from typing import Any

import bench_coverage_again as again
from bench_coverage_cases import CASES, repeat
from bench_coverage_page import stands, table

from tactile_lab.validation.table import commit

DOCS = Path(__file__).parent
PAGE = DOCS / "bench-coverage.md"
KEPT = DOCS.parent / "runs" / "bench-coverage.jsonl"
REPEATS = 1000


def git(*words: str) -> subprocess.CompletedProcess[str]:
    """What git answers of this checkout."""
    return subprocess.run(
        ["git", *words], cwd=DOCS, capture_output=True, text=True, check=False
    )


def kept(since: str = "") -> list[dict[str, Any]]:
    """What was done already and counts, in the order in which it was done."""
    if not KEPT.exists():
        return []
    rows = [json.loads(line) for line in KEPT.read_text().splitlines()]
    newest = {row["case"]: row["commit"] for row in rows}
    if not since:
        return [row for row in rows if row["commit"] == newest[row["case"]]]
    later = {
        one: git("merge-base", "--is-ancestor", since, one).returncode == 0
        for one in {row["commit"] for row in rows}
    }
    once = {(r["case"], r["seed"]): r for r in rows if later[r["commit"]]}
    return list(once.values())


def run_again(names: list[str], version: str) -> None:
    """Run the first seeds of these cases once more, and add the commit to their rows.

    Raises:
        SystemExit: other numbers are told: those cases are to be measured anew.
    """
    runs, gone = again.read(), []
    for name in names:
        most = again.again(runs[name], partial(repeat, name))
        print(f"{name}: {len(runs[name])} seeds, moved by {most:.1e} half-widths")
        if not runs[name] or most > again.SAME:
            gone.append(name)
            continue
        page = stands(PAGE.read_text(encoding="utf-8"), name, version)
        PAGE.write_text(page, encoding="utf-8")
    if gone:
        sys.exit(f"to be measured anew: {', '.join(gone)}")


def main() -> None:
    """Do what is not done yet, and write the page."""
    asked = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    asked.add_argument("words", nargs="*", help="of the names of cases; all if none")
    asked.add_argument("--repeats", type=int, default=REPEATS, help="seeds of each")
    asked.add_argument("--since", default="", help="rows of this commit on count")
    asked.add_argument("--table", action="store_true", help="only write the page")
    asked.add_argument("--again", action="store_true", help="only the first seeds")
    given = asked.parse_args()
    if given.since and git("cat-file", "-e", f"{given.since}^{{commit}}").returncode:
        asked.error(f"--since {given.since}: no commit of this repository")
    names = [n for n in CASES if any(w in n for w in given.words)] or list(CASES)
    version = commit()
    if given.again:
        run_again(names, version)
        return
    done = {
        (r["case"], r["seed"])
        for r in kept(given.since)
        if given.since or r["commit"] == version
    }
    KEPT.parent.mkdir(exist_ok=True)
    began = time.monotonic()
    wanted = [(n, seed) for seed in range(given.repeats) for n in names]
    left = [] if given.table else [pair for pair in wanted if pair not in done]
    for i, (name, seed) in enumerate(left):
        row = repeat(name, seed) | {"commit": version}
        with KEPT.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        if (i + 1) % 20 == 0:
            rate = (time.monotonic() - began) / (i + 1)
            says = f"{i + 1} of {len(left)}, {rate * (len(left) - i - 1) / 60:.0f} min"
            print(f"{says} left", file=sys.stderr, flush=True)
    again.keep(kept(given.since))
    page = table(kept(given.since), PAGE.read_text(encoding="utf-8"))
    PAGE.write_text(page, encoding="utf-8")
    print(page)


if __name__ == "__main__":
    main()
