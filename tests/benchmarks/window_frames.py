"""What a frame of the window costs, with the figures the window's issue asks for.

    python tests/benchmarks/window_frames.py [SECONDS] [--scale FACTOR]

Idle, a run in real time on the simulated bench, an emulated input of 4 x 7.8125 MS/s,
and an hour-long record at 1 MS/s scrolled and zoomed. A frame is the poll plus the
painting it causes, in the window's own thread; "processor" is its own time, which
other programs on the machine do not change. All lanes are painted in every frame but
those of the run in real time: there the window paints where something was told, and
frames that had nothing to paint are left out. Numbers are shown ten times a second
halfway between two frames, and have a row of their own. Gaps are those of a 10 ms
heartbeat; "of its own" leaves out the time in which Linux gave the processor to
somebody else. The window has 1720 x 1080 px; with `--scale`, so many device pixels to
each.

`window_figures.py` puts this and its neighbours into one page.
"""

import argparse
import os
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
from PySide6.QtCore import QEvent, QEventLoop, QTimer
from PySide6.QtWidgets import QApplication

from gui.app import application, begin
from gui.garbage import collected_here
from gui.lanes.expected import Stretch
from gui.lanes.live import LiveSource
from gui.look.theme import Theme
from gui.session.session import Session
from gui.state import WindowState
from gui.window import Window
from tactile_lab.acquisition.ending import CoilState
from tactile_lab.acquisition.live import LiveBins
from tactile_lab.engine.events import Samples, TaskEvent
from tactile_lab.scope import Block, Channel, Stream
from tactile_lab.trace import Trace

SLEEPING = QEventLoop.ProcessEventsFlag.WaitForMoreEvents
"""As the program itself: to ask 1000 times a second would count as the window's."""

OFF = CoilState(False, None, None, None)
SIGNALS = ("V_C1", "V_C2", "V_K", "coil_current")
HEAD = (
    "| stretch | frames | median, ms | p99, ms | processor, ms | its p99 "
    "| longest gap, ms | of its own |\n|---|---|---|---|---|---|---|---|"
)


class Bench:
    """The window with stop-watches; `how` the session drives its benches."""

    def __init__(self, out: Path, **how: bool) -> None:
        sys.setswitchinterval(1e-3)
        self.app = application([])
        theme = Theme("light")
        theme.apply()
        self.session = Session(out, **how)
        self.session.run.reports = False
        self.window = Window(self.session, theme)
        self.window.resize(1720, 1080)
        self.window.show()
        self._collected = collected_here()
        self._collected.__enter__()  # as in the program, to the end of this process
        self.frames: list[float] = []
        self.used: list[float] = []
        self.numbers: list[tuple[float, float]] = []
        self.gaps: list[float] = []
        self.own: list[float] = []
        self._reported = False
        self.each = True  # every frame paints
        self._painted = False
        self.window.centre.stack.scene.drawn.connect(self._note_painting)
        self._last, self._waited = time.perf_counter(), _waited()
        self._beat = QTimer()
        self._beat.timeout.connect(self._note)
        self._beat.start(10)
        self.window.frames.stop()
        self._timer = QTimer()
        self._timer.timeout.connect(self._frame)
        self._timer.start(33)
        between = self.window.frames.between
        between.timeout.disconnect()
        between.timeout.connect(self._number)

    def _number(self) -> None:
        begun, used = time.perf_counter(), time.thread_time()
        self.window.frames.show_numbers()
        QApplication.sendPostedEvents(None, QEvent.Type.UpdateRequest)
        now = time.perf_counter(), time.thread_time()
        self.numbers.append((now[0] - begun, now[1] - used))

    def _note(self) -> None:
        now, waited = time.perf_counter(), _waited()
        self.gaps.append(now - self._last)
        self.own.append(now - self._last - (waited - self._waited))
        self._last, self._waited = now, waited

    def _frame(self) -> None:
        self._painted = False
        begun, used = time.perf_counter(), time.thread_time()
        self.window.frames.tick()
        if self._timer.interval() != self.window.frames.interval:
            self._timer.setInterval(self.window.frames.interval)
        if self.each:
            self.window.centre.stack.refresh()
        QApplication.sendPostedEvents(None, QEvent.Type.UpdateRequest)
        if self._painted or self.window.frames.behind:
            self.frames.append(time.perf_counter() - begun)
            self.used.append(time.thread_time() - used)

    def _note_painting(self) -> None:
        self._painted = True

    def until(self, done: Callable[[], object], longest: float) -> None:
        end = time.monotonic() + longest
        while not done() and time.monotonic() < end:
            self.app.processEvents(SLEEPING)

    def measure(self, name: str, seconds: float) -> None:
        self.clear()
        end = time.monotonic() + seconds
        self.until(lambda: time.monotonic() > end, seconds + 1)
        self.report(name)

    def clear(self) -> None:
        for kept in (self.frames, self.used, self.numbers, self.gaps, self.own):
            kept.clear()
        self._last, self._waited = time.perf_counter(), _waited()

    def report(self, name: str) -> None:
        if not self._reported:
            print(HEAD)
        self._reported = True
        gap = 1e3 * max(self.gaps, default=float("nan"))
        own = 1e3 * max(self.own, default=float("nan"))
        print(f"| {name} | {_spread(self.frames, self.used)} | {gap:.0f} | {own:.0f} |")
        numbers = list(zip(*self.numbers, strict=True))
        if numbers:
            print(f"| · its numbers, between | {_spread(*numbers)} | | |")

    def say(self, text: str) -> None:
        """A sentence between the tables."""
        print(f"\n{text}\n")
        self._reported = False


