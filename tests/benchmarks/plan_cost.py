"""What `plan` predicts of processor time and memory, beside what `run` then takes.

Run alone: ``.venv/bin/python tests/benchmarks/plan_cost.py [scene ...]
[--out docs/plan-figures.md]``. Every scene that ships, each in a process of its own,
and the demo with single parts left out, beside it whole. It goes on where it was
stopped at the same commit. Exit code 1 if one prediction is off by more than a factor
1.5.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import fmean, stdev
from typing import Any

from provenance import provenance

KEPT = Path("runs") / "plan-cost.jsonl"
GOAL = 1.5
PER_RUN = 12
"""Processor time of one row on the reference computer, on average, s."""
PAIRS = 8
"""Runs of the demo with a part left out, each between two of it whole: what one saves
is less than a computer's speed moves from run to run."""
WITHOUT = {
    "V_C2": 'record.signals=["force", "coil_current", "V_C1", "V_K", "spikes", "rate"]',
    "model beside the run": "record.compare=false",
}
"""What the demo is run without, and how."""


def tactile_lab(*words: str) -> list[str]:
    """The command of this environment."""
    return [sys.executable, "-m", "tactile_lab", *words]


def planned(scene: str, options: list[str]) -> dict[str, Any]:
    """What `plan` tells."""
    asked = tactile_lab("plan", scene, "--json", *options)
    done = subprocess.run(asked, capture_output=True, text=True, check=True)
    told: dict[str, Any] = json.loads(done.stdout)
    return told


def ran(scene: str, options: list[str]) -> tuple[float, int]:
    """What one process then took: processor time, s, and largest memory, bytes."""
    with tempfile.TemporaryDirectory() as scratch:
        child = subprocess.Popen(
            tactile_lab("run", scene, "--out", scratch, *options),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        # only this tells what that one child took; this process is small beside it
        _, status, used = os.wait4(child.pid, 0)
    if status:
        raise SystemExit(f"{scene} ended with {os.waitstatus_to_exitcode(status)}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss * 1024


def measure(scene: str) -> dict[str, Any]:
    """One row: what was predicted before and after, and what the run took."""
    before = planned(scene, [])["computing"]
    seconds, size = ran(scene, [])
    after = planned(scene, [])["computing"]
    told = (before["processor_s"] + after["processor_s"]) / 2
    return {
        "scene": scene,
        "seconds": [told, seconds],
        "bytes": [before["memory_bytes"], size],
    }


def spared(what: str) -> dict[str, Any]:
    """One row: what the demo was to take less without a part, and took in each pair."""
    told, less = [], []
    whole, _ = ran("demo", [])
    for _ in range(PAIRS):
        savings = {
            s["without"]: s["processor_s"] for s in planned("demo", [])["savings"]
        }
        told.append(savings[what])
        without, _ = ran("demo", ["--set", WITHOUT[what]])
        before, (whole, _) = whole, ran("demo", [])
        less.append((before + whole) / 2 - without)
    return {"scene": "demo", "without": what, "told": fmean(told), "less": less}


def line(row: dict[str, Any]) -> tuple[str, float]:
    """A row of the table, and by which factor it is off at most."""
    cells, worst = [], 1.0
    for key, scale in (("seconds", 1.0), ("bytes", 1e6)):
        predicted, measured = (value / scale for value in row[key])
        told = [f"{float(f'{v:.3g}'):g}" for v in (predicted, measured)]
        cells += [*told, f"{predicted / measured:.2f}"]
        worst = max(worst, predicted / measured, measured / predicted)
    return f"| {row['scene']} | {' | '.join(cells)} |", worst


def page(rows: list[dict[str, Any]]) -> str:
    """The table, and what single parts of the demo saved."""
    shipped = [line(row)[0] for row in rows if "without" not in row]
    saved = []
    for row in rows:
        if "without" in row:
            error = stdev(row["less"]) / math.sqrt(len(row["less"]))
            saved.append(
                f"- without {row['without']}: {row['told']:.2f} s predicted, "
                f"{fmean(row['less']):.2f} ± {error:.2f} s less"
            )
    return (
        "# What `plan` predicts beside what a run then takes\n\n"
        f"{provenance()}. Made by `tests/benchmarks/plan_cost.py` (part of `make "
        "reports`): every scene that ships, run with its report in a process of its "
        "own on the simulated bench. Time is the processor's, so that other work on "
        "the computer counts little; it still varies by about 10 % from run to run. "
        "How fast a computer is, `plan` sees in 40 ms, and one that shares its cores "
        "is half as fast a moment later: predicted is the mean of a plan just before "
        "the run and of one just after.\n\n"
        "| scene | predicted, s | took, s | ratio "
        "| predicted, MB | took, MB | ratio |\n"
        "|---|---|---|---|---|---|---|\n" + "\n".join(shipped) + "\n\n"
        "The demo, with single parts left out: how much less a run took than the mean "
        f"of one whole before and one after it, mean of {PAIRS} and its standard "
        "error.\n\n" + "\n".join(saved) + "\n"
    )


def scenes() -> list[str]:
    """All that ship; asked for in a process of its own, to stay small."""
    code = "from tactile_lab.plugins import scene_names; print(*scene_names())"
    asked = [sys.executable, "-c", code]
    return subprocess.check_output(asked, text=True).split()


def main() -> None:
    """Do what is not done yet, then write or print the page."""
    parser = argparse.ArgumentParser()
    parser.add_argument("scenes", nargs="*")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    commit = provenance()
    wanted = [(name, "") for name in options.scenes or scenes()]
    if not options.scenes:
        wanted += [("demo", what) for what in WITHOUT]
    rows = []
    if KEPT.exists():
        kept = [json.loads(text) for text in KEPT.read_text().splitlines()]
        rows = [row for row in kept if row["commit"] == commit]
    done = {(row["scene"], row.get("without", "")) for row in rows}
    left = [pair for pair in wanted if pair not in done]
    runs = sum(2 * PAIRS + 1 if what else 1 for _, what in left)
    print(f"{runs} runs, about {runs * PER_RUN / 60:.0f} min", flush=True)
    KEPT.parent.mkdir(exist_ok=True)
    for name, what in left:
        row = (spared(what) if what else measure(name)) | {"commit": commit}
        with KEPT.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        rows.append(row)
        print(f"without {what}" if what else line(row)[0], flush=True)
    text = page(rows)
    if options.out is not None:
        options.out.write_text(text, encoding="utf-8")
    else:
        print(text)
    off = [r["scene"] for r in rows if "without" not in r and line(r)[1] > GOAL]
    if off:
        sys.exit(f"off by more than a factor {GOAL:g}: {', '.join(off)}")


if __name__ == "__main__":
    main()
