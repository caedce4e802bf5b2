"""How long STOP takes, by parts, until the window says that the coil is verified off.

    python tests/benchmarks/window_stop.py [STOPS] [--answer MS] [--force MN]

A source behind a port of its own takes MS to answer a line (5 unless told) and bytes no
time, and is its own witness: when it was told what. The window runs offscreen with its
engine apart, as in life, holds the force and is stopped by a click. The rated row is a
Kepco BOP at 9600 Bd that takes 10 ms, as on the built-in simulated bench. Times are of
the clock; the lines said to the source, and the processor time of the window's thread
and of the engine in between, do not depend on what else the machine does.
"""

import argparse
import json
import math
import os
import tempfile
import time
from dataclasses import dataclass
from importlib import resources
from itertools import pairwise
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
from window_frames import Bench

from gui.app import begin
from gui.state import CoilKnowledge, WindowState
from sim_backend.serve import ServedBench

BENCH = """
name = "STOP"
simulated = false
[coil]
dialect = "source.toml"
port = "{port}"
[magnet]
r = "6 mm"
"""
SCENE = """
[protocol]
name = "pulses"
levels = ["{force:g} mN"]
hold = "600 s"
[record]
signals = ["force"]
"""
SLEW = 5.0
"""Of the bench file's limits, where they are not given, A/s."""

HEAD = (
    "| source | stops | click to first step | ramp | to output off | to read back and "
    "said | in all | most | slew allows | steps | processor, window | engine |\n"
    "|---|---|---|---|---|---|---|---|---|---|---|---|"
)


@dataclass(frozen=True)
class Stopped:
    """Times of one STOP, s, and what it cost."""

    heard: float
    ramp: float
    off: float
    said: float
    least: float
    steps: int
    window: float
    engine: float

    @property
    def whole(self) -> float:
        """From the click to the words."""
        return self.heard + self.ramp + self.off + self.said


def used(pid: int) -> float:
    """Processor time of a process so far, s."""
    times = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return sum(map(int, times[11:13])) / os.sysconf("SC_CLK_TCK")


class Source:
    """The source at its port, and the file of what it was told."""

    def __init__(self, folder: Path, answer: float | None) -> None:
        rows = resources.files("tactile_lab.instruments").joinpath("rows", "coil")
        row = rows.joinpath("kepco-bop.toml").read_text()
        if answer is not None:
            row = row.replace("[serial]", f'[serial]\nlatency = "{1e3 * answer:g} ms"')
        row = row.replace("[serial]", '[serial]\ntimeout = "0.8 s"')
        (folder / "source.toml").write_text(row)
        self._log = folder / "told.jsonl"
        self.served = ServedBench(
            coil="pty", coil_row=str(folder / "source.toml"), paced=True,
            baud=None if answer is None else 4_000_000, log=self._log,
        )  # fmt: skip
        self.served.start()
        bench = BENCH.format(port=self.served.addresses["coil"])
        if answer is not None:
            bench = bench.replace("[magnet]", "baud = 4000000\n[magnet]")
        self.bench = folder / "bench.toml"
        self.bench.write_text(bench)

    def told(self) -> list[tuple[float, str, float]]:
        """When it was told what, oldest first."""
        lines = self._log.read_text().splitlines()
        each = map(json.loads, lines)
        return [(one["monotonic_s"], one["what"], one["value"]) for one in each]

    @property
    def current(self) -> float:
        """Set-point it was given last, A."""
        return [value for _, what, value in self.told() if what == "set"][-1]


def stopped(bench: Bench, source: Source, current: float) -> Stopped:
    """Hold the force, click STOP, and see when what came."""
    session, window = bench.session, bench.window
    assert session.link.pid is not None
    window.setup.start()
    bench.until(lambda: source.current >= 0.99 * current, 60)
    bench.until(lambda: False, 0.5)
    own, engine = time.thread_time(), used(session.link.pid)
    click = time.monotonic()
    window.header.stop.click()
    bench.until(lambda: window.header.stop.truth is CoilKnowledge.OFF, 30)
    said = time.monotonic()
    cost = time.thread_time() - own, used(session.link.pid) - engine
    told = [one for one in source.told() if one[0] >= click]
    steps = [one for one in told if one[1] == "set"]
    off = next(at for at, what, value in told if what == "output" and not value)
    zero = next(at for at, _, value in steps if value == 0.0)
    for (a, _, before), (b, _, after) in pairwise(steps):
        assert abs(after - before) <= 1.05 * SLEW * (b - a) + 1e-3 or after == 0.0
    bench.until(lambda: session.state is WindowState.READY, 60)
    bench.until(lambda: not session.busy, 60)
    return Stopped(
        heard=steps[0][0] - click, ramp=zero - steps[0][0], off=off - zero,
        said=said - off, least=current / SLEW, steps=len(steps),
        window=cost[0], engine=cost[1],
    )  # fmt: skip


def row(name: str, answer: float | None, times: int, force: float) -> str:
    """The table's row of one source."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        source = Source(folder, answer)
        scene = folder / "scene.toml"
        scene.write_text(SCENE.format(force=force))
        bench = Bench(folder / "runs")
        session = bench.session
        begin(bench.window, str(scene), str(source.bench))
        bench.until(
            lambda: session.state is WindowState.READY and session.plan.expectation, 120
        )
        current = 5e-3 * force * 1.0
        found = [stopped(bench, source, current) for _ in range(times)]
        bench.window.close()
        session.close()
        source.served.close()

    def middle(part: str) -> str:
        return f"{1e3 * float(np.median([getattr(one, part) for one in found])):.0f}"

    parts = [middle(part) for part in ("heard", "ramp", "off", "said", "whole")]
    most = f"{1e3 * max(one.whole for one in found):.0f}"
    steps = math.ceil(np.median([one.steps for one in found]))
    cells = [name, times, *parts, most, middle("least"), steps]
    return f"| {' | '.join(map(str, [*cells, middle('window'), middle('engine')]))} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("stops", type=int, nargs="?", default=10)
    parser.add_argument("--answer", type=float, default=5.0)
    parser.add_argument("--force", type=float, default=100.0)
    options = parser.parse_args()
    print(f"All in ms but the steps; STOP at {options.force:g} mN.\n\n{HEAD}")
    for name, answer in (
        (f"answers in {options.answer:g} ms", 1e-3 * options.answer),
        ("9600 Bd, answers in 10 ms", None),
    ):
        print(row(name, answer, options.stops, options.force), flush=True)


if __name__ == "__main__":
    main()
