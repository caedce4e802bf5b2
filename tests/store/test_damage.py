"""Damage is found and located."""

import json
import random
import shutil

import h5py
import pytest

from tactile_lab.commands.show import describe, rows
from tactile_lab.errors import RunFolderError
from tactile_lab.store.certificate import write_certificate
from tactile_lab.store.export.ro_crate import crate
from tactile_lab.store.run import Run
from tactile_lab.store.verify import verify


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


@pytest.mark.parametrize(
    "name", ["produced", "written", "gaps", "spikes_online", "spikes_offline"]
)
def test_a_certificate_that_the_data_does_not_bear_out_is_damage(complete, name):
    info = json.loads((complete / "run.json").read_text())
    true = info["loss"][name]
    info["loss"][name] += 1
    (complete / "run.json").write_text(json.dumps(info))
    (finding,) = verify(complete).findings
    assert finding.where == f"run.json loss.{name}"
    assert f"says {true + 1}; counted again it is {true}" in finding.what


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
    assert verdict.certificate.spikes == 2
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
