"""Damage is found and located; what a crash cut short is made whole again."""

import json
import os
import random
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

from tactile_lab.commands.show import describe, rows
from tactile_lab.errors import RecordingError, RunFolderError
from tactile_lab.store.certificate import write_certificate
from tactile_lab.store.export.ro_crate import crate
from tactile_lab.store.recover import recover
from tactile_lab.store.run import Run
from tactile_lab.store.verify import verify

WRITER = Path(__file__).with_name("killed_writer.py")


@pytest.fixture
def complete(bench, recorder, folder):
    """A sound run of 5 chunks of 1024 samples, the last one short."""
    bench.play(recorder, bench.codes(5000), 500)
    recorder.current(1.0, 0.5, 0.5)
    recorder.close("complete", 5000)
    write_certificate(folder.path)
    return folder.path


def place(path, dataset, chunk):
    """(offset, size) of a chunk in the file."""
    with h5py.File(path / "data.h5") as file:
        info = file[dataset].id.get_chunk_info(chunk)
    return info.byte_offset, info.size


def damage(path, offset, flip=0x10):
    data = bytearray((path / "data.h5").read_bytes())
    data[offset] ^= flip
    (path / "data.h5").write_bytes(data)


def test_sound_run_has_nothing_lost(complete):
    verdict = verify(complete)
    assert verdict.sound
    told = "loss: 0 of 10,000 samples, 0 of 7 spikes in them"
    assert str(verdict.certificate) == told
    loss = json.loads((complete / "run.json").read_text())["loss"]
    assert (loss["samples"], loss["spikes"]) == (0, 0)


@pytest.mark.parametrize("at", [16, 750])
def test_a_hole_among_the_texts_of_the_file_is_damage(complete, at):
    """HDF5 never came back from reading them."""
    data = bytearray((complete / "data.h5").read_bytes())
    begin = data.index(b"GCOL") + at
    data[begin : begin + 512] = bytes(512)
    (complete / "data.h5").write_bytes(data)
    (told,) = verify(complete).findings
    assert "is damaged at byte" in str(told)
    with pytest.raises(RunFolderError, match="is damaged at byte"):
        Run.load(complete)


@pytest.mark.parametrize("soft", [True, False], ids=["soft", "external"])
def test_samples_that_lie_in_another_file_are_damage(complete, tmp_path, soft):
    """A run whose samples were a link to another run's was called sound."""
    other = shutil.copy(complete / "data.h5", tmp_path / "other.h5")
    with h5py.File(complete / "data.h5", "r+") as file:
        del file["samples/V_K"]
        file["samples/V_K"] = (
            h5py.SoftLink("/samples/V_C1")
            if soft
            else h5py.ExternalLink(str(other), "/samples/V_K")
        )
    (told,) = verify(complete).findings
    assert "/samples/V_K leads elsewhere" in str(told)
    with pytest.raises(RunFolderError, match="leads elsewhere"):
        Run.load(complete)


def test_a_table_that_claims_more_than_it_holds_fills_no_memory(complete):
    """`verify`, `show` and `report` ended in a MemoryError."""
    with h5py.File(complete / "data.h5", "r+") as file:
        file["current"].resize((10**12,))
    assert "claims 1,000,000,000,000 rows" in str(verify(complete).findings[0])
    with Run.load(complete) as run, pytest.raises(RunFolderError, match="is damaged"):
        run.records("current")


@pytest.mark.parametrize("kinds", [["samples"], ["samples", "checks", "pyramid"]])
def test_a_signal_whose_samples_are_gone_is_damage(complete, kinds):
    """One flipped bit in a name is enough to lose it from the file's list."""
    with h5py.File(complete / "data.h5", "r+") as file:
        for kind in kinds:
            del file[f"{kind}/V_C1"]
    verdict = verify(complete)
    (finding,) = verdict.findings
    assert finding.where == "data.h5 /samples/V_C1"
    assert "5000" in finding.what


def test_a_group_of_samples_that_is_gone_is_damage(complete):
    with h5py.File(complete / "data.h5", "r+") as file:
        del file["samples"]
    found = [finding.where for finding in verify(complete).findings]
    assert found == ["data.h5 /samples/V_C1", "data.h5 /samples/V_K"]


def test_a_certificate_that_the_data_does_not_bear_out_is_damage(complete):
    info = json.loads((complete / "run.json").read_text())
    info["loss"]["spikes_offline"] += 1
    (complete / "run.json").write_text(json.dumps(info))
    (finding,) = verify(complete).findings
    assert finding.where == "run.json loss.spikes_offline"
    assert "says 8; counted again it is 7" in finding.what


