"""How long it takes to find runs among ten thousand.

    python tests/benchmarks/runs_search.py [--runs 10000] [--out FILE]

Each row is the median of several: processor time, which other work on the machine
changes little, and wall time beside it.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from provenance import provenance, tell

from tactile_lab.store.catalogue import Catalogue
from tactile_lab.store.index import FILE

TIMES = 9
WHERE = "protocol.levels > 100 mN and note ~ cal"


def make(root: Path, runs: int) -> None:
    """Folders of runs as the demo's are: eight levels, a dozen results of each."""
    for i in range(runs):
        force = 0.05 + i % 200 / 1000
        parameters = {
            "levels": [f"{force + k / 100:.3f} N" for k in range(8)],
            **{f"key_{k}": f"{k} s" for k in range(12)},
        }
        info = {
            "schema": 1,
            "status": "complete",
            "started": f"20{10 + i // 1000}-03-{1 + i % 28:02d}T09:00:00+00:00",
            "protocol": "pulses",
            "scene": "demo",
            "title": "Pulses",
            "bench": "simulated bench",
            "simulated": True,
            "parameters": parameters,
            "notes": {"sensor": f"S{i % 12}", "why": "cal" if i % 100 == 0 else "x"},
            "duration_s": 60.0,
            "spikes_online": i % 500,
            "loss": {"text": "loss: 0 of 44,422,916 samples, 0 of 15 spikes"},
        }
        trial = {
            "rest_V_C1_V": 4.3,
            "peak_rate_Hz": 30.0,
            "latency_s": 0.2,
            "circuit_adaptation": {"tau_s": 9.0 + i % 7},
        }
        results = {"conclusion": {"critical_force_N": force}, "trials": [trial] * 8}
        folder = root / f"{i:06d}_demo"
        folder.mkdir()
        (folder / "run.json").write_text(json.dumps(info))
        (folder / "results.json").write_text(json.dumps(results))


def measured(act: Callable[[], object], times: int = TIMES) -> tuple[float, float]:
    """Processor and wall time of it, s; its processes counted."""
    told = []
    for _ in range(times):
        before, began = _processor(), time.perf_counter()
        act()
        told.append((_processor() - before, time.perf_counter() - began))
    used, took = map(statistics.median, zip(*told, strict=True))
    return used, took


def _processor() -> float:
    ours, theirs = (
        resource.getrusage(who)
        for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    return sum(one.ru_utime + one.ru_stime for one in (ours, theirs))


def main() -> None:
    """Make the runs, search them, print or write the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--runs", type=int, default=10_000)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    rows = []

    def row(what: str, act: Callable[[], object], times: int = TIMES) -> None:
        rows.append((what, *measured(act, times)))
        print(*rows[-1], flush=True)

    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        make(root, asked.runs)

        def search(**how: str) -> int:
            with Catalogue(root) as found:
                return len(found.runs(**how))

        def command(*words: str) -> None:
            subprocess.run(
                [
                    sys.executable,
                    "-c",
                    "from tactile_lab.cli import main; main()",
                    *words,
                ],
                check=True,
                stdout=subprocess.DEVNULL,
            )

        row("index made anew", search, 1)
        hits = search(where=WHERE)
        row(f"`where`: {WHERE} ({hits} runs)", lambda: search(where=WHERE))
        row("`where`: tau > 14 s", lambda: search(where="tau > 14 s"))
        row("no condition: all", search)
        many = "protocol.levels > 100 mN"
        listed = ("runs", str(root), "--where")
        row("`tactile-lab runs --help`: start-up", lambda: command("runs", "--help"))
        row("`tactile-lab runs --where`, the first", lambda: command(*listed, WHERE))
        row(
            "`--where`, most runs, `--sort -peak_rate`",
            lambda: command(*listed, many, "--sort", "-peak_rate"),
        )
        row(
            "`--where`, the first, `--sort tau --csv`",
            lambda: command(*listed, WHERE, "--sort", "tau", "--csv"),
        )
        size = (root / FILE).stat().st_size / 2**20
    table = "\n".join(
        f"| {what} | {used:.2f} s | {wall:.2f} s |" for what, used, wall in rows
    )
    text = f"""# Finding runs

{provenance()}, load {os.getloadavg()[0]:.1f}. {asked.runs:,} run folders with some 55
values each, made and searched by `tests/benchmarks/runs_search.py`; medians of {TIMES},
the index's file {size:.0f} MiB. The first rows are what a script or the window waits
for, those with a command have Python's start-up in them. Other work on the machine
lengthens wall time.

| what | processor time | wall time |
|---|---|---|
{table}
"""
    tell(text, asked.out)


if __name__ == "__main__":
    main()
