"""Kills writers at random instants and counts what is left.

    python tests/benchmarks/kill_store.py [--kills 200] [--seed 1] [--out FILE]

Each writer is a fork of this process that records without pause, so that most kills
fall into a write. After each kill the file must open with h5py and ``swmr=True``, hold
all but the block in flight, be recovered, and then verify without a finding.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import tempfile
import time
from collections import Counter
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray
from provenance import provenance, tell

from tactile_lab.errors import RunFolderError
from tactile_lab.scope import Block, Channel, Stream
from tactile_lab.spikes.detection import Detection
from tactile_lab.spikes.detector import detect, detector_of
from tactile_lab.store.folder import DATA, RunFolder
from tactile_lab.store.layout import Layout
from tactile_lab.store.recorder import Recorder
from tactile_lab.store.recover import recover
from tactile_lab.store.run import Run
from tactile_lab.store.verify import verify

BLOCK = 4096
SAMPLES = 4_000_000
LONGEST = 0.8
"""Latest instant of a kill after the writer's start, s."""

DETECTION = Detection(signal="V_K", threshold=5120, hysteresis=2560)
STREAM = Stream(
    channels=tuple(
        Channel(signal=name, input="ABCD"[i], range=5.0)
        for i, name in enumerate(("V_C1", "V_C2", "V_K", "coil_current"))
    ),
    interval=1 / 16_384,  # chunks of 4096 samples: one per block
    full_scale=32512,
    shift=8,
    started=0.0,
    uncertainty=0.0,
)


def codes() -> NDArray[np.int16]:
    """Noise on four channels, a spike on V_K every 701 samples."""
    made = np.random.default_rng(1).integers(-1, 2, (4, SAMPLES), dtype=np.int16)
    made[2, 701::701] = 100
    return made * np.int16(256)


def write(root: Path, made: NDArray[np.int16], tell: int) -> None:
    """Record for ever; report each acknowledged block through a pipe."""
    layout = Layout(
        signals=tuple(channel.signal for channel in STREAM.channels),
        detection=DETECTION,
        simulated=True,
    )
    folder = RunFolder.create(root, "killed", {})
    os.write(tell, (0).to_bytes(8, "little"))
    recorder = Recorder(folder, layout, reserve=0)
    detector = detector_of(DETECTION)
    recorder.segment(STREAM, 0.0)
    for first in range(0, SAMPLES, BLOCK):
        part = np.ascontiguousarray(made[:, first : first + BLOCK])
        recorder.append(Block(first, part, (False,) * 4, 0.0))
        found = detector.feed(first, part[2])
        recorder.spikes(found["sample"] * STREAM.interval, found)
        recorder.current(first * STREAM.interval, 0.1, 0.1)
        os.write(tell, (first + part.shape[1]).to_bytes(8, "little"))
    time.sleep(10)


def kill_once(root: Path, made: NDArray[np.int16], after: float) -> tuple[Path, int]:
    """The run a killed writer left, and the samples it had acknowledged."""
    reading, telling = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        try:
            write(root, made, telling)
        finally:
            os._exit(1)
    os.close(telling)
    told = os.read(reading, 8)
    time.sleep(after)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    while part := os.read(reading, 1 << 20):
        told += part
    os.close(reading)
    (path,) = root.iterdir()
    return path, int.from_bytes(told[-8:], "little")


def judge(path: Path, acknowledged: int, made: NDArray[np.int16]) -> tuple[str, int]:
    """(what became of the run, blocks lost of those acknowledged)."""
    try:
        with Run.load(path) as run:
            kept = run.samples
    except RunFolderError:
        kept = 0
    if kept == 0 and acknowledged == 0:
        recover(path)
        sound = verify(path).sound
        return ("no sample yet, recovered" if sound else "UNSOUND without samples", 0)
    with h5py.File(path / DATA, "r", libver="latest", swmr=True) as file:
        plain = file["samples/V_K"][:kept]
    if not np.array_equal(plain, made[2, :kept] >> 8):
        return ("WRONG SAMPLES", 0)
    lost = max(0, acknowledged - kept) // BLOCK
    done = recover(path)
    verdict = verify(path)
    if not verdict.sound:
        return (f"UNSOUND: {verdict.findings[0]}", lost)
    with h5py.File(path / DATA, "r") as file:
        found = file["spikes"]["sample"]
    if found.size != detect(made[2, : done.samples], DETECTION).size:
        return ("WRONG SPIKES", lost)
    return ("recovered, sound", lost)


def main() -> None:
    """Kill, judge, and print or write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    instants = random.Random(options.seed)
    made = codes()
    detect(made[2, :BLOCK], DETECTION)  # compile before forking
    ends: Counter[str] = Counter()
    losses: Counter[int] = Counter()
    for _ in range(options.kills):
        with tempfile.TemporaryDirectory() as folder:
            after = instants.uniform(0.0, LONGEST)
            path, acknowledged = kill_once(Path(folder), made, after)
            end, lost = judge(path, acknowledged, made)
            ends[end] += 1
            losses[lost] += 1
    text = "\n".join(
        [
            "# Killed while recording",
            "",
            f"{provenance()}. {options.kills} writers of four "
            f"channels killed with SIGKILL at random instants within {LONGEST} s (seed "
            f"{options.seed}), recording blocks of {BLOCK} samples without pause. Made "
            "by `tests/benchmarks/kill_store.py`. The page cache survives a kill: this "
            "says nothing about a power cut.",
            "",
            "| end | runs |",
            "|---|---|",
            *(f"| {end} | {count} |" for end, count in ends.most_common()),
            "",
            "| acknowledged blocks lost | runs |",
            "|---|---|",
            *(f"| {lost} | {count} |" for lost, count in sorted(losses.items())),
            "",
        ]
    )
    tell(text, options.out)
    wrong = sum(c for end, c in ends.items() if end.isupper() or "UNSOUND" in end)
    raise SystemExit(1 if wrong or max(losses) > 1 else 0)


if __name__ == "__main__":
    main()
