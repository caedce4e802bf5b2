"""Detection beside numpy.max and scipy's find_peaks on the same samples, one core.

    python tests/benchmarks/spike_detection.py [--samples 200] [--out docs/detection.md]

Samples are 8-bit codes left-justified in int16, with noise of one step; spikes are four
samples long. Figures are samples per second of process time, best of five.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from provenance import provenance, tell
from scipy.signal import find_peaks

from tactile_lab.spikes.detection import Detection
from tactile_lab.spikes.detector import detect, detector_of

SPIKES = (1_000, 10_000, 100_000)
PER = 200_000_000
"""Samples that the numbers of spikes are for."""

BLOCK = 1 << 20
DETECTION = Detection(signal="V_K", threshold=3000, hysteresis=1000)
PEAKS_SHARE = 20
"""find_peaks gets one of so many samples: it is slow."""


def signal(samples: int, spikes: int) -> NDArray[np.int16]:
    """Noise and spikes at random places, not overlapping."""
    rng = np.random.default_rng(7)
    codes = rng.integers(-1, 2, samples, dtype=np.int16)
    codes *= 256
    at = np.unique(rng.integers(1, samples // 16 - 1, spikes)) * 16
    for delay, height in enumerate((20_480, 10_240, 5_120, 2_560)):
        codes[at + delay] = height
    return codes


def rate(work: Callable[[], object], samples: int, times: int = 5) -> float:
    """Samples per second of process time, the best of `times`."""
    best = float("inf")
    for _ in range(times):
        began = time.process_time()
        work()
        best = min(best, time.process_time() - began)
    return samples / best


def in_blocks(codes: NDArray[np.int16]) -> int:
    """Detect as on line, block after block; number of spikes."""
    detector = detector_of(DETECTION)
    found = 0
    for first in range(0, codes.size, BLOCK):
        found += detector.feed(first, codes[first : first + BLOCK]).size
    return found + detector.flush().size


def main() -> None:
    """Measure and print, or write, the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=200, help="millions")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    samples = options.samples * 1_000_000
    rows = []
    for spikes in SPIKES:
        codes = signal(samples, spikes * samples // PER)
        expected = detect(codes, DETECTION).size
        assert in_blocks(codes) == expected
        top = rate(codes.max, samples)
        ours = rate(partial(in_blocks, codes), samples)
        part = codes[: samples // PEAKS_SHARE]
        peaks = rate(partial(find_peaks, part, height=3000, distance=8), part.size, 2)
        count = find_peaks(part, height=3000, distance=8)[0].size
        assert count == detect(part, DETECTION).size
        rows.append(
            f"| {spikes:,} | {top / 1e6:,.0f} | {ours / 1e6:,.0f} | {ours / top:.2f} "
            f"| {peaks / 1e6:,.0f} | {ours / peaks:,.0f} |"
        )
    text = "\n".join([*head("Spike detection", options.samples), *rows, ""])
    tell(text, options.out)


def head(title: str, millions: int) -> list[str]:
    """Title, what was measured where, and the table's head."""
    return [
        f"# {title}",
        "",
        f"{provenance()}, numpy "
        f"{np.__version__}, one core. {millions} million samples, blocks of {BLOCK}. "
        "Made by `tests/benchmarks/spike_detection.py`; in each row all find the same.",
        "",
        "| spikes in 2e8 samples | numpy.max, MS/s | detector, MS/s | ratio "
        "| find_peaks, MS/s | ratio |",
        "|---|---|---|---|---|---|",
    ]


if __name__ == "__main__":
    main()
