"""Every shipped scene on the simulated bench: how many times real time.

Run alone: ``.venv/bin/python tests/benchmarks/protocol_speed.py [scene ...]
[--out docs/protocol-figures.md]``. Exit code 1 if one is slower than 10 times.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

from provenance import provenance

from tactile_lab.engine.execution import Execution
from tactile_lab.plugins import scene_names
from tactile_lab.report.from_run import read
from tactile_lab.report.write import write
from tactile_lab.scene.load import load

GOAL = 10.0
"""Experiment over run, at least; the report is written afterwards."""
HEAD = """\
| scene | experiment | streamed | run | times real time | streamed | report | CPU |
|---|---|---|---|---|---|---|---|
"""


def measure(name: str) -> tuple[str, float]:
    """A row of the table, and how many times real time the scene runs."""
    cpu = time.process_time()
    with tempfile.TemporaryDirectory() as scratch:
        execution = Execution(load(name), Path(scratch))
        done = execution.run()
        if done.exit_code:
            raise SystemExit(f"{name} ended as {done.state}: {done}")
        began = time.monotonic()
        write(done.folder, read(done.folder))
        report = time.monotonic() - began
    cpu = time.process_time() - cpu
    speed, streamed = done.duration / done.took, execution.plan.timeline.streamed
    row = (
        f"| {name} | {done.duration:.1f} s | {streamed:.1f} s | {done.took:.2f} s | "
        f"{speed:.0f} | {streamed / done.took:.0f} | {report:.2f} s | {cpu:.2f} s |"
    )
    return row, speed


def main() -> None:
    """Print the table, or write it."""
    parser = argparse.ArgumentParser()
    parser.add_argument("scenes", nargs="*", default=None)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    measure("spikes_only")  # compiled code is loaded once
    rows, slow = [], []
    for name in options.scenes or scene_names():
        row, speed = measure(name)
        print(row, flush=True)
        rows.append(row)
        if speed < GOAL:
            slow.append(name)
    if options.out is not None:
        options.out.write_text(
            "# Speed of the protocols\n\n"
            f"{provenance()}. Made by `tests/benchmarks/protocol_speed.py`: each "
            "scene that ships, whole, on the simulated bench, every sample stored. "
            "`streamed`: without planned pauses, in s and in times real time. CPU "
            "includes plan and report.\n\n" + HEAD + "\n".join(rows) + "\n",
            encoding="utf-8",
        )
    if slow:
        sys.exit(f"slower than {GOAL:g} times real time: {', '.join(slow)}")


if __name__ == "__main__":
    main()
