"""What the frames of one run cost the window's own thread, however busy the computer.

    python tests/benchmarks/window_replay.py FILE [SECONDS]

Replays what the engine told of a run of the demo in real time, kept in FILE, a 30th of
a second of it to a frame; where there is no such file the run is made first. In turn
with another checkout, from the same file, it compares the two on a computer that does
much else: `PYTHONPATH=OTHER python OTHER/tests/benchmarks/window_replay.py FILE`. The
first second is left out. Frames that had no lane to paint count in the sum alone.
"""

import os
import pickle
import sys
import tempfile
import time
from pathlib import Path
from typing import cast

import numpy as np
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QApplication
from window_frames import Bench

from gui.app import begin
from gui.state import WindowState
from tactile_lab.engine.events import Ended, Samples, TaskEvent
from tactile_lab.engine.link import RemoteTask

FRAME, FIRST = 1 / 30, 30
"""Run time of a frame, s; frames that are left out, of the beginning."""


class Nobody:
    """Where the task would be that is replayed: it hears and does nothing."""

    def stop(self, reason: str) -> None:
        """Nothing."""

    def say(self, *what: object) -> None:
        """Nothing."""


def ready(bench: Bench) -> None:
    """Have the demo planned and the simulated bench connected."""
    session = bench.session
    begin(bench.window, "demo", None)
    bench.until(lambda: session.plan.expectation, 240)
    session.connect_bench("sim")
    bench.until(lambda: session.state is WindowState.READY, 240)


def record(bench: Bench, file: Path) -> None:
    """Run the demo, and keep what was told of it."""
    run, kept = bench.session.run, list[TaskEvent]()
    hear = run.take

    def keep(event: TaskEvent) -> None:
        kept.append(event)
        hear(event)

    run.take = keep  # type: ignore[method-assign]
    bench.window.setup.start()
    bench.until(lambda: kept and not bench.session.busy, 120)
    run.take = hear  # type: ignore[method-assign]
    file.write_bytes(pickle.dumps(kept))


def timed(events: list[TaskEvent]) -> list[tuple[float, TaskEvent]]:
    """Each event with the run time that the samples told before it had reached, s."""
    reach, found = 0.0, []
    for event in events:
        if isinstance(event, Samples) and event.bins:
            reach = max(part.end for part in event.bins.values())
        found.append((reach, event))
    return [one for one in found if not isinstance(one[1], Ended)]


def replay(bench: Bench, events: list[TaskEvent], seconds: float) -> None:
    """Print what each frame took, ms of the thread's processor time."""
    session, run = bench.session, bench.session.run
    run.expectation, run.title = session.plan.expectation, "demo"
    run.task = cast(RemoteTask, Nobody())
    session.status.enter(WindowState.RUNNING)
    waiting, lanes, rest = timed(events), bench.window.centre.stack.scene, 0.0
    painted: list[int] = []
    lanes.drawn.connect(lambda: painted.append(1))
    cost, drew = [], []
    for number in range(round(seconds / FRAME)):
        while waiting and waiting[0][0] <= number * FRAME:
            session.link._inbox.put((run.take, waiting.pop(0)[1]))
        painted.clear()
        begun = time.thread_time()
        bench.window.frames.tick()
        QApplication.sendPostedEvents(None, QEvent.Type.UpdateRequest)
        cost.append(1e3 * (time.thread_time() - begun))
        drew.append(bool(painted) or bench.window.frames.behind)
        begun = time.thread_time()
        bench.app.processEvents()
        rest += 1e3 * (time.thread_time() - begun) * (number >= FIRST)
    used, drawn = np.array(cost[FIRST:]), np.array(drew[FIRST:])
    median, p99 = np.percentile(used[drawn], [50, 99])
    print("| frames | painted | median, ms | p99, ms | all, ms a frame | load |")
    print("|---|---|---|---|---|---|")
    print(
        f"| {used.size} | {drawn.sum()} | {median:.1f} | {p99:.1f} | "
        f"{(used.sum() + rest) / used.size:.1f} | {os.getloadavg()[0]:.0f} |"
    )


def main(file: Path, seconds: float) -> None:
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as out:
        bench = Bench(Path(out))
        ready(bench)
        if not file.exists():
            record(bench, file)
            bench.until(lambda: bench.session.state is WindowState.READY, 120)
        bench._timer.stop()
        replay(bench, pickle.loads(file.read_bytes()), seconds)
        bench.session.run.task = None
        bench.session.close()
        sys.stdout.flush()
        os._exit(0)  # what is half replayed ends in no order


if __name__ == "__main__":
    main(Path(sys.argv[1]), float(sys.argv[2]) if len(sys.argv) > 2 else 10.0)
