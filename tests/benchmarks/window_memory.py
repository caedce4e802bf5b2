"""Memory of all processes of the window together, over many runs.

    python tests/benchmarks/window_memory.py [RUNS] [--realtime]

The demo is run again and again, 18 s each, on the simulated clock unless told; 200 of
them are an hour. Now and then a row tells the proportional set size (PSS) of the
window, of the engine and the desk beside it, and of what else they started, as what
both are forked from: what processes share is counted once. "Shared" is the part of the
sum in such pages, as of libraries, and "anonymous" what processes wrote: the rest is
code that the system has in its file cache anyway. Other programs that use the same
libraries make the sum less, not that part. The last row is of half a minute later, when
the desk has gone to rest.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from window_frames import Bench


HEAD = (
    "| runs | window | engine | desk | others | all, PSS | of it shared | anonymous |\n"
    "|---|---|---|---|---|---|---|---|"
)


def set_sizes(pid: int | str) -> dict[str, float]:
    """Resident, proportional, private ... memory of a process, MB."""
    text = Path(f"/proc/{pid}/smaps_rollup").read_text()
    rows = (line.split() for line in text.splitlines()[1:])
    return {name.rstrip(":"): int(size) / 1024 for name, size, *_ in rows}


def children(pid: int) -> list[int]:
    """Processes that it started, and those that they did."""
    tasks = Path(f"/proc/{pid}/task").glob("*/children")
    found = [int(one) for task in tasks for one in task.read_text().split()]
    return [*found, *(grand for one in found for grand in children(one))]


def row(bench: Bench, runs: int) -> str:
    """The table's row after so many runs."""
    session, own = bench.session, os.getpid()
    sizes = {}
    for pid in [own, *children(own)]:
        with suppress(FileNotFoundError, ProcessLookupError):  # it has just ended
            sizes[pid] = set_sizes(pid)
    named = {own: "window", session.link.pid: "engine", session.desk.pid: "desk"}
    parts = dict.fromkeys(("window", "engine", "desk", "others"), 0.0)
    for pid, size in sizes.items():
        parts[named.get(pid, "others")] += size["Pss"]
    whole = sum(parts.values())
    private = sum(one["Private_Clean"] + one["Private_Dirty"] for one in sizes.values())
    written = sum(one["Pss_Anon"] for one in sizes.values())
    cells = [*parts.values(), whole, whole - private, written]
    return f"| {runs} | {' | '.join(f'{cell:.0f}' for cell in cells)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", type=int, nargs="?", default=200)
    parser.add_argument("--realtime", action="store_true")
    options = parser.parse_args()
    # not above: engine and desk load this file as they start, and would load the window
    from window_frames import Bench

    from gui.app import begin
    from gui.state import WindowState
    from tactile_lab.engine.memory import map_large, share_heap

    share_heap()
    map_large()
    told = {2**n for n in range(10)} | {options.runs}
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(Path(folder), realtime=options.realtime)
        session = bench.session
        begin(bench.window, None, "sim")
        bench.until(
            lambda: session.state is WindowState.READY and session.plan.expectation, 120
        )
        print(HEAD)
        print(row(bench, 0), flush=True)
        for number in range(1, options.runs + 1):
            bench.window.setup.start()
            bench.until(lambda: session.state is not WindowState.READY, 10)
            bench.until(lambda: session.state is WindowState.READY, 300)
            bench.until(lambda: not session.busy, 60)
            bench.clear()  # else its stop-watches keep 0.2 MB of a run in real time
            if number in told:
                bench.until(lambda: False, 5)
                print(row(bench, number), flush=True)
        desk = session.desk.pid
        bench.until(lambda: desk not in children(os.getpid()), 300)
        print(row(bench, options.runs), flush=True)
        bench.window.close()
        session.close()


if __name__ == "__main__":
    main()
