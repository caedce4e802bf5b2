"""What a power cut leaves: all that was synced, and any part of what came after."""

import os
import random
import shutil

import h5py
import numpy as np
import pytest

from tactile_lab.errors import RecordingError
from tactile_lab.store import ledger
from tactile_lab.store.durable import DiskSync
from tactile_lab.store.folder import DATA, KEPT, LEDGER, RunFolder
from tactile_lab.store.layout import Layout
from tactile_lab.store.ledger import Ledger, read_ledger
from tactile_lab.store.recorder import Recorder
from tactile_lab.store.recover import recover
from tactile_lab.store.run import Run
from tactile_lab.store.verify import verify

PAGE, CHUNK = 4096, 1024
SAMPLES, BLOCK, SYNC = 150_000, 500, 2000
FILES = (DATA, LEDGER)


@pytest.fixture(scope="module")
def cut_runs(bench, tmp_path_factory):
    """A running run: its folder, its codes, and (samples written, files) per sync."""
    layout = Layout(signals=bench.SIGNALS, detection=bench.DETECTION, simulated=True)
    folder = RunFolder.create(tmp_path_factory.mktemp("cut"), "pulses", {})
    recorder = Recorder(folder, layout, reserve=0, sync=True)
    made = bench.codes(SAMPLES)
    recorder.segment(bench.stream(), 0.0)
    synced = []
    for first in range(0, SAMPLES, BLOCK):
        recorder.append(bench.block(made, first, BLOCK))
        recorder.current(first * 1e-3, 0.1, 0.1)
        if (first + BLOCK) % SYNC == 0:
            recorder._guard(recorder._flush)
            files = [(folder.path / name).read_bytes() for name in FILES]
            synced.append((recorder._columns[0].written, files))
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
    # most chunks share a block of places when there are many
    number = rng.randrange(len(synced) // 2, len(synced) - 1)
    (written, before), (_, after) = synced[number], synced[number + 1]
    path = tmp_path / "run"
    shutil.copytree(left, path)
    chance = rng.random()
    for name, old, new in zip(FILES, before, after, strict=True):
        (path / name).write_bytes(after_the_cut(old, new, chance, rng))
    recovery = recover(path)
    assert recovery.samples >= written // CHUNK * CHUNK  # the last was being filled
    assert verify(path).sound
    with Run.load(path) as run:
        kept = run.signal("V_K").scope_codes(0, recovery.samples)
        np.testing.assert_array_equal(kept, made[1, : recovery.samples])
        assert run.current["time"].size * BLOCK >= written


def test_a_run_that_ended_well_needs_no_ledger(cut_runs, bench, folder):
    layout = Layout(signals=bench.SIGNALS, detection=bench.DETECTION, simulated=False)
    recorder = Recorder(folder, layout, reserve=0)
    bench.play(recorder, bench.codes(4000), 500)
    noted = read_ledger(folder.path / LEDGER).chunks
    assert set(noted) == {"samples/V_C1", "samples/V_K"}
    assert max(noted["samples/V_K"]) == 2
    recorder.close("complete", 4000)
    assert not (folder.path / LEDGER).exists()


def test_a_run_killed_before_it_was_called_complete_is_recovered(bench, folder):
    layout = Layout(signals=bench.SIGNALS, detection=bench.DETECTION, simulated=True)
    recorder = Recorder(folder, layout, reserve=0)
    bench.play(recorder, bench.codes(4000), 500)

    def killed(*_, **__):
        folder._log.close()  # what the kernel does when the process dies
        raise KeyboardInterrupt

    folder.finish = killed
    with pytest.raises(KeyboardInterrupt):
        recorder.close("complete", 4000)
    assert recover(folder.path).samples == 4000
    assert verify(folder.path).sound


def entries(data):
    """Where each entry of a ledger begins, and its dataset."""
    at = 0
    while at < len(data):
        dataset, _, size = ledger._HEAD.unpack_from(data, at)
        yield at, dataset.rstrip(b"\0").decode()
        at += ledger._HEAD.size + ledger._CRC.size + size


@pytest.mark.parametrize("number", range(1, 9))
def test_a_kill_between_two_entries_leaves_a_run(cut_runs, tmp_path, number):
    """Killed before the place in time of its first samples was written: a traceback."""
    left, made, _ = cut_runs
    path = tmp_path / "run"
    shutil.copytree(left, path)
    data = (path / LEDGER).read_bytes()
    starts = [at for at, _ in entries(data)]
    (path / LEDGER).write_bytes(data[: starts[number]])
    kept = recover(path).samples
    assert verify(path).sound
    if kept:
        with Run.load(path) as run:
            codes = run.signal("V_K").scope_codes(0, kept)
            assert run.duration > 0
        np.testing.assert_array_equal(codes, made[1, :kept])


def test_samples_keep_their_time_where_the_ledger_lost_it(cut_runs, tmp_path):
    left, _, _ = cut_runs
    path = tmp_path / "run"
    shutil.copytree(left, path)
    data = bytearray((path / LEDGER).read_bytes())
    for at, dataset in entries(data):
        if dataset == "segments":
            data[at + ledger._HEAD.size] ^= 1
    (path / LEDGER).write_bytes(data)
    assert recover(path).samples > SAMPLES // 2
    assert verify(path).sound


def broken_index(data):
    """HDF5's index of chunks is gone; the chunks are not."""
    at, blocks = data.find(b"EADB"), 0  # an extensible array's data blocks
    while at >= 0:
        data[at + 20] ^= 0xFF
        at, blocks = data.find(b"EADB", at + 1), blocks + 1
    assert blocks > 2


def broken_head(data):
    """Superblock, attributes and headers of the first datasets are gone."""
    data[:PAGE] = bytes(PAGE)


@pytest.mark.parametrize("broken", [broken_index, broken_head])
def test_samples_are_found_by_the_ledger_alone(cut_runs, tmp_path, broken):
    left, made, synced = cut_runs
    path = tmp_path / "run"
    shutil.copytree(left, path)
    written, files = synced[-1]
    data = bytearray(files[0])
    broken(data)
    (path / DATA).write_bytes(data)
    (path / LEDGER).write_bytes(files[1])
    assert recover(path).samples >= written // CHUNK * CHUNK
    with Run.load(path) as run:
        found = run.signal("V_C1").scope_codes(0, run.samples)
        np.testing.assert_array_equal(found, made[0, : run.samples])


def test_a_run_without_its_ledger_is_recovered_from_its_file(cut_runs, tmp_path):
    left, made, _ = cut_runs
    path = tmp_path / "run"
    shutil.copytree(left, path)
    (path / LEDGER).unlink()
    assert recover(path).samples > 100_000
    with Run.load(path) as run:
        assert run.status == "recovered"
        found = run.signal("V_C1").scope_codes(0, run.samples)
        np.testing.assert_array_equal(found, made[0, : run.samples])


def test_a_recovery_that_was_cut_short_is_begun_again(cut_runs, tmp_path):
    left, _, _ = cut_runs
    path, other = tmp_path / "run", tmp_path / "other"
    shutil.copytree(left, path)
    shutil.copytree(left, other)
    (path / DATA).rename(path / KEPT)
    (path / "data.recovering.h5").write_bytes(b"half of it")
    again, whole = recover(path), recover(other)
    assert (again.samples, again.spikes) == (whole.samples, whole.spikes)
    assert again.samples > 100_000
    assert verify(path).sound


def test_a_torn_entry_ends_the_ledger(cut_runs, tmp_path):
    _, _, synced = cut_runs
    whole = synced[-1][1][1]
    (tmp_path / LEDGER).write_bytes(whole)
    chunks = read_ledger(tmp_path / LEDGER).chunks["samples/V_K"]
    (tmp_path / LEDGER).write_bytes(whole[: len(whole) // 2] + bytes(len(whole) // 2))
    some = read_ledger(tmp_path / LEDGER).chunks["samples/V_K"]
    assert 0 < len(some) < len(chunks)
    assert all(chunks[number] == entries for number, entries in some.items())


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
    durable = DiskSync(file, every=0.001)
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
    recorder._file._durable.failure = OSError(5, "Input/output error")
    with pytest.raises(RecordingError, match="Input/output error"):
        recorder.append(bench.block(made, 2048, 2048))
    recorder.close("faulted", 4096)
    with Run.load(folder.path) as run:
        assert run.status == "faulted"
        assert run.samples >= 2048


def test_a_ledger_of_an_older_version_is_read_with_the_columns_it_has(tmp_path):
    older = np.dtype([("index", "u4"), ("start", "f8"), ("label", "S48")])
    image = tmp_path / "declared.h5"
    with h5py.File(image, "w") as file:
        file.create_dataset("trials", (0,), older, maxshape=(None,))
    ledger = Ledger(tmp_path / LEDGER, image.read_bytes())
    rows = np.array([(0, 0.5, b"80 mN"), (1, 5.0, b"120 mN")], older)
    ledger.note("trials", 0, rows)
    ledger.close()
    assert read_ledger(tmp_path / LEDGER).rows["trials"] == rows.tolist()
