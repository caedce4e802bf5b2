"""A run of 1e9 samples opened in the window and zoomed through, as a person would.

    python tests/benchmarks/window_record.py [MILLIONS] [--pictures FOLDER]

The run is a real one of the simulated bench: pulses at 4 x 1 MS/s until there are so
many samples, stored as every run is. Opening is timed from the click to the lanes; then
the wheel zooms about one spike from the whole run to 100 us and back, one notch a
frame, and the view is dragged through the run at several widths. Frames and gaps are
those of `window_frames.py`.
"""

import argparse
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
from PySide6.QtCore import QTimer
from window_frames import Bench, memory

from gui.app import begin
from gui.lanes.stored import RunSource
from gui.state import WindowState
from tactile_lab.engine.execution import Execution
from tactile_lab.engine.request import Request

PULSE = 4.5
"""One pulse of the scene with its ramps and its rest, s."""

SAMPLED = 4e6
"""Samples a second, all channels."""

NOTCH = 1.25
"""Zoom of one notch of the wheel."""

NARROW = 1e-4
"""Narrowest view, s."""


def record(millions: float, out: Path) -> tuple[Path, str]:
    """Make the run; its folder, and what it holds."""
    pulses = max(1, round(millions * 1e6 / SAMPLED / PULSE))
    levels = ", ".join(f'"{90 + 10 * (n % 8)} mN"' for n in range(pulses))
    request = Request("demo", (f"protocol.levels=[{levels}]",), "sim")
    done = Execution(request.load(), out, realtime=False).run()
    samples = SAMPLED * done.duration
    return done.folder, f"A run of {samples:,.0f} samples with {done.spikes} spikes"


def opened(bench: Bench, folder: Path, what: str) -> RunSource:
    """Open the run from the browser and wait for the lanes."""
    screen = bench.window.screen_
    bench.clear()
    before, begun = memory(), time.perf_counter()
    screen.open_run(folder)
    bench.until(lambda: isinstance(screen.run, RunSource), 60)
    took = time.perf_counter() - begun
    bench.say(f"{what}: in the lanes after {took:.2f} s, {memory() - before:.0f} MB.")
    bench.report("opening")
    assert isinstance(screen.run, RunSource)
    return screen.run


def zoomed(bench: Bench, source: RunSource, pictures: Path | None) -> None:
    """Zoom about a spike to `NARROW` and back, a notch a frame; then drag."""
    view = bench.window.centre.view
    spikes = source.spikes  # a short run has none
    spike = float(spikes[spikes.size // 2]) if spikes.size else source.length / 2
    view.show_all()
    bench.measure("whole run", 2.0)
    shoot(bench, pictures, "whole")
    turns = int(np.log(source.length / NARROW) / np.log(NOTCH))
    for name, factor in (("zoomed in", NOTCH), ("zoomed out", 1 / NOTCH)):
        left = turns
        wheel = QTimer()

        def turn(factor: float = factor) -> None:
            nonlocal left
            left -= 1
            view.zoom(factor, spike)

        wheel.timeout.connect(turn)
        bench.clear()
        wheel.start(33)
        bench.until(lambda: left <= 0, 60)  # noqa: B023  the loop waits for it
        wheel.stop()
        bench.report(f"{name}, {turns} notches")
        if factor > 1:
            sharp(bench, pictures)
    for width in (60.0, 1.0, 0.01):
        view.show_span(spike, width)
        drag = QTimer()
        drag.timeout.connect(lambda width=width: view.pan(0.05 * width))
        drag.start(33)
        bench.measure(f"dragged, {width:g} s wide", 3.0)
        drag.stop()
        shoot(bench, pictures, f"wide_{width:g}")


def sharp(bench: Bench, pictures: Path | None) -> None:
    """The time until the samples of the narrowest view are there."""
    begun = time.perf_counter()
    bench.until(lambda: all(t.name != "zoom" for t in threading.enumerate()), 30)
    took = 1e3 * (time.perf_counter() - begun)
    bench.say(f"The samples of the narrowest view are there after {took:.0f} ms more.")
    shoot(bench, pictures, "narrow")


def shoot(bench: Bench, folder: Path | None, name: str) -> None:
    if folder is not None:
        bench.until(lambda: False, 0.5)
        bench.window.grab().save(str(folder / f"{name}.png"))


def main() -> None:
    """Record, open, zoom; print what it cost."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("millions", type=float, nargs="?", default=1000)
    parser.add_argument("--pictures", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as out:
        folder, what = record(options.millions, Path(out))
        bench = Bench(Path(out))
        session = bench.session
        begin(bench.window, None, "sim")
        bench.until(
            lambda: session.state is WindowState.READY and session.plan.expectation, 120
        )
        bench.measure("idle", 3.0)
        source = opened(bench, folder, what)
        zoomed(bench, source, options.pictures)
        bench.window.close()
        session.close()


if __name__ == "__main__":
    main()
