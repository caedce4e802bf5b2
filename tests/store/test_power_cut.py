"""What a power cut leaves: all that was synced, and any part of what came after."""

import os
import random
import shutil

import numpy as np
import pytest

from tactile_lab.errors import RecordingError
from tactile_lab.store.durable import Durable
from tactile_lab.store.folder import DATA, RunFolder
from tactile_lab.store.layout import Layout
from tactile_lab.store.recorder import Recorder
from tactile_lab.store.recover import recover
from tactile_lab.store.run import Run
from tactile_lab.store.verify import verify

PAGE, CHUNK = 4096, 1024
SAMPLES, BLOCK, SYNC = 60_000, 500, 10_000


@pytest.fixture(scope="module")
def cut_runs(bench, tmp_path_factory):
    """A running run: its folder, its codes, and (samples written, file) per sync."""
    layout = Layout(signals=bench.SIGNALS, detection=bench.DETECTION, simulated=True)
    folder = RunFolder.create(tmp_path_factory.mktemp("cut"), "pulses", {})
    recorder = Recorder(folder, layout, reserve=0)
    made = bench.codes(SAMPLES)
    recorder.segment(bench.stream(), 0.0)
    synced = []
    for first in range(0, SAMPLES, BLOCK):
        recorder.append(bench.block(made, first, BLOCK))
        recorder.current(first * 1e-3, 0.1, 0.1)
        if (first + BLOCK) % SYNC == 0:
            recorder._guard(recorder._flush)
            data = (folder.path / DATA).read_bytes()
            synced.append((recorder._columns[0].written, data))
    left = tmp_path_factory.mktemp("left") / "run"
    shutil.copytree(folder.path, left)
    recorder.close("complete", SAMPLES)
    return left, made, synced


def after_the_cut(old, new, chance, rng):
    """The synced file with some of the pages written since; the rest never arrived."""
    found = bytearray(old.ljust(len(new), b"\0"))
    for at in range(0, len(new), PAGE):
        if rng.random() < chance:
            found[at : at + PAGE] = new[at : at + PAGE]
    return bytes(found)


@pytest.mark.parametrize("seed", range(12))
def test_what_was_synced_survives_whatever_else_arrived(cut_runs, tmp_path, seed):
    left, made, synced = cut_runs
    rng = random.Random(seed)
    number = rng.randrange(len(synced) - 1)
    (written, old), (_, new) = synced[number], synced[number + 1]
    path = tmp_path / "run"
    shutil.copytree(left, path)
    (path / DATA).write_bytes(after_the_cut(old, new, rng.random(), rng))
    recovery = recover(path)
    assert recovery.samples >= written // CHUNK * CHUNK  # the last was being filled
    assert verify(path).sound
    with Run.load(path) as run:
        kept = run.signal("V_K").scope_codes(0, recovery.samples)
        np.testing.assert_array_equal(kept, made[1, : recovery.samples])
        assert run.current["time"].size * BLOCK >= written


def test_a_measured_run_is_synced_again_and_again(bench, folder, monkeypatch):
    layout = Layout(signals=bench.SIGNALS, detection=bench.DETECTION, simulated=False)
    calls = []
    monkeypatch.setattr(os, "fsync", calls.append)
    recorder = Recorder(folder, layout, reserve=0)
    bench.play(recorder, bench.codes(4000), 500)
    assert len(calls) >= 2  # the names of folder and file
    begun = len(calls)
    recorder.close("complete", 4000)
    assert len(calls) > begun
    assert verify(folder.path).sound


def test_syncs_come_from_a_thread_of_their_own(tmp_path):
    file = tmp_path / "grows"
    file.write_bytes(b"x")
    durable = Durable(file, every=0.001)
    deadline = 30_000
    while durable.count < 3 and deadline:
        durable._ended.wait(0.001)
        deadline -= 1
    durable.close()
    durable.close()
    assert durable.count >= 3


def test_a_disk_that_refuses_a_sync_ends_the_run(bench, folder):
    layout = Layout(signals=bench.SIGNALS, detection=bench.DETECTION, simulated=True)
    recorder = Recorder(folder, layout, reserve=0, sync=True)
    recorder.segment(bench.stream(), 0.0)
    made = bench.codes(5000)
    recorder.append(bench.block(made, 0, 2048))
    recorder._durable.failure = OSError(5, "Input/output error")
    with pytest.raises(RecordingError, match="Input/output error"):
        recorder.append(bench.block(made, 2048, 2048))
    recorder.close("faulted", 4096)
    with Run.load(folder.path) as run:
        assert run.status == "faulted"
        assert run.samples >= 2048
