"""What a killed or living run holds; `recover` makes it whole again."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from functools import cache
from pathlib import Path

import h5py
import numpy as np
import pytest

from tactile_lab.errors import RecordingError, RunFolderError
from tactile_lab.store.catalogue import summary
from tactile_lab.store.folder import RunFolder
from tactile_lab.store.recover import recover
from tactile_lab.store.run import Run
from tactile_lab.store.verify import verify

WRITER = Path(__file__).with_name("killed_writer.py")


def killed(root, *, after, samples=200_000, block=1024):
    """Path and acknowledged samples of a run whose writer was killed.

    A kill that tore a table, between two pages of one write, is tried again: that case
    is `test_what_a_kill_tore_is_whole_again_by_the_ledger`.
    """
    while True:
        path, acknowledged = killed_at_once(root, after, samples, block)
        try:
            with Run.load(path) as run:
                assert run.samples <= samples
        except RunFolderError as torn:
            assert "checksums" in str(torn)
        else:
            return path, acknowledged


def killed_at_once(root, after, samples, block):
    """Path and acknowledged samples of a run whose writer was killed."""
    command = [sys.executable, str(WRITER), str(root), str(samples), str(block)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as writer:
        assert writer.stdout is not None
        path = Path(writer.stdout.readline().strip())
        acknowledged = 0
        while acknowledged < after:
            acknowledged = int(writer.stdout.readline())
        os.kill(writer.pid, signal.SIGKILL)
        rest = writer.stdout.read().split("\n")
        acknowledged = max([acknowledged, *(int(x) for x in rest[:-1] if x)])
    return path, acknowledged


@pytest.fixture(scope="module")
def killed_once(tmp_path_factory):
    return cache(lambda after: killed(tmp_path_factory.mktemp("killed"), after=after))


@pytest.fixture
def killed_run(killed_once, tmp_path):
    """Path of a copy, and acknowledged samples, of a run killed after so many."""
    if sys.platform == "win32":
        pytest.skip("SIGKILL is POSIX")

    def copied(after=150 * 1024):
        path, acknowledged = killed_once(after)
        return shutil.copytree(path, tmp_path / path.name), acknowledged

    return copied


@pytest.mark.parametrize("after", [1024, 9 * 1024, 60 * 1024])
def test_a_killed_run_keeps_all_but_the_block_in_flight(bench, killed_run, after):
    path, acknowledged = killed_run(after)
    made = bench.codes(200_000)
    with Run.load(path) as run:
        assert run.status == "running"
        assert run.samples >= acknowledged - 1024
        stored = run.signal("V_K").scope_codes(0, run.samples)
        np.testing.assert_array_equal(stored, made[1, : run.samples])
    assert not verify(path).sound
    recovery = recover(path)
    assert recovery.samples >= acknowledged - 1024
    with h5py.File(path / "data.h5", "r") as plain:
        assert plain["samples/V_K"].shape[0] == recovery.samples
    verdict = verify(path)
    assert verdict.sound, verdict.findings
    with Run.load(path) as run:
        assert run.status == "recovered"
        spikes = np.arange(701, run.samples, 701)
        assert abs(run.spikes.size - spikes.size) <= 1
        np.testing.assert_array_equal(
            np.ceil(run.spikes["sample"][: spikes.size - 1]), spikes[:-1]
        )
        signal_ = run.signal("V_C1")
        picture = signal_.trace(cells=3)
        assert picture.high.max() == signal_[:].max()
    with pytest.raises(RunFolderError, match="not cut short"):
        recover(path)


def test_a_killed_run_whose_data_was_deleted_had_samples(killed_run):
    """It was said to have been cut short before its first sample."""
    path, _ = killed_run()
    (path / "data.h5").unlink()
    assert summary(path).status == "data gone"
    with pytest.raises(RunFolderError, match="moved or deleted"):
        Run.load(path)


@pytest.mark.parametrize("byte", [3, 25, 33, 37, 200])
def test_a_run_whose_ledger_is_damaged_is_recovered_from_its_file(killed_run, byte):
    path, acknowledged = killed_run()
    ledger = bytearray((path / "ledger.bin").read_bytes())
    ledger[byte] ^= 0x10
    (path / "ledger.bin").write_bytes(ledger)
    assert recover(path).samples >= acknowledged - 1024
    assert (path / "ledger.bin").read_bytes() == ledger


def test_what_a_kill_tore_is_whole_again_by_the_ledger(bench, killed_run):
    """A kill between two pages of one write; it was an error of HDF5's."""
    path, acknowledged = killed_run(9 * 1024)
    with Run.load(path) as run:
        torn = run.table("checks/V_K").id.get_chunk_info(0).byte_offset
    with (path / "data.h5").open("r+b") as file:
        file.seek(torn)
        file.write(bytes(range(1, 9)))
    with (
        Run.load(path) as run,
        pytest.raises(RunFolderError, match=r"checksums of V_K.*tactile-lab recover"),
    ):
        run.samples  # noqa: B018
    assert recover(path).samples >= acknowledged - 1024
    made = bench.codes(200_000)
    with Run.load(path) as run:
        stored = run.signal("V_K").scope_codes(0, run.samples)
        np.testing.assert_array_equal(stored, made[1, : run.samples])