@pytest.mark.parametrize(
    ("place", "name", "value"),
    [
        ("samples/V_K", "gain", 10.0),
        ("samples/V_K", "gain", float("nan")),
        ("samples/V_C1", "unit", "A"),
        ("/", "interval", 0.0),
        ("/", "simulated", False),
    ],
)
def test_a_scale_or_unit_that_was_changed_is_damage(complete, place, name, value):
    """HDF5 has no checksum of an attribute; a gain ten times as large was sound."""
    with h5py.File(complete / "data.h5", "r+") as file:
        file[place].attrs[name] = value
    wheres = [finding.where for finding in verify(complete).findings]
    assert f"data.h5 /{place}".replace("//", "/") in wheres


@pytest.mark.parametrize("name", ["simulated", "notes", "instruments", "started"])
def test_what_run_json_says_is_damage_when_changed(complete, name):
    info = json.loads((complete / "run.json").read_text())
    info[name] = "another"
    (complete / "run.json").write_text(json.dumps(info))
    (finding,) = verify(complete).findings
    assert str(finding).startswith("run.json: was changed after it was written")


def test_a_run_of_an_older_version_is_no_damage(complete):
    info = json.loads((complete / "run.json").read_text())
    del info["sha256"], info["constants"]
    (complete / "run.json").write_text(json.dumps(info))
    assert verify(complete).sound


def test_any_flipped_bit_is_found_or_changes_nothing(complete):
    """A slice of tests/benchmarks/fuzz.py."""
    recorded = content(complete)
    sound = {name: (complete / name).read_bytes() for name in ("data.h5", "run.json")}
    for seed in range(80):
        chance = random.Random(seed)
        name = chance.choice(("data.h5", "data.h5", "run.json"))
        data = bytearray(sound[name])
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
        (complete / name).write_bytes(data)
        if verify(complete).sound:
            assert content(complete) == recorded, seed
        (complete / name).write_bytes(sound[name])


def content(path):
    """Everything that a person can read of a run."""
    held = {"run.json": json.loads((path / "run.json").read_text())}
    with Run.load(path) as run:
        for name in run.signals:
            signal = run.signal(name)
            held[name] = (signal[:].tobytes(), signal.time().tobytes(), signal.unit)
        for name in ("spikes", "current", "segments"):
            held[name] = run.records(name).tobytes()
    return held


@pytest.mark.parametrize("chunk", [0, 2, 4])
@pytest.mark.parametrize("where", [0, 0.25, 0.5])
def test_a_flipped_bit_is_located(complete, chunk, where):
    offset, size = place(complete, "samples/V_K", chunk)
    damage(complete, offset + int(where * size))
    verdict = verify(complete)
    first = chunk * 1024
    assert [f.where for f in verdict.findings] == [
        f"data.h5 /samples/V_K[{first}:{min(first + 1024, 5000)}]"
    ]


@pytest.mark.parametrize("byte", range(12))
def test_a_flipped_bit_in_the_head_of_a_chunk_is_located(complete, byte):
    """There the filter reads how much to decompress, and would run out of memory."""
    offset, _ = place(complete, "samples/V_K", 2)
    damage(complete, offset + byte, flip=0x01)
    verdict = verify(complete)
    assert [f.where for f in verdict.findings] == ["data.h5 /samples/V_K[2048:3072]"]


@pytest.mark.parametrize("table", ["spikes", "current", "segments"])
def test_a_flipped_bit_in_a_table_is_located(complete, table):
    offset, _ = place(complete, table, 0)
    damage(complete, offset + 3)
    verdict = verify(complete)
    assert f"data.h5 /{table}" in [f.where for f in verdict.findings]


