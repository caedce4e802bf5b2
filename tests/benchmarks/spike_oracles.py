"""elephant and SpikeInterface as oracles of the detector, in an environment of theirs.

    python tests/benchmarks/spike_oracles.py write /tmp/spikes.npz
    OTHER/bin/python tests/benchmarks/spike_oracles.py check /tmp/spikes.npz

OTHER has elephant and spikeinterface installed; they need older libraries than this
project, so they never share its environment.
"""

from __future__ import annotations

import sys
import time
import warnings

import numpy as np

RATE = 1e6
SAMPLES = 10_000_000
SPIKES = 500
THRESHOLD = 3000


def write(file: str) -> None:
    """Codes with spikes at random places, and what our detector finds in them."""
    from tactile_lab.spikes.detection import Detection
    from tactile_lab.spikes.detector import detect

    rng = np.random.default_rng(11)
    codes = rng.integers(-1, 2, SAMPLES, dtype=np.int16) * np.int16(256)
    at = np.unique(rng.integers(10, SAMPLES // 1000 - 10, SPIKES)) * 1000
    for delay, height in enumerate((20_480, 10_240, 5_120, 2_560)):
        codes[at + delay] = height
    detection = Detection(signal="V_K", threshold=THRESHOLD, hysteresis=1000)
    found = detect(codes, detection)
    np.savez(file, codes=codes, at=at, sample=found["sample"])
    print(f"planted {at.size}, found {found.size}")


def check(file: str) -> None:
    """Compare with what the others find in the same codes."""
    import elephant.spike_train_generation as generation
    import neo
    import quantities as pq
    from spikeinterface.core import NumpyRecording
    from spikeinterface.sortingcomponents.peak_detection import detect_peaks

    warnings.simplefilter("ignore")
    held = np.load(file)
    codes, ours = held["codes"], np.ceil(held["sample"]).astype(int)
    began = time.process_time()
    signal = neo.AnalogSignal(
        codes.astype(np.float32)[:, None], units="mV", sampling_rate=RATE * pq.Hz
    )
    train = generation.threshold_detection(signal, threshold=THRESHOLD * pq.mV)
    train = train[0] if isinstance(train, list) else train
    theirs = np.round(train.rescale("s").magnitude * RATE).astype(int)
    tell("elephant threshold_detection", theirs, ours, time.process_time() - began)
    recording = NumpyRecording([codes[:, None]], RATE)
    began = time.process_time()
    peaks = detect_peaks(
        recording,
        method="by_channel",
        method_kwargs={
            "peak_sign": "pos",
            "detect_threshold": 1.0,
            "noise_levels": np.array([float(THRESHOLD)]),
            "exclude_sweep_ms": 0.01,
        },
        job_kwargs={"n_jobs": 1, "progress_bar": False},
    )
    took = time.process_time() - began
    tell("SpikeInterface by_channel", np.sort(peaks["sample_index"]), ours, took)


def tell(name: str, theirs: np.ndarray, ours: np.ndarray, took: float) -> None:
    """One line: how many, how many of them ours too, how fast."""
    near = np.abs(theirs[:, None] - ours[None, :]).min(axis=1) <= 1
    print(
        f"{name}: {theirs.size} spikes, {int(near.sum())} within one sample of ours "
        f"({ours.size}), {SAMPLES / took / 1e6:.0f} MS/cpu-s"
    )


if __name__ == "__main__":
    {"write": write, "check": check}[sys.argv[1]](sys.argv[2])