@pytest.mark.parametrize("after", [1024, 9 * 1024])
def test_a_killed_run_without_a_ledger_is_recovered_from_its_file(
    bench, killed_run, after
):
    """As versions before the ledger left it; a short one was called empty and sound."""
    path, acknowledged = killed_run(after)
    (path / "ledger.bin").unlink()
    done = recover(path)
    assert done.samples >= acknowledged - 1024
    verdict = verify(path)
    assert verdict.sound, verdict.findings
    made = bench.codes(200_000)
    with Run.load(path) as run:
        stored = run.signal("V_K").scope_codes(0, run.samples)
        np.testing.assert_array_equal(stored, made[1, : run.samples])
        assert after == 1024 or run.table("current").shape[0] > 0


def test_a_run_whose_ledger_and_file_are_damaged_is_not_called_empty(killed_run):
    path, _ = killed_run()
    (path / "ledger.bin").unlink()
    data = bytearray((path / "data.h5").read_bytes())
    data[:64] = bytes(64)
    data += bytes(1 << 18)  # as long as a file with samples
    (path / "data.h5").write_bytes(data)
    before = {file.name: file.read_bytes() for file in path.iterdir() if file.is_file()}
    with pytest.raises(RunFolderError, match=r"may hold samples\. Nothing was changed"):
        recover(path)
    assert before == {f.name: f.read_bytes() for f in path.iterdir() if f.is_file()}


def test_a_recovery_does_not_make_a_changed_run_json_good(killed_run):
    path, _ = killed_run()
    told = (path / "run.json").read_text()
    (path / "run.json").write_text(told.replace("started", "starved"))
    recover(path)
    (found,) = verify(path).findings
    assert str(found).startswith("run.json: was changed before the run was recovered")


def test_a_recovery_that_cannot_write_says_what_to_do(killed_run):
    path, acknowledged = killed_run()
    # neither written nor removed, as on a disk that may only be read
    (path / "data.recovering.h5").mkdir()
    with pytest.raises(RecordingError, match=r"cannot be written.*Copy it to where"):
        recover(path)
    (path / "data.recovering.h5").rmdir()
    assert recover(path).samples >= acknowledged - 1024


def test_one_damaged_entry_of_the_ledger_does_not_end_it(killed_run):
    path, acknowledged = killed_run()
    ledger = bytearray((path / "ledger.bin").read_bytes())
    at = ledger.index(b"current".ljust(24, b"\0"))  # the first row of a table
    ledger[at + 40] ^= 0x10
    (path / "ledger.bin").write_bytes(ledger)
    assert recover(path).samples >= acknowledged - 1024


def test_a_recovery_that_is_told_to_end_leaves_the_run_as_it_was(killed_run):
    """A copy as large as the run stayed beside it."""
    path, acknowledged = killed_run()
    before = {file.name for file in path.iterdir()}

    def end(done):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        recover(path, end)
    assert {file.name for file in path.iterdir()} == before
    assert recover(path).samples >= acknowledged - 1024


def test_a_living_run_is_left_alone(bench, recorder, folder):
    bench.play(recorder, bench.codes(5000), 500)
    with pytest.raises(RunFolderError, match="still being recorded"):
        recover(folder.path)
    verdict = verify(folder.path)
    assert verdict.sound, verdict.findings
    assert "still being written" in verdict.notes[0]
    recorder.close("complete", 5000)


def test_a_reader_sees_samples_while_they_are_written(bench, recorder, folder):
    made = bench.codes(9000)
    recorder.segment(bench.stream(), 0.0)
    recorder.append(bench.block(made, 0, 3000))
    with Run.load(folder.path) as run:
        before = run.samples
        assert before == 2048
        recorder.append(bench.block(made, 3000, 6000))
        run.refresh()
        assert run.samples == 8192
        np.testing.assert_array_equal(
            run.signal("V_K").scope_codes(0, 8192), made[1, :8192]
        )
        recorder.close("complete", 9000)
        run.refresh()
        assert (run.samples, run.status) == (9000, "complete")


def test_a_quiet_stream_reaches_the_disk_within_the_cadence(bench, recorder, folder):
    made = bench.codes(600)
    recorder.segment(bench.stream(), 0.0)
    recorder.append(bench.block(made, 0, 300))
    time.sleep(0.6)
    recorder.append(bench.block(made, 300, 10))
    with Run.load(folder.path) as run:
        assert run.samples == 310
    recorder.append(bench.block(made, 310, 290))
    recorder.close("complete", 600)
    assert verify(folder.path).sound


@pytest.mark.parametrize("size", [0, 48, 700])
def test_a_run_killed_before_its_first_sample_is_closed(
    bench, complete, tmp_path, size
):
    data = bytearray((complete / "data.h5").read_bytes()[:size])
    if data:
        data[11] = 5  # HDF5's mark of a file that is open for writing with SWMR
    folder = RunFolder.create(tmp_path, "early", {})
    folder._log.close()  # what the kernel does when the process dies
    (folder.path / "data.h5").write_bytes(data)
    with pytest.raises(RunFolderError, match="cut short before its first sample"):
        Run.load(folder.path)
    assert recover(folder.path).samples == 0
    verdict = verify(folder.path)
    assert verdict.sound, verdict.findings
    assert json.loads((folder.path / "run.json").read_text())["status"] == "recovered"