def emulated(
    tell: Callable[[TaskEvent], None], seconds: float, rate: float = 7.8125e6
) -> threading.Thread:
    """Decimate four channels at `rate` as the runner does, in this very process."""
    live = LiveBins()
    channels = tuple(Channel(signal=s, input=s, range=5.0) for s in SIGNALS)
    stream = Stream(
        channels=channels, interval=1 / rate, full_scale=32512, shift=8,
        started=0.0, uncertainty=0.0,
    )  # fmt: skip
    count = int(rate * 0.05)
    rng = np.random.default_rng(1)
    codes = (rng.integers(-2, 3, (4, count)) * 256).astype(np.int16)
    codes[2, ::50_000] = 20_000

    def work() -> None:
        live.begin(stream, 0.0)
        seen, begun = 0, time.monotonic()
        for number in range(int(seconds / 0.05)):
            live.add(Block(number * count, codes, (False,) * 4, 0.0))
            seen, fresh = live.fresh(seen)
            tell(Samples(fresh, OFF))
            ahead = begun + (number + 1) * 0.05 - time.monotonic()
            if ahead > 0:
                time.sleep(ahead)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    return thread


def hour(source: LiveSource) -> None:
    """Fill a source with an hour at 1 MS/s, as its 1 ms bins."""
    rng = np.random.default_rng(2)
    for first in range(0, 3_600_000, 100_000):
        time_ = np.float64(1e-3) * np.arange(first, first + 100_000)
        for signal in SIGNALS:
            mean = (np.sin(time_) + rng.normal(0, 0.05, time_.size)).astype(np.float32)
            bins = Trace.bins(time_, mean - 0.05, mean + 0.05, mean, 1e-3)
            source.add_bins({signal: bins})
    source.add_spikes(tuple(np.sort(rng.uniform(0, 3600, 36_000)).tolist()))


def _spread(cost: Sequence[float], used: Sequence[float]) -> str:
    """How many, then median and p99 of what they took and of the processor time, ms."""
    each = (1e3 * np.array(of or [np.nan]) for of in (cost, used))
    told = [f"{np.percentile(of, q):.1f}" for of in each for q in (50, 99)]
    return " | ".join([str(len(cost)), *told])


