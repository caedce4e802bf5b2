"""The whole path in real time: emulated PicoScope, detection, live picture, disk.

    python tests/benchmarks/sustained.py [--seconds 60] [--rates 7.8125 15.625 31.25]
                                         [--out FILE]

The exit code is 1 where samples or spikes were lost without a message.

Four channels at each rate (MS/s per channel). Spikes of known number are in the
scope's samples; at the end the run is certified from what the disk holds. A rate that
is too high must end with a message, never with samples missing unnoticed. The model
ends at 31.25 MS/s; beyond, the emulator is faster than any real one, to find where
this computer ends.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from provenance import provenance, tell

from drivers.picoscope.scope import PicoScope
from sim_backend.picoscope.scope import UnitModel
from sim_backend.picoscope.sdk import FakePs3000a
from sim_backend.plant.scope_source import Acquisition, Codes
from tactile_lab.acquisition.intake import Intake
from tactile_lab.acquisition.live import LiveBins
from tactile_lab.acquisition.scope_thread import ScopeThread
from tactile_lab.clock import RealClock
from tactile_lab.errors import TactileLabError
from tactile_lab.scope import Channel
from tactile_lab.spikes.detection import Detection
from tactile_lab.spikes.detector import detector_of
from tactile_lab.store.certificate import write_certificate
from tactile_lab.store.folder import DATA, RunFolder
from tactile_lab.store.layout import Layout
from tactile_lab.store.recorder import Recorder
from tactile_lab.store.write_queue import QUEUE_BYTES

SIGNALS = ("V_C1", "V_C2", "V_K", "coil_current")
ROW = 2
PERIOD = 1 << 20
SILENT = "LOST WITHOUT A MESSAGE"
EVERY = 16_384
"""Samples from spike to spike; divides the period."""

DETECTION = Detection(signal="V_K", threshold=5120, hysteresis=2560)
CHANNELS = tuple(
    Channel(signal=name, input="ABCD"[i], range=5.0) for i, name in enumerate(SIGNALS)
)


class Table:
    """Noise of one code on four inputs and a spike on one, repeating."""

    def __init__(self, longest: int) -> None:
        rng = np.random.default_rng(1)
        self._table = rng.integers(-1, 2, (4, PERIOD), dtype=np.int16)
        self._table[ROW, EVERY - 1 :: EVERY] = 100
        self._table = np.tile(self._table * np.int16(256), longest // PERIOD + 2)

    def render(
        self, acquisition: Acquisition, first: int, samples: int
    ) -> tuple[Codes, tuple[bool, ...]]:
        """A piece of the table."""
        begin = first % PERIOD
        rows = len(acquisition.inputs)
        return self._table[:rows, begin : begin + samples], (False,) * rows


def one(rate: float, seconds: float, root: Path) -> str:
    """A row of the table: `rate` MS/s for `seconds`."""
    clock = RealClock()
    library = FakePs3000a(Table(1 << 23), clock, UnitModel(beyond=4))
    thread = ScopeThread(PicoScope(clock=clock, library=library), clock)
    thread.start()
    clock.wait_for(lambda: thread.settled)
    thread.raise_failure()
    live = LiveBins()
    intake = Intake(live)
    detector = detector_of(DETECTION)
    detector.feed(0, np.zeros(10, np.int16))  # compile or load before samples come
    detector.flush()
    thread.stream_from(CHANNELS, 1e-6 / rate)
    clock.wait_for(lambda: thread.stream is not None or thread.failure is not None)
    thread.raise_failure()
    stream = thread.stream
    assert stream is not None
    folder = RunFolder.create(root, "sustained", {})
    layout = Layout(signals=SIGNALS, detection=DETECTION, simulated=True)
    recorder = Recorder(folder, layout, sync=True, when_full="error")
    queue = recorder._queue
    assert queue is not None
    intake.begin(stream, 0.0, recorder, detector, ROW)
    worked, began, ended, fullest = time.process_time(), time.monotonic(), "", 0.0
    try:
        while intake.reached < seconds:
            while (block := thread.take()) is not None:
                intake.add(block)
                fullest = max(fullest, queue._bytes / QUEUE_BYTES)
            thread.raise_failure()
            clock.wait_for(
                lambda: thread.waiting > 0 or thread.failure is not None,
                clock.now() + 0.25,
            )
    except TactileLabError as error:
        ended = f"{type(error).__name__}: {str(error)[:200]}"
    took = time.monotonic() - began
    thread.leave()
    thread.join(5)
    intake.end(intake.reached)
    try:
        recorder.close("faulted" if ended else "complete", intake.produced)
    except TactileLabError as error:
        ended = ended or str(error)
    load = (time.process_time() - worked) / took
    proof = write_certificate(folder.path)
    spikes = intake.produced // EVERY
    found = f"{proof.online} of {spikes}"
    # a stream that was cut off may end within a spike
    kept = not proof.samples and not proof.spikes and spikes - proof.online <= 1
    end = ended or ("complete" if kept else SILENT)
    size = (folder.path / DATA).stat().st_size
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return (
        f"| {rate:g} | {took:.0f} | {intake.produced * 4:,} | {proof.samples} "
        f"| {found} | {proof.spikes} | {100 * fullest:.0f} | {load:.2f} | {memory:.0f} "
        f"| {size / 1e6:.0f} | {end} |"
    )


def main() -> None:
    """Measure each rate in a process of its own; print or write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument(
        "--rates", type=float, nargs="+", default=[7.8125, 15.625, 31.25, 62.5, 125]
    )
    parser.add_argument("--out", type=Path)
    parser.add_argument("--row", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.row:
        with tempfile.TemporaryDirectory(dir=os.environ.get("TMPDIR")) as root:
            print(one(options.rates[0], options.seconds, Path(root)))
        return
    rows = []
    for rate in options.rates:
        command = [sys.executable, __file__, "--row", "--rates", str(rate)]
        command += ["--seconds", str(options.seconds)]
        made = subprocess.run(command, capture_output=True, text=True, check=False)
        rows.append(made.stdout.strip() or f"| {rate:g} | {made.stderr[-300:]} |")
        print(rows[-1], flush=True)
    whole = [r for r, row in zip(options.rates, rows, strict=True) if is_whole(row)]
    most = f"{max(whole):g} MS/s on each of 4 channels" if whole else "none of these"
    text = "\n".join(
        [
            "# Sustained streaming to disk",
            "",
            f"{provenance()}. Made by `tests/benchmarks/sustained.py`: the "
            "real PicoScope driver on its emulated library, paced by the clock, "
            "detection on V_K, live picture, recorder. The emulator takes part of the "
            "load. Lost samples and spikes are those of the run's certificate.",
            "",
            "| MS/s per channel | s | samples | lost | spikes found | offline differ "
            "| queue at most, % | cores used | memory, MB | file, MB | end |",
            "|---|---|---|---|---|---|---|---|---|---|---|",
            *rows,
            "",
            f"Highest rate without loss: {most}. Every other rate ended with a message "
            "and kept what came before."
            if not any(SILENT in row for row in rows)
            else SILENT,
            "",
        ]
    )
    tell(text, options.out)
    sys.exit(int(SILENT in text))


def is_whole(row: str) -> bool:
    """Whether a row is that of a run that ended as planned and lost nothing."""
    return row.endswith("| complete |")


if __name__ == "__main__":
    main()