def test_a_truncated_file_is_found(complete):
    data = (complete / "data.h5").read_bytes()
    (complete / "data.h5").write_bytes(data[: len(data) // 2])
    verdict = verify(complete)
    assert not verdict.sound
    assert verdict.findings[0].where == "data.h5"
    assert "bytes are missing at the end" in verdict.findings[0].what
    assert any("/samples/" in finding.where for finding in verdict.findings)


def test_a_missing_chunk_is_located(complete):
    with h5py.File(complete / "data.h5", "r+") as file:
        old = file["samples/V_K"]
        codes, attrs = old[:], dict(old.attrs)
        del file["samples/V_K"]
        new = file.create_dataset(
            "samples/V_K", (5000,), "i1", chunks=(1024,), maxshape=(None,)
        )
        new.attrs.update(attrs)
        for first in (0, 1024, 3072, 4096):
            new[first : first + 1024] = codes[first : first + 1024]
    verdict = verify(complete)
    (finding,) = verdict.findings
    assert finding.where == "data.h5 /samples/V_K[2048:3072]"
    assert "missing" in finding.what
    assert "2.048 s" in finding.what


def test_a_missing_file_and_a_wrong_counter_are_found(complete):
    info = json.loads((complete / "run.json").read_text())
    info["samples"]["V_K"]["written"] = 4999
    (complete / "run.json").write_text(json.dumps(info))
    assert "4999" in str(verify(complete).findings[0])
    (complete / "data.h5").unlink()
    assert verify(complete).findings[0].where == "data.h5"
    with pytest.raises(RunFolderError, match="moved or deleted"):
        Run.load(complete)


def test_a_changed_scene_is_found(bench, recorder, folder):
    folder.write_text("scene.toml", "[protocol]\n")
    bench.play(recorder, bench.codes(2000), 500)
    recorder.close("complete", 2000)
    assert verify(folder.path).sound
    (folder.path / "scene.toml").write_text("[protocol]\nhold = 1\n")
    verdict = verify(folder.path)
    assert [finding.where for finding in verdict.findings] == ["scene.toml"]
    assert verdict.certificate.clean
    (folder.path / "scene.toml").unlink()
    assert "cannot be read" in verify(folder.path).findings[0].what


def test_a_spike_that_is_not_in_the_samples_is_named(complete):
    with h5py.File(complete / "data.h5", "r+") as file:
        file["spikes"][2, "sample"] = 1234.5
    verdict = verify(complete)
    assert verdict.certificate.differing == 2
    assert "sample 1234.500" in str(verdict.findings[0])


@pytest.mark.parametrize(
    ("searched", "told"),
    [(True, "spikes, not possible to check"), (False, "spikes were not looked for")],
)
def test_spikes_cannot_be_checked_where_v_k_is_not_stored(
    bench, folder, searched, told
):
    from tactile_lab.store.layout import Layout
    from tactile_lab.store.recorder import Recorder

    layout = Layout(
        signals=("V_C1",),
        detection=bench.DETECTION if searched else None,
        simulated=True,
    )
    recorder = Recorder(folder, layout, reserve=0)
    bench.play(recorder, bench.codes(3000), 500)
    recorder.close("complete", 3000)
    certificate = write_certificate(folder.path)
    assert certificate.spikes is None
    assert told in str(certificate)
    shown = [f"{name} {value}" for name, value in rows(describe(folder.path))]
    assert ("spikes not looked for" in shown) is not searched
    with Run.load(folder.path) as run:
        described = json.dumps(crate(run))
    assert ("spikes not looked for" in described) is not searched


def test_samples_the_scope_made_but_nobody_stored_are_counted(bench, recorder, folder):
    bench.play(recorder, bench.codes(5000), 500)
    recorder.close("faulted", 5500)
    assert write_certificate(folder.path).samples == 1000


def killed(root, *, after, samples=200_000, block=1024):
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

    def copied(after=150 * 1024):
        path, acknowledged = killed_once(after)
        return shutil.copytree(path, tmp_path / path.name), acknowledged

    return copied


@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL is POSIX")
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


@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL is POSIX")
@pytest.mark.parametrize("byte", [3, 25, 33, 37, 200])
def test_a_run_whose_ledger_is_damaged_is_recovered_from_its_file(killed_run, byte):
    path, acknowledged = killed_run()
    ledger = bytearray((path / "ledger.bin").read_bytes())
    ledger[byte] ^= 0x10
    (path / "ledger.bin").write_bytes(ledger)
    assert recover(path).samples >= acknowledged - 1024
    assert (path / "ledger.bin").read_bytes() == ledger


@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL is POSIX")
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


@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL is POSIX")
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


@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL is POSIX")
def test_a_recovery_does_not_make_a_changed_run_json_good(killed_run):
    path, _ = killed_run()
    told = (path / "run.json").read_text()
    (path / "run.json").write_text(told.replace("started", "starved"))
    recover(path)
    (found,) = verify(path).findings
    assert str(found).startswith("run.json: was changed before the run was recovered")


@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL is POSIX")
def test_a_recovery_that_cannot_write_says_what_to_do(killed_run):
    path, acknowledged = killed_run()
    # neither written nor removed, as on a disk that may only be read
    (path / "data.recovering.h5").mkdir()
    with pytest.raises(RecordingError, match=r"cannot be written.*Copy it to where"):
        recover(path)
    (path / "data.recovering.h5").rmdir()
    assert recover(path).samples >= acknowledged - 1024


@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL is POSIX")
def test_one_damaged_entry_of_the_ledger_does_not_end_it(killed_run):
    path, acknowledged = killed_run()
    ledger = bytearray((path / "ledger.bin").read_bytes())
    at = ledger.index(b"current".ljust(24, b"\0"))  # the first row of a table
    ledger[at + 40] ^= 0x10
    (path / "ledger.bin").write_bytes(ledger)
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
    from tactile_lab.store.folder import RunFolder

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