def _waited() -> float:
    """Time the window's thread has waited for a processor so far, s."""
    try:
        return int(Path("/proc/thread-self/schedstat").read_text().split()[1]) / 1e9
    except OSError:
        return 0.0


def lived() -> float:
    """Time since this process was started, s."""
    ticks = int(Path("/proc/self/stat").read_text().rpartition(")")[2].split()[19])
    up = float(Path("/proc/uptime").read_text().split()[0])
    return up - ticks / os.sysconf("SC_CLK_TCK")


def memory(pid: int | str = "self") -> float:
    """Resident memory of a process, MB."""
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1024
    return float("nan")


def shares(engine: int | None) -> tuple[float, float, float]:
    """The clock, and the processor time of this process and of the engine, s."""
    both = []
    for pid in ("self", engine):
        times = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        both.append(sum(map(int, times[11:13])) / os.sysconf("SC_CLK_TCK"))
    return time.monotonic(), both[0], both[1]


def main(seconds: float) -> None:
    with tempfile.TemporaryDirectory() as out:
        bench = Bench(Path(out))
        session, window = bench.session, bench.window
        begin(window, None, None)
        bench.app.processEvents()
        bench.say(f"A usable window {lived():.2f} s after the start of Python.")
        bench.until(lambda: session.plan.expectation, 120)
        bench.clear()
        session.connect_bench("sim")
        bench.until(lambda: session.state is WindowState.READY, 120)
        bench.report("connect")
        bench.measure("idle", seconds)
        window.setup.start()
        bench.until(lambda: session.source is not None, 30)
        bench.each = False
        before = shares(session.link.pid)
        bench.measure("run in real time, simulated bench", min(seconds, 12.0))
        after = shares(session.link.pid)
        took, drawn = after[0] - before[0], len(bench.frames)
        parts = [100 * (b - a) / took for a, b in zip(before, after, strict=True)]
        bench.say(
            f"In the run the window took {parts[1]:.0f} % of a core, the engine "
            f"{parts[2]:.0f} %; {drawn / took:.0f} pictures a second."
        )
        bench.each = True
        session.stop("benchmark")
        bench.clear()
        bench.until(lambda: not session.busy, 20)
        bench.report("abort")
        bench.clear()
        bench.until(lambda: window.screen_.run is not None, 20)
        bench.until(lambda: False, 2.0)
        bench.report("its record takes its place")
        window.screen_.close_run()
        bench.until(lambda: session.state is not WindowState.ABORTING, 20)
        session.source = source = LiveSource(None, 0.2)
        source.holds.append(Stretch(0.0, 1e9, "emulated"))
        window.centre.stack.show_source(source)
        window.centre.view.set_follow(True)
        session.run.source = source
        heard = session.link._inbox.put
        emulated(lambda told: heard((session.run.take, told)), seconds + 0.5)
        bench.until(lambda: source.reach > 0.2, 5)
        bench.measure("4 x 7.8125 MS/s emulated", seconds)
        session.source = source = LiveSource(None, 0.2)
        empty = memory()
        hour(source)
        bench.say(f"An hour at 4 x 1 MS/s takes {memory() - empty:.0f} MB.")
        window.centre.stack.show_source(source)
        window.centre.view.set_now(3600.0, 3600.0)
        window.centre.view.show_all()
        bench.measure("an hour, whole", seconds / 2)
        scroll = QTimer()
        scroll.timeout.connect(lambda: window.centre.view.pan(0.05))
        window.centre.view.show_span(3500.0, 5.0)
        scroll.start(33)
        bench.measure("an hour, 5 s scrolled", seconds / 2)
        scroll.stop()
        window.close()
        session.close()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seconds", type=float, nargs="?", default=6.0)
    parser.add_argument("--scale", default=os.environ.get("QT_SCALE_FACTOR", "1"))
    options = parser.parse_args()
    os.environ["QT_SCALE_FACTOR"] = options.scale
    main(options.seconds)
