"""What `plan` predicts of processor time and memory, beside what `run` then takes.

Run alone: ``.venv/bin/python tests/benchmarks/plan_cost.py [scene ...]
[--out docs/plan-figures.md]``. Every scene that ships, each in a process of its own,
and the demo with single parts left out. It goes on where it was stopped at the same
commit. Exit code 1 if one prediction is off by more than a factor 1.5.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from provenance import provenance

KEPT = Path("runs") / "plan-cost.jsonl"
GOAL = 1.5
PER_RUN = 12
"""Processor time of one row on the reference computer, on average, s."""
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


def measure(scene: str, changes: tuple[str, ...]) -> dict[str, object]:
    """One row: what was predicted before and after, and what one process then took."""
    options = [word for change in changes for word in ("--set", change)]
    before = planned(scene, options)
    with tempfile.TemporaryDirectory() as scratch:
        child = subprocess.Popen(
            tactile_lab("run", scene, "--out", scratch, *options),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        # only this tells what that one child took; this process is small beside it
        _, status, used = os.wait4(child.pid, 0)
    after = planned(scene, options)
    if status:
        raise SystemExit(f"{scene} ended with {os.waitstatus_to_exitcode(status)}")
    return {
        "scene": scene,
        "changes": changes,
        "seconds": [
            (before["computing"]["processor_s"] + after["computing"]["processor_s"])
            / 2,
            used.ru_utime + used.ru_stime,
        ],
        "bytes": [before["computing"]["memory_bytes"], used.ru_maxrss * 1024],
        "savings": {s["without"]: s["processor_s"] for s in before["savings"]},
    }


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
    shipped = [line(row)[0] for row in rows if not row["changes"]]
    whole = next((r for r in rows if r["scene"] == "demo" and not r["changes"]), None)
    saved = []
    for what, change in WITHOUT.items():
        less = next((r for r in rows if r["changes"] == [change]), None)
        if whole is not None and less is not None:
            took = whole["seconds"][1] - less["seconds"][1]
            told = whole["savings"][what]
            saved.append(f"- without {what}: {told:.2f} s predicted, {took:.2f} s less")
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
        "The demo, with single parts left out (a difference of two runs, each known to "
        "some tenths of a second):\n\n" + "\n".join(saved) + "\n"
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
    wanted: list[tuple[str, tuple[str, ...]]] = [
        (name, ()) for name in options.scenes or scenes()
    ]
    if not options.scenes:
        wanted += [("demo", (change,)) for change in WITHOUT.values()]
    rows = []
    if KEPT.exists():
        kept = [json.loads(text) for text in KEPT.read_text().splitlines()]
        rows = [row for row in kept if row["commit"] == commit]
    done = {(row["scene"], *row["changes"]) for row in rows}
    left = [(name, how) for name, how in wanted if (name, *how) not in done]
    print(f"{len(left)} runs, about {len(left) * PER_RUN / 60:.0f} min", flush=True)
    KEPT.parent.mkdir(exist_ok=True)
    for name, how in left:
        row = json.loads(json.dumps(measure(name, how) | {"commit": commit}))
        with KEPT.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        rows.append(row)
        print(line(row)[0], *how, flush=True)
    text = page(rows)
    if options.out is not None:
        options.out.write_text(text, encoding="utf-8")
    else:
        print(text)
    off = [row["scene"] for row in rows if line(row)[1] > GOAL]
    if off:
        sys.exit(f"off by more than a factor {GOAL:g}: {', '.join(off)}")


if __name__ == "__main__":
    main()
