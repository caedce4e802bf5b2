"""How fast samples come through the PicoScope driver, and that none is lost unnoticed.

    python tests/benchmarks/scope_stream.py [--seconds 5] [--out docs/scope-figures.md]

1. unpaced: MS/s per input through the callback into blocks, on the Python library and
   on the C emulator (where there is a compiler), every sample's index checked;
2. paced by this computer's clock: samples lost (0 is required) and load of the thread;
3. starved on purpose: whether each loss was reported.
"""

from __future__ import annotations

import argparse
import ctypes
import os
import shutil
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from provenance import provenance, tell

from drivers.picoscope.scope import PicoScope
from sim_backend.picoscope.scope import UnitModel
from sim_backend.picoscope.sdk import FakePs3000a
from sim_backend.plant.scope_source import Acquisition, Codes
from tactile_lab.clock import RealClock, SimulatedClock
from tactile_lab.errors import SamplesLostError
from tactile_lab.scope import Channel

EMULATOR = Path(__file__).parents[1] / "drivers" / "ps3000a_emulator.c"
INPUTS = "ABCD"
PERIOD = 249
REPEATS = 5


def channels(count: int) -> list[Channel]:
    return [Channel(signal=name, input=name, range=5.0) for name in INPUTS[:count]]


class Pattern:
    """The C emulator's samples, from a table."""

    def __init__(self, longest: int) -> None:
        count = np.arange(longest + PERIOD)
        self._table = np.array(
            [(count % PERIOD - 124 + c) * 256 for c in range(4)], dtype=np.int16
        )

    def render(
        self, acquisition: Acquisition, first: int, samples: int
    ) -> tuple[Codes, tuple[bool, ...]]:
        begin = first % PERIOD
        rows = len(acquisition.inputs)
        return self._table[:rows, begin : begin + samples], (False,) * rows


def right(codes: np.ndarray, first: int) -> bool:
    """Whether first and last sample of each row are those of the pattern."""
    last = first + codes.shape[1] - 1
    return all(
        row[0] == (first % PERIOD - 124 + c) * 256
        and row[-1] == (last % PERIOD - 124 + c) * 256
        for c, row in enumerate(codes)
    )


def compiled() -> Path | None:
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        return None
    file = Path(tempfile.mkdtemp()) / "libps3000a.so.2"
    command = [compiler, "-O3", "-shared", "-fPIC", "-o", str(file), str(EMULATOR)]
    subprocess.run([*command, "-lpthread", "-lm"], check=True)
    return file


Advance = Callable[[float], None]


def library(
    kind: str, clock: Any, file: Path | None, longest: int
) -> tuple[Any, Advance]:
    """The library, and what moves its own time on."""
    if kind == "Python":
        return FakePs3000a(Pattern(longest), clock), lambda step: None
    emulator = ctypes.CDLL(str(file))
    emulator.emulator_advance.argtypes = [ctypes.c_double]
    emulator.emulator_reset()
    return str(file), emulator.emulator_advance


