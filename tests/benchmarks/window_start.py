"""How long the window takes until it can be used, and until its bench is ready.

    python tests/benchmarks/window_start.py [STARTS] [--beside CHECKOUT]

The program itself is started, offscreen, on the built-in simulated bench; with another
checkout beside it both in turn, so that their ratio holds on a busy machine, too. Times
are from the start of Python: until the window can be used, until its bench is READY and
until what the form asks for is planned. Processor times are of the window's process
until it can be used, and of all processes in the end. The first start of each is not
counted.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

WATCHED = """
import json, os, sys, time
from pathlib import Path

def lived():
    ticks = Path("/proc/self/stat").read_text().rpartition(")")[2].split()[19]
    up = float(Path("/proc/uptime").read_text().split()[0])
    return up - int(ticks) / os.sysconf("SC_CLK_TCK")

def used(pid):
    try:
        times = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        below = [int(one) for task in Path(f"/proc/{pid}/task").iterdir()
                 for one in (task / "children").read_text().split()]
    except FileNotFoundError:  # it ended just now
        return 0.0
    own = sum(map(int, times[11:13])) / os.sysconf("SC_CLK_TCK")
    return own + sum(map(used, below))

def watch():
    from PySide6.QtCore import QTimer
    import gui.app as app

    begin, found = app.begin, {}

    def watched(window, *rest):
        begin(window, *rest)
        found.update(usable=lived(), window=time.process_time())
        timer, session = QTimer(window), window.session

        def look():
            if session.state.value == "ready" and "ready" not in found:
                found["ready"] = lived()
            if session.plan.expectation is not None and "planned" not in found:
                found["planned"] = lived()
            if {"ready", "planned"} <= found.keys():
                timer.stop()
                print(json.dumps({**found, "all": used(os.getpid())}), flush=True)
                window.close()

        timer.timeout.connect(look)
        timer.start(5)

    app.begin = watched

if __name__ == "__main__":
    import gui.command as verb

    lab = verb.lab

    def known():  # asked for once the window's own modules are there
        watch()
        return lab()

    verb.lab = known
    sys.argv = ["tactile-lab", "gui", "demo", "--bench", "sim", "--out", sys.argv[1]]
    from tactile_lab.cli import main
    main()
"""
PARTS = ("usable", "window", "ready", "planned", "all")
HEAD = (
    "| checkout | starts | usable, s | its processor | READY, s | planned, s "
    "| processor, all |\n|---|---|---|---|---|---|---|"
)


def start(checkout: Path, folder: Path) -> dict[str, float]:
    """Start a checkout's window once; what it took, s."""
    script = folder / "watched.py"
    script.write_text(WATCHED)
    python = checkout / ".venv" / "bin" / "python"
    told = subprocess.run(
        [python if python.exists() else sys.executable, script, folder / "runs"],
        stdout=subprocess.PIPE, text=True, check=True, timeout=300, cwd=folder,
        env={
            **os.environ, "QT_QPA_PLATFORM": "offscreen",
            "XDG_CONFIG_HOME": str(folder), "PYTHONPATH": str(checkout),
        },
    )  # fmt: skip
    found: dict[str, float] = json.loads(told.stdout.splitlines()[-1])
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("starts", type=int, nargs="?", default=6)
    parser.add_argument("--beside", type=Path)
    options = parser.parse_args()
    here = Path(__file__).resolve().parents[2]
    checkouts = [here] if options.beside is None else [here, options.beside.resolve()]
    taken: dict[Path, list[dict[str, float]]] = {one: [] for one in checkouts}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(options.starts + 1):
            for checkout in checkouts:
                taken[checkout].append(start(checkout, Path(folder)))
    print(HEAD)
    for name, found in zip(("this", "beside"), taken.values(), strict=False):
        middle = [np.median([one[part] for one in found[1:]]) for part in PARTS]
        cells = [f"{value:.2f}" for value in middle]
        print(f"| {name} | {options.starts} | {' | '.join(cells)} |")
    if len(checkouts) == 2:
        ratios = [
            np.median([a[part] / b[part] for a, b in zip(*pairs, strict=True)])
            for pairs in [[one[1:] for one in taken.values()]]
            for part in PARTS
        ]
        print(f"| ratio | | {' | '.join(f'{ratio:.2f}' for ratio in ratios)} |")


if __name__ == "__main__":
    main()
