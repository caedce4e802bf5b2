"""A small synthetic bench: streams of known codes, recorded without any instrument."""

from types import SimpleNamespace

import numpy as np
import pytest

from tactile_lab.scope import Block, Channel, Stream
from tactile_lab.spikes.detection import Detection
from tactile_lab.spikes.detector import detector_of
from tactile_lab.store.certificate import write_certificate
from tactile_lab.store.folder import RunFolder
from tactile_lab.store.layout import Layout
from tactile_lab.store.recorder import Recorder

SIGNALS = ("V_C1", "V_K")
DETECTION = Detection(signal="V_K", threshold=5120, hysteresis=2560)


def stream(*, interval=1e-3, shift=8, started=10.0, names=SIGNALS):
    channels = tuple(
        Channel(signal=name, input="ABCD"[i], range=5.0, offset=0.5 * i)
        for i, name in enumerate(names)
    )
    return Stream(
        channels=channels,
        interval=interval,
        full_scale=32512,
        shift=shift,
        started=started,
        uncertainty=1e-4,
    )


def codes(samples, seed=1, *, rows=2, every=701):
    """Noise of one 8-bit step on all rows, a spike on the last every `every`."""
    rng = np.random.default_rng(seed)
    made = rng.integers(-1, 2, (rows, samples), dtype=np.int16)
    made[-1, every::every] = 100
    return made * np.int16(256)


def block(made, first, size, *, over=(False, False), received=0.0):
    part = np.ascontiguousarray(made[:, first : first + size])
    return Block(first=first, codes=part, overrange=over, received=received)


def play(recorder, made, size, *, start=0.0, source=None, detection=DETECTION):
    """Stream `made` through detection into a recorder as the runner does."""
    source = source or stream()
    recorder.segment(source, start)
    detector = detector_of(detection)
    row = [channel.signal for channel in source.channels].index(detection.signal)
    total = 0
    for first in range(0, made.shape[1], size):
        one = block(made, first, size, over=(False,) * made.shape[0])
        recorder.append(one)
        found = detector.feed(first, one.codes[row])
        recorder.spikes(start + found["sample"] * source.interval, found)
        total += found.size
    found = detector.flush()
    recorder.spikes(start + found["sample"] * source.interval, found)
    return total + found.size


@pytest.fixture(scope="session")
def bench():
    return SimpleNamespace(
        stream=stream,
        codes=codes,
        block=block,
        play=play,
        SIGNALS=SIGNALS,
        DETECTION=DETECTION,
    )


@pytest.fixture
def layout():
    return Layout(signals=SIGNALS, detection=DETECTION, simulated=True)


@pytest.fixture
def folder(tmp_path):
    return RunFolder.create(tmp_path / "runs", "pulses", {"protocol": "pulses"})


@pytest.fixture
def recorder(folder, layout):
    return Recorder(folder, layout, reserve=0)


@pytest.fixture
def complete(bench, recorder, folder):
    """A sound run of 5 chunks of 1024 samples, the last one short."""
    bench.play(recorder, bench.codes(5000), 500)
    recorder.current(1.0, 0.5, 0.5)
    recorder.close("complete", 5000)
    write_certificate(folder.path)
    return folder.path
