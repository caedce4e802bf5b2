"""Every shipped protocol's scene on the simulated bench: how many times real time.

Run alone: ``.venv/bin/python tests/benchmarks/protocol_speed.py [scene ...]``.
"""

import sys
import tempfile
import time
from pathlib import Path

from tactile_lab.acquisition.execution import Execution
from tactile_lab.plugins import scene_names
from tactile_lab.report.from_run import read
from tactile_lab.report.write import write
from tactile_lab.scene.load import load


def main() -> None:
    """Print one row per scene."""
    print("| scene | experiment | run | report | times real time |")
    print("|---|---|---|---|---|")
    for name in sys.argv[1:] or scene_names():
        with tempfile.TemporaryDirectory() as scratch:
            done = Execution(load(name), Path(scratch)).run()
            began = time.monotonic()
            write(done.folder, read(done.folder))
            report = time.monotonic() - began
        speed = done.duration / done.took
        print(
            f"| {name} | {done.duration:.1f} s | {done.took:.2f} s | {report:.2f} s | "
            f"{speed:.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