def unpaced(kind: str, file: Path | None, chunk: int) -> float:
    """MS/s per input with `chunk` samples a poll, all samples' places checked."""
    clock, interval = SimulatedClock(), 128e-9
    lib, advance = library(kind, clock, file, chunk)
    polls, total = max(4, 4_000_000 // chunk), 0
    scope = PicoScope(clock=clock, library=lib, ring=1 << 20)
    with clock.taking_part("benchmark"):
        scope.open()
        scope.start(channels(4), interval)
        step = chunk * interval
        spent = 0.0
        for _ in range(polls):
            clock.sleep_until(clock.now() + step)
            advance(step)
            begin = time.perf_counter()
            block = scope.poll()
            spent += time.perf_counter() - begin
            assert block is not None and block.first == total
            assert right(block.codes, block.first)
            total += block.samples
        scope.close()
    assert abs(total - polls * chunk) <= 1
    return total / spent / 1e6


def paced(rate: float, inputs: int, seconds: float) -> tuple[int, float, float]:
    """Samples missing per input, load of the thread, and longest poll, s."""
    clock = RealClock()
    scope = PicoScope(
        clock=clock, library=FakePs3000a(Pattern(1 << 22), clock), poll_interval=0.01
    )
    scope.open()
    stream = scope.start(channels(inputs), 1 / rate)
    total, longest, busy = 0, 0.0, time.thread_time()
    until = clock.now() + seconds
    while clock.now() < until:
        clock.sleep_until(clock.now() + scope.poll_interval)
        begin = clock.now()
        block = scope.poll()
        longest = max(longest, clock.now() - begin)
        if block is not None:
            assert block.first == total and right(block.codes, block.first)
            total += block.samples
            due = int((begin - stream.started) / stream.interval)
    busy = time.thread_time() - busy
    scope.close()
    return max(0, due - total), busy / seconds, longest


def starved(fifo: int | None, pause: float) -> tuple[int, str]:
    """Samples the library dropped, and what the driver said."""
    clock = SimulatedClock()
    lib = FakePs3000a(Pattern(1 << 22), clock, UnitModel(fifo=fifo))
    scope = PicoScope(clock=clock, library=lib, ring=1 << 20)
    said = "nothing"
    with clock.taking_part("benchmark"):
        scope.open()
        scope.start(channels(4), 128e-9)
        try:
            for k in range(100):
                clock.sleep_until(clock.now() + (pause if k == 50 else 0.01))
                scope.poll()
            scope.stop()
        except SamplesLostError as error:
            said = str(error).partition(":")[0]
        scope.close()
    return lib.device.dropped, said


def unpaced_table(file: Path | None) -> list[str]:
    """Markdown of the first table."""
    lines = [
        f"Unpaced, 4 inputs, MS/s per input (median of {REPEATS} runs), 0 lost:",
        "",
        "| samples a poll | Python library | C emulator |",
        "|---|---|---|",
    ]
    for chunk in (1 << 12, 1 << 14, 1 << 16, 1 << 18):
        figures = []
        for kind in ("Python", "C"):
            if kind == "C" and file is None:
                figures.append("no compiler")
                continue
            runs = [unpaced(kind, file, chunk) for _ in range(REPEATS)]
            figures.append(f"{statistics.median(runs):.0f}")
        lines.append(f"| {chunk} | {' | '.join(figures)} |")
    return lines


def paced_table(seconds: float) -> list[str]:
    """Markdown of the second table."""
    lines = [
        "",
        f"Paced by the real clock, {seconds:g} s each, Python library:",
        "",
        "| MS/s per input | inputs | lost | load | longest poll |",
        "|---|---|---|---|---|",
    ]
    for rate, inputs in ((1e6, 4), (7.8125e6, 4), (15.625e6, 4), (31.25e6, 1)):
        try:
            lost, load, longest = paced(rate, inputs, seconds)
            row = f"{lost} | {load:.0%} | {longest * 1e3:.1f} ms"
        except SamplesLostError as error:
            row = f"reported: {error} | |"
        lines.append(f"| {rate / 1e6:g} | {inputs} | {row} |")
    return lines


def starved_table() -> list[str]:
    """Markdown of the third table."""
    lines = [
        "",
        "Starved on purpose, 4 inputs at 7.8125 MS/s, polls every 10 ms:",
        "",
        "| kept for a late poll | one poll late by | dropped | the driver said |",
        "|---|---|---|---|",
    ]
    for fifo, pause in (
        (None, 0.05),
        (None, 0.2),
        (1 << 18, 0.1),
        (1 << 18, 0.034),
        (100_000, 0.05),
    ):
        dropped, said = starved(fifo, pause)
        if dropped and said == "nothing":
            raise SystemExit(f"{dropped} samples were lost without a word")
        kept = "1 Mi" if fifo is None else str(fifo)
        lines.append(f"| {kept} | {pause * 1e3:g} ms | {dropped} | {said} |")
    return lines


def main() -> None:
    """Measure, print, and write the tables."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seconds", type=float, default=5.0)
    options.add_argument("--out", type=Path)
    chosen = options.parse_args()
    lines = [
        "# Samples through the PicoScope driver",
        "",
        f"{provenance()}, load {os.getloadavg()[0]:.1f}. Made by "
        f"`tests/benchmarks/scope_stream.py --seconds {chosen.seconds:g}`: the driver "
        "on its emulated library, through the C callback; the place of every block's "
        "samples is checked.",
        "",
        *unpaced_table(compiled()),
        *paced_table(chosen.seconds),
        *starved_table(),
    ]
    text = "\n".join(lines) + "\n"
    tell(text, chosen.out)


if __name__ == "__main__":
    main()
