"""Measure again what docs/ states: every campaign, one after another.

``make reports`` runs this. It first says how long that takes, does only what is not
done yet at this commit, and so goes on where it was stopped; one that fails keeps none
of the others back, and is named in the end. The long campaigns keep their own rows too.
Words choose those whose names contain one of them:
``.venv/bin/python docs/make_reports.py paper plan``. ``--pages`` measures nothing: it
lists each page with the commits it was measured at, and how many commits have changed
the code it measures since.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

from tactile_lab.validation.table import commit, markdown

ROOT = Path(__file__).parent.parent
DONE = ROOT / "runs" / "reports.json"
BENCHMARKS = "tests/benchmarks"
STEPS: dict[str, tuple[float, str]] = {
    "accuracy": (20, "-m tactile_lab validate accuracy --out docs"),
    "sweeps": (3, "-m tactile_lab validate sweeps --out docs"),
    "honesty": (120, "-m tactile_lab validate honesty --scenes 1000 --out docs"),
    "stability": (10, "-m tactile_lab validate stability --out docs"),
    "fit recovery": (15, "docs/make_fit_recovery.py"),
    "bench coverage": (420, "docs/make_bench_coverage.py"),
    "saturation": (10, "docs/make_saturation.py"),
    "paper": (2, "docs/make_paper.py"),
    "surprises": (16, f"{BENCHMARKS}/surprises.py --out docs/surprise-figures.md"),
    "plan": (12, f"{BENCHMARKS}/plan_cost.py --out docs/plan-figures.md"),
    "protocols": (5, f"{BENCHMARKS}/protocol_speed.py --out docs/protocol-figures.md"),
    "detection": (
        5,
        f"{BENCHMARKS}/spike_detection.py --out docs/detection-figures.md",
    ),
    "store": (5, f"{BENCHMARKS}/store_speed.py --out docs/store-figures.md"),
    "kills": (15, f"{BENCHMARKS}/kill_store.py --kills 200 --out docs/kill-figures.md"),
    "killed verbs": (90, f"{BENCHMARKS}/kill_verbs.py --out docs/kill-verb-figures.md"),
    "search": (2, f"{BENCHMARKS}/runs_search.py --out docs/search-figures.md"),
    "streaming": (5, f"{BENCHMARKS}/sustained.py --out docs/streaming-figures.md"),
    "day": (240, f"{BENCHMARKS}/day_long.py --out docs/day-figures.md"),
    "live": (12, f"{BENCHMARKS}/live_lsl.py --out docs/live-figures.md"),
    "live window": (
        12,
        f"{BENCHMARKS}/live_lsl.py --window --out docs/live-window-figures.md",
    ),
    "serial": (5, f"{BENCHMARKS}/serial_bench.py --out docs/serial-figures.md"),
    "force": (5, f"{BENCHMARKS}/force_following.py --out docs/force-figures.md"),
    "scope": (5, f"{BENCHMARKS}/scope_stream.py --out docs/scope-figures.md"),
    "faults": (20, f"{BENCHMARKS}/fault_table.py --out docs/fault-figures.md"),
    "fuzz": (30, f"{BENCHMARKS}/fuzz.py --out docs/fuzz-figures.md"),
    "keys": (60, f"{BENCHMARKS}/key_ends.py --out docs/key-figures.md"),
    "study speed": (30, f"{BENCHMARKS}/study_speed.py --out docs/study-figures.md"),
    "study answers": (20, f"{BENCHMARKS}/study_answers.py --out docs/study-answers.md"),
    "study kills": (30, f"{BENCHMARKS}/study_kills.py --out docs/study-kills.md"),
    "skin": (8, f"{BENCHMARKS}/skin_speed.py --out docs/skin-figures.md"),
    "designs": (10, f"{BENCHMARKS}/design_table.py --out docs/design-figures.md"),
    "window": (25, f"{BENCHMARKS}/window_figures.py --out docs/window-figures.md"),
}
"""What to run by its name, and the minutes it is thought to take on two cores with
nothing else running; once it has run here, what it took here counts."""
NEEDS = {"saturation": "ngspice"}
SOLVER = "tactile_lab/model"
RUNS = (
    "tactile_lab/acquisition tactile_lab/engine tactile_lab/spikes tactile_lab/store "
    "drivers sim_backend"
)
TOLD = f"tactile_lab/analysis protocols {SOLVER} {RUNS}"
PAGES = {
    "accuracy": f"{SOLVER} tactile_lab/validation",
    "honesty": f"{SOLVER} tactile_lab/validation",
    "stability": f"{SOLVER} tactile_lab/validation",
    "saturation": SOLVER,
    "fit-recovery": f"{SOLVER} tactile_lab/analysis",
    "bench-coverage": TOLD,
    "paper": f"{TOLD} tactile_lab/report",
    "surprise-figures": TOLD,
    "plan-figures": f"tactile_lab/planning {RUNS}",
    "protocol-figures": f"protocols tactile_lab/report {RUNS}",
    "detection-figures": "tactile_lab/spikes",
    "detection-oracles": "tactile_lab/spikes",
    "store-figures": "tactile_lab/store",
    "kill-figures": "tactile_lab/store",
    "search-figures": "tactile_lab/store tactile_lab/commands",
    "kill-verb-figures": "tactile_lab/store tactile_lab/commands",
    "streaming-figures": RUNS,
    "serial-figures": "drivers sim_backend tactile_lab/acquisition",
    "force-figures": "drivers sim_backend tactile_lab/acquisition",
    "scope-figures": "drivers sim_backend",
    "fault-figures": RUNS,
    "fuzz-figures": "tactile_lab/scene tactile_lab/commands",
    "key-figures": f"tactile_lab/scene tactile_lab/planning protocols {SOLVER}",
    "study-figures": "tactile_lab/studies",
    "study-answers": f"tactile_lab/studies {SOLVER}",
    "study-kills": "tactile_lab/studies",
    "design-figures": f"tactile_lab/studies {SOLVER}",
    "window-figures": "gui",
    "day-figures": f"tactile_lab/report {RUNS}",
    "live-figures": RUNS,
}
"""What each page measures: if that has changed since, it may be out of date. A page of
figures that is not listed is taken to measure everything."""
HASH = r"\b(?=[0-9a-f]*[0-9])(?=[0-9a-f]*[a-f])[0-9a-f]{7,12}\b"


def since(version: str, paths: str) -> str:
    """How many commits after `version` changed any of these paths; "" if it is none."""
    asked = ["git", "rev-list", "--count", f"{version}..HEAD", "--", *paths.split()]
    told = subprocess.run(asked, cwd=ROOT, text=True, capture_output=True, check=False)
    return told.stdout.strip()


def pages() -> str:
    """Which page is of which commits, and what has changed since the oldest of them."""
    rows = []
    figures = (ROOT / "docs").glob("*-figures.md")
    whole = dict.fromkeys(sorted(page.stem for page in figures), ".")
    for name, paths in (whole | PAGES).items():
        text = (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
        text = re.sub(f"{HASH} to (?={HASH})", "", text)  # run again at the later one
        found = dict.fromkeys(re.findall(HASH, text))
        counts = {one: int(n) for one in found if (n := since(one, paths))}
        told = ", ".join(counts) or "not said"
        most = max(counts.values(), default=None)
        rows.append((name, told, "unknown" if most is None else str(most)))
    heads = ("page", "measured at", "commits since to what it measures")
    return markdown(heads, rows)


def main() -> None:
    """Say how long it takes, then do what is left."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("words", nargs="*", help=f"of these: {', '.join(STEPS)}")
    parser.add_argument("--pages", action="store_true", help="measure nothing")
    options = parser.parse_args(sys.argv[1:])
    if options.pages:
        print(pages())
        return
    version, words = commit(), options.words
    for word in words:
        if not any(word in name for name in STEPS):
            parser.error(f"no campaign's name has {word!r} in it")
    known = json.loads(DONE.read_text()) if DONE.exists() else {}
    wanted = [n for n in STEPS if not words or any(word in n for word in words)]
    left = []
    for name in wanted:
        if name in NEEDS and shutil.which(NEEDS[name]) is None:
            print(f"{name}: left out, {NEEDS[name]} is not installed")
        elif known.get(name, {}).get("commit") == version:
            print(f"{name}: done at {version}")
        else:
            left.append(name)
    minutes = {n: known.get(n, {}).get("minutes", STEPS[n][0]) for n in left}
    told = ", ".join(f"{name} {minutes[name]:.0f}" for name in left)
    print(f"{sum(minutes.values()):.0f} minutes left: {told or 'nothing'}")
    failed = []
    for name in left:
        print(f"{name} ...", flush=True)
        began = time.monotonic()
        asked = [sys.executable, *STEPS[name][1].split()]
        if subprocess.run(asked, cwd=ROOT, check=False).returncode:
            failed.append(name)
            continue
        took = (time.monotonic() - began) / 60
        known[name] = {"commit": version, "minutes": took}
        DONE.parent.mkdir(exist_ok=True)
        DONE.write_text(json.dumps(known, indent=1), encoding="utf-8")
    if failed:
        sys.exit(f"ended with an error, or missed a goal: {', '.join(failed)}")


if __name__ == "__main__":
    main()
