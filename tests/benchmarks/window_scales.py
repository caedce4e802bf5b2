"""What the lanes alone cost a frame, on screens that are scaled.

    python tests/benchmarks/window_scales.py [--scales 1 1.25 1.5 2] [--rounds 3]
                                             [--beside PYTHON] [--out FILE]

Each scale in a process of its own: seven lanes of 1720 x 1080, a run as it comes in
(5 s that move), the whole of it, and the whole of an hour. `--beside` names the Python
of another checkout to draw the same frames with, in turn, so that what else the
machine does falls on both alike. Figures are the processor time of the window's own
thread, ms a frame, medians of the frames and of the rounds.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from provenance import provenance, tell

if TYPE_CHECKING:
    from gui.lanes.live import LiveSource

FRAMES = 60
LONGEST = 10.0
"""Seconds after which a stretch has enough frames, however few they are."""

STRETCHES = ("run, 5 s", "run, whole", "hour, whole")


def draw(scale: str) -> None:
    """Print the median of each stretch as JSON."""
    os.environ["QT_QPA_PLATFORM"] = "offscreen"
    os.environ["QT_SCALE_FACTOR"] = scale
    import time

    from PySide6.QtCore import QEvent
    from window_frames import hour

    from gui.app import application
    from gui.lanes.lane import lanes_for
    from gui.lanes.live import LiveSource
    from gui.lanes.stack import LaneStack
    from gui.lanes.view import TimeView
    from gui.look.theme import Theme

    app = application([])
    theme = Theme("light")
    theme.apply()
    view = TimeView()
    stack = LaneStack(view, theme)
    signals = ("force", "V_C1", "V_C2", "V_K", "coil_current", "field", "spikes")
    stack.show_lanes(lanes_for(signals, twin=False))
    stack.hide_lane("coil_current", False)
    stack.resize(1100, 900)
    stack.show()
    found = {}

    def frames(name: str, source: LiveSource, whole: bool) -> None:
        stack.show_source(source)
        used = []
        end = time.monotonic() + LONGEST
        for number in range(FRAMES + 5):
            if number > 10 and time.monotonic() > end:
                break
            begun = time.thread_time()
            view.set_now(source.reach - 1e-3 * (FRAMES - number), source.length)
            if whole:
                view.show_span(0.0, source.reach + 1e-3 * number)
            stack.refresh()
            app.sendPostedEvents(None, QEvent.Type.UpdateRequest)
            used.append(time.thread_time() - begun)
            app.processEvents()
        found[name] = 1e3 * float(np.median(used[5:]))

    source = LiveSource(None, 0.2)
    record(source)
    view.set_follow(True)
    frames(STRETCHES[0], source, whole=False)
    frames(STRETCHES[1], source, whole=True)
    source = LiveSource(None, 0.2)
    hour(source)
    frames(STRETCHES[2], source, whole=True)
    print(json.dumps(found))
    sys.stdout.flush()
    os._exit(0)


def record(source: LiveSource) -> None:
    """Fill a source with a run of 60 s: sawteeth, pulses, steps of the force."""
    from gui.lanes.expected import Stretch
    from tactile_lab.trace import Trace

    rng = np.random.default_rng(2)
    for first in range(0, 60_000, 10_000):
        time = np.float64(1e-3) * np.arange(first, first + 10_000)
        shapes = {
            "V_C1": 1.0 + 0.2 * np.sin(time), "V_C2": np.mod(3 * time, 1.0),
            "V_K": (np.mod(3 * time, 1.0) < 0.02) * 2.0,
        }  # fmt: skip
        for signal, shape in shapes.items():
            mean = (shape + rng.normal(0, 0.01, time.size)).astype(np.float32)
            bins = Trace.bins(time, mean - 0.02, mean + 0.02, mean, 1e-3)
            source.add_bins({signal: bins})
    source.add_spikes(tuple(np.arange(0, 60, 1 / 3).tolist()))
    for at in range(600):
        source.add_current(0.1 * at, 0.1 * (at // 50 % 5))
        source.add_field(0.1 * at, 1e-3 * (at // 50 % 5))
    for number in range(12):
        start, end = 5.0 * number, 5.0 * number + 5
        source.begin_trial(number, Stretch(start, end, f"{20 * number} mN"))


def main() -> None:
    """Draw at every scale, in turn with the other checkout, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scales", nargs="+", default=["1", "1.25", "1.5", "2"])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--beside", type=Path)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--draw", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.draw:
        return draw(options.draw)
    pythons = {"": sys.executable}
    if options.beside:
        pythons = {"before, ": str(options.beside), "now, ": sys.executable}
    heads = [f"{who}{name}" for who in pythons for name in STRETCHES]
    lines = [
        f"{provenance()}. Processor time, ms a frame, medians of {options.rounds}.",
        "", f"| scale | {' | '.join(heads)} |", "|---" * (len(heads) + 1) + "|",
    ]  # fmt: skip
    for scale in options.scales:
        kept = defaultdict(list)
        for _ in range(options.rounds):
            for who, python in pythons.items():
                words = [python, __file__, "--draw", scale]
                done = subprocess.run(words, stdout=subprocess.PIPE, check=True)
                for name, cost in json.loads(done.stdout).items():
                    kept[f"{who}{name}"].append(cost)
        row = [f"{np.median(kept[head]):.1f}" for head in heads]
        lines.append(f"| {scale} | {' | '.join(row)} |")
    text = "\n".join(lines) + "\n"
    tell(text, options.out)


if __name__ == "__main__":
    main()
