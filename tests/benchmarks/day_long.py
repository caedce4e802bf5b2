"""Memory of a day: a hold, a stored run without force, and the monitor, hour by hour.

    python tests/benchmarks/day_long.py [--hours 24] [--rate 10000] [--out FILE]

The first two are the program itself on the built-in bench, as fast as it computes; its
memory is looked at as its progress passes each hour, and its peak once the report is
written. `watched` is what `tactile-lab monitor` and the window's *Monitor* do, in a
process of its own and by the simulated clock: four times the last minute is recorded,
with its report. The exit code is 1 where memory grows: where the last half of the hours
needs more than `SLACK` above the first half, or a sample is lost.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import shutil
import socket
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from provenance import provenance, tell

HOUR = 3600.0
SLACK = 10.0
"""Growth from the first half of the hours to the last that is called flat, MB."""

SCENES = {
    "hold": ("protocol.level=100 mN", "protocol.hold={left} s", "protocol.rest=2 s"),
    "monitor": ("protocol.duration={whole} s",),
}
"""What is run, with the keys that make it last."""

STORED = 'record.signals=["V_C1", "V_C2", "coil_current", "spikes"]'


def memory(pid: int, what: str) -> float:
    """`VmRSS`, now, or `VmHWM`, at most so far, of a process, MB; Linux only."""
    text = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    line = next(line for line in text.splitlines() if line.startswith(what))
    return int(line.split()[1]) / 1024


def told(address: str) -> Iterator[dict[str, Any]]:
    """Events of a run as it tells them to other programs."""
    host, port = address.removeprefix("tcp://").split(":")
    with socket.create_connection((host, int(port))) as link, link.makefile() as lines:
        yield from map(json.loads, lines)


def one(scene: str, hours: float, rate: float, root: Path) -> tuple[str, bool]:
    """A row of the table, and whether its memory stays flat."""
    whole = hours * HOUR
    changes = [
        change.format(whole=whole, left=whole - 3)
        for change in (*SCENES[scene], STORED, f"record.sample_rate={rate:g} S/s")
    ]
    if scene == "monitor":
        changes = [c.replace('"coil_current", ', "") for c in changes]
    name = {"hold": "hold_10s"}.get(scene, scene)
    words = [sys.executable, "-m", "tactile_lab", "run", name, "--json"]
    words += ["--out", str(root), "--status", "tcp://127.0.0.1:0"]
    words += [word for change in changes for word in ("--set", change)]
    run = subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert run.stdout is not None and run.stderr is not None
    heard = iter(run.stderr.readline, "")
    address = next(line for line in heard if line.startswith("status ")).split()[1]
    at_hours: list[float] = []
    for event in told(address):
        now = event["elapsed_s"] if event["event"] == "progress" else 0.0
        if now >= min(HOUR * (len(at_hours) + 1), whole - 5) and len(at_hours) < hours:
            at_hours.append(memory(run.pid, "VmRSS"))
            print(f"{scene} {now / HOUR:.1f} h {at_hours[-1]:.0f} MB", flush=True)
        if event["event"] == "result":
            break
    peak = 0.0
    while run.poll() is None:
        try:
            peak = memory(run.pid, "VmHWM")
        except (OSError, StopIteration):
            break
        try:
            run.wait(0.1)
        except subprocess.TimeoutExpired:
            continue
    result = json.loads(run.stdout.read())
    half = len(at_hours) // 2
    grown = statistics.median(at_hours[half:]) - statistics.median(at_hours[:half])
    size = sum(f.stat().st_size for f in Path(result["run"]).rglob("*") if f.is_file())
    lost, complete = result["loss"]["samples"], result["status"] == "complete"
    shutil.rmtree(result["run"])
    row = (
        f"| {scene} | {result['duration_s'] / HOUR:.1f} "
        f"| {at_hours[0]:.0f} | {at_hours[half]:.0f} | {at_hours[-1]:.0f} "
        f"| {grown:+.0f} | {peak:.0f} | {size / 1e6:.0f} | {result['spikes']} "
        f"| {lost} | {result['status']} |"
    )
    return row, grown <= SLACK and not lost and complete


def watched(hours: float, rate: float, root: Path) -> tuple[str, bool]:
    """As `one`, of an endless monitor, in a process that has done nothing else."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(watch, (hours, rate, root))


def watch(hours: float, rate: float, root: Path) -> tuple[str, bool]:
    """A row of the table, of an endless monitor in this process."""
    from tactile_lab.acquisition import events
    from tactile_lab.engine.monitor import Monitor
    from tactile_lab.engine.sensor import LONG_PARTS
    from tactile_lab.report.from_run import read
    from tactile_lab.report.write import write
    from tactile_lab.scene.load import load
    from tactile_lab.store.run import Run

    at_hours: list[float] = []
    kept: list[Path] = []

    def emit(event: events.Event) -> None:
        if not isinstance(event, events.Progress):
            return
        if event.elapsed >= HOUR * (len(at_hours) + 1):
            at_hours.append(memory(os.getpid(), "VmRSS"))
            print(f"watched {len(at_hours)} h {at_hours[-1]:.0f} MB", flush=True)
            if len(at_hours) % max(1, round(hours / 4)) == 0:
                kept.append(monitor.record(root))
                write(kept[-1], read(kept[-1]))
        if len(at_hours) >= hours:
            monitor.stop("a day is over")

    fires = "sensor.V_GS=1.65 V"
    changes = (*LONG_PARTS, f"record.sample_rate={rate:g} S/s", fires)
    monitor = Monitor(load("monitor", changes), emit=emit, endless=True)
    ending = monitor.run()
    lost, spikes, size = 0, 0, 0
    for folder in kept:
        size += sum(f.stat().st_size for f in folder.rglob("*") if f.is_file())
        with Run.load(folder) as run:
            lost += run.info["loss"]["samples"]
            lost += abs(run.samples - round(run.duration * rate))
            spikes += run.spikes["time"].size
    half = len(at_hours) // 2
    grown = statistics.median(at_hours[half:]) - statistics.median(at_hours[:half])
    row = (
        f"| watched | {len(at_hours):.1f} | {at_hours[0]:.0f} | {at_hours[half]:.0f} "
        f"| {at_hours[-1]:.0f} | {grown:+.0f} | {memory(os.getpid(), 'VmHWM'):.0f} "
        f"| {size / 1e6:.1f} in {len(kept)} | {spikes} | {lost} | {ending.reason} |"
    )
    return row, grown <= SLACK and not lost


def main() -> int:
    """Run all, print and write the table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--hours", type=float, default=24.0)
    options.add_argument("--rate", type=float, default=10e3)
    kinds = (*SCENES, "watched")
    options.add_argument("--scene", choices=kinds, action="append")
    options.add_argument("--out", type=Path)
    chosen = options.parse_args()
    rows: list[str] = []
    flat = True
    with tempfile.TemporaryDirectory() as root:
        for scene in chosen.scene or kinds:
            of = watched if scene == "watched" else partial(one, scene)
            row, stays = of(chosen.hours, chosen.rate, Path(root))
            rows, flat = [*rows, row], flat and stays
            print(row, flush=True)
    text = "\n".join(
        [
            "# A day in one run",
            "",
            f"{provenance()}. Made by `tests/benchmarks/day_long.py --hours "
            f"{chosen.hours:g} --rate {chosen.rate:g}`: the whole program on the "
            "built-in bench, as fast as it computes; four channels, of which V_C1, "
            "V_C2 and (in the hold) the coil current are stored. Memory is that of the "
            "process as each simulated hour has passed; `growth` is the median of the "
            "later half of the hours less that of the earlier one; `with report` is "
            "the most it ever had, its report written.",
            "",
            "| run | h | first hour, MB | middle, MB | last, MB | growth, MB "
            "| with report, MB | folder, MB | spikes | lost | end |",
            "|---|---|---|---|---|---|---|---|---|---|---|",
            *rows,
            "",
        ]
    )
    tell(text, chosen.out)
    return 0 if flat else 1


if __name__ == "__main__":
    sys.exit(main())
