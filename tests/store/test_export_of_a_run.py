"""Exports of a run tell all of it: force, rate, drain current, holds, settings."""

import csv
import json
import shutil
import zipfile
from urllib.parse import quote, unquote

import numpy as np
import pytest
import scipy.io
from click.testing import CliRunner
from full_disk import full_after

from tactile_lab.cli import cli
from tactile_lab.engine.execution import Execution
from tactile_lab.errors import RunFolderError
from tactile_lab.neuro.formats import of_whole_run
from tactile_lab.scene.load import load
from tactile_lab.store.export import csv as to_csv
from tactile_lab.store.export import mat as to_mat
from tactile_lab.store.export import netcdf as to_netcdf
from tactile_lab.store.export import packed, ro_crate
from tactile_lab.store.export.content import about
from tactile_lab.store.export.lines import fixed, steps, written
from tactile_lab.store.folder import lock, read_info, write_info
from tactile_lab.store.remarks import add_note
from tactile_lab.store.run import Run
from tactile_lab.store.selection import Selection

OVERRIDES = (
    'protocol.levels=["200 mN"]',
    "protocol.hold=0.8 s",
    "protocol.rest=0.3 s",
    "record.sample_rate=200 kS/s",
)
NOTES = {"operator": "Ada B. Petaru", "lab": "Touch", "institution": "TU"}
SIGNALS = ("V_C1", "V_C2", "V_K", "coil_current", "force", "rate", "I_DS")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("runs")
    done = Execution(load("demo", OVERRIDES), out, notes=NOTES).run()
    assert done.exit_code == 0, done.reason
    return done.folder


@pytest.fixture
def run(folder):
    with Run.load(folder) as loaded:
        yield loaded


@pytest.fixture(scope="module")
def columns(folder):
    with Run.load(folder) as loaded:
        return Selection().read(loaded)


def stood(run):
    """When the force of the one trial stood, s of run time: a little late."""
    (trial,), (held,) = run.trials, run.holds
    assert trial["hold_start"] <= held[0] < trial["hold_start"] + 0.1
    assert held[1] - held[0] == pytest.approx(0.8, abs=0.03)
    return [trial["start"] + time for time in held]


def test_csv_holds_what_is_derived_beside_what_was_stored(run, columns, tmp_path):
    told = []
    to_csv.export(run, tmp_path, Selection(), told.append)
    time, expected = columns
    with (tmp_path / "signals.csv").open() as file:
        head = file.readline().strip().split(",")
        table = np.loadtxt(file, delimiter=",")
    units = ("V", "V", "V", "A", "N", "Hz", "A")
    pairs = zip(SIGNALS, units, strict=True)
    assert head == ["time_s", *(f"{name}_{unit}" for name, unit in pairs)]
    np.testing.assert_allclose(table[:, 0], time, atol=1e-9)
    for column, name in zip(table.T[1:], SIGNALS, strict=True):
        np.testing.assert_allclose(column, expected[name], rtol=1e-11, atol=1e-9)
    middle = time.searchsorted(1.0)
    assert expected["force"][middle] == pytest.approx(0.2, rel=0.02)
    assert expected["rate"].max() > 5
    assert told[-1] == 1.0 and told == sorted(told)
    size = (tmp_path / "signals.csv").stat().st_size
    assert size <= to_csv.size(run, Selection()) < 2 * size


def test_csv_says_what_the_run_was_and_when_it_held(run, tmp_path):
    to_csv.export(run, tmp_path, Selection(rate=1e3))
    with (tmp_path / "about.csv").open(newline="") as file:
        about = dict(csv.reader(file))
    assert about["scene"] == "demo"
    assert about["note operator"] == "Ada B. Petaru"
    # what the numbers rest on goes with them
    assert about["force source"].startswith("derived: by the run's calibration")
    assert about["force uncertainty"] == "not stated"
    assert about["loss"].startswith("0 of ")
    told = [text for key, text in about.items() if key.startswith("assumption ")]
    assert any("Table 1's value as printed" in text for text in told)
    assert about["assumption 1"].startswith("force from Eq. (2)")
    assert float(about["V_C1 one code V"]) == run.signal("V_C1").gain
    assert 'levels = ["0.2 N"]' in about["scene.toml"].replace("\n    ", "").replace(
        ",\n]", "]"
    )
    with (tmp_path / "trials.csv").open(newline="") as file:
        (trial,) = csv.DictReader(file)
    held = [float(trial[name]) for name in ("hold_start_s", "hold_end_s")]
    assert held == pytest.approx(stood(run), abs=1e-6)
    assert trial["complete"] == "1"
    with (tmp_path / "current.csv").open(newline="") as file:
        forces = [float(row["force_N"]) for row in csv.DictReader(file)]
    assert max(forces) == pytest.approx(0.2, rel=0.02)


def test_a_force_alone_has_no_more_than_was_said(run, tmp_path):
    force = Selection(signals=("force", "V_K"))
    file, *_ = to_csv.export(run, tmp_path, force)
    assert file.stat().st_size <= to_csv.size(run, force)


def test_what_is_exported_says_which_part_it_is_and_where_it_came_from(run):
    told = about(run, Selection(start=0.5, end=9.0, rate=30e3))
    assert (told["from_s"], told["until_s"]) == (0.5, run.duration)
    assert told["samples_averaged"] == 7
    assert told["sample_rate_Hz"] == pytest.approx(200e3 / 7, abs=1e-6)
    assert told["seed"] == run.info["seed"]
    assert f"tactile-lab {run.info['environment']['tactile-lab']}" in told["software"]
    assert told["detection threshold_V"] == run.info["detection"]["threshold_V"]
    whole = about(run, Selection())
    assert whole["sample_rate_Hz"] == 200e3
    assert not {"from_s", "until_s", "samples_averaged"} & set(whole)


def test_a_rate_that_is_no_whole_part_of_the_run_s_is_told(folder, tmp_path):
    asked = ["export", str(folder), "--to", "csv", "--out", str(tmp_path / "csv")]
    told = CliRunner().invoke(cli, [*asked, "--signal", "V_K", "--rate", "150 kS/s"])
    assert told.exit_code == 0 and "200000 S/s, not 150000 S/s" in told.output
    told = CliRunner().invoke(cli, [*asked, "--signal", "V_K", "--rate", "1 kS/s"])
    assert told.exit_code == 0 and "not" not in told.output


@pytest.mark.parametrize("form", ["csv", "mat", "netcdf", "nwb", "parquet"])
def test_a_signal_that_is_named_twice_is_there_once(folder, tmp_path, form):
    out, twice = tmp_path / "made.nwb", ("--signal", "V_K", "--signal", "V_K")
    asked = ["export", str(folder), "--to", form, "--out", str(out), *twice]
    told = CliRunner().invoke(cli, asked)
    assert told.exit_code == 0, told.output
    if form == "csv":
        assert (out / "signals.csv").read_text().startswith("time_s,V_K_V\n")


@pytest.mark.parametrize("form", [to_csv, to_mat])
def test_what_a_run_without_samples_derives_is_exported(tmp_path, form):
    """A value each millisecond, or as often as is asked."""
    asked = (*OVERRIDES, 'record.signals=["force", "spikes"]')
    done = Execution(load("demo", asked), tmp_path / "runs").run()
    with Run.load(done.folder) as run:
        assert run.signals == () and run.spikes.size > 5
        for part, step in ((Selection(), 1e-3), (Selection(start=1.0, rate=50), 0.02)):
            (file, *_) = form.export(run, tmp_path / "made", part)
            time, columns = part.read(run)
            assert set(columns) == {"force", "rate"}
            np.testing.assert_allclose(time, np.arange(part.start, run.duration, step))
            np.testing.assert_array_equal(columns["force"], run.force.at(time))
            assert columns["force"].max() == pytest.approx(0.2, rel=0.02)
            assert columns["rate"].max() > 5
            if form is to_csv:
                table = np.loadtxt(file, delimiter=",", skiprows=1)
                np.testing.assert_allclose(table[:, 0], time, atol=1e-9)
                np.testing.assert_allclose(table[:, 1], columns["force"], atol=1e-9)
            else:
                read = scipy.io.loadmat(file, simplify_cells=True)
                np.testing.assert_array_equal(read["time"], time)
                np.testing.assert_allclose(read["rate"]["values"], columns["rate"])


def test_what_people_noted_is_exported_with_its_time(folder, tmp_path):
    copy = tmp_path / "run"
    shutil.copytree(folder, copy)
    add_note(copy, "of the whole")
    add_note(copy, "touched", 0.5)
    add_note(copy, "later", 1.5)
    with Run.load(copy) as run:
        to_csv.export(run, tmp_path / "csv", Selection(end=1.0))
    with (tmp_path / "csv" / "remarks.csv").open(newline="") as file:
        found = [(row["time_s"], row["text"]) for row in csv.DictReader(file)]
    assert found == [("", "of the whole"), ("0.5", "touched")]


def test_matlab_keeps_notes_whose_names_it_does_not_take(run, tmp_path, monkeypatch):
    notes = {
        "a b": "1",
        "a_b": "2",
        "gr\u00f6\u00dfe": "3",
        "x" * 99: "4",
        "x" * 98: "5",
    }
    monkeypatch.setitem(run.info, "notes", notes)
    to_mat.export(run, tmp_path / "run.mat", Selection(signals=("V_K",), end=0.01))
    info = scipy.io.loadmat(tmp_path / "run.mat", simplify_cells=True)["info"]
    kept = {key: text for key, text in info.items() if key.startswith("note_")}
    assert list(kept.values()) == list(notes.values())
    assert all(key.isascii() and len(key) <= 63 for key in kept)


def test_matlab_holds_the_same(run, columns, tmp_path):
    to_mat.export(run, tmp_path / "run.mat", Selection())
    read = scipy.io.loadmat(tmp_path / "run.mat", simplify_cells=True)
    for name in SIGNALS:
        np.testing.assert_allclose(
            read[name]["values"], columns[1][name], rtol=1e-6, atol=1e-12
        )
    assert read["force"]["unit"] == "N"
    held = [read["trials"][name] for name in ("hold_start", "hold_end")]
    assert held == pytest.approx(stood(run))
    assert read["info"]["note_lab"] == "Touch"
    assert not list(tmp_path.glob(".*")), "no part of a file stays"


def test_netcdf_is_read_by_xarray(run, columns, tmp_path):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    from tactile_lab.store.export import netcdf

    file = tmp_path / "run.nc"
    netcdf.export(run, file, Selection())
    with xarray.open_dataset(file, engine="h5netcdf") as read:
        assert tuple(read.data_vars) == SIGNALS
        for name in SIGNALS:
            np.testing.assert_allclose(
                read[name], columns[1][name], rtol=1e-6, atol=1e-12
            )
        assert read["force"].units == "N"
        assert read.attrs["scene"] == "demo"
    with xarray.open_dataset(file, group="trials", engine="h5netcdf") as trials:
        assert trials["label"].values.tolist() == ["200 mN"]
    part = Selection(signals=("V_K",), start=0.5, end=0.6, rate=1e4)
    netcdf.export(run, file, part)
    with xarray.open_dataset(file, engine="h5netcdf") as read:
        assert read["V_K"].shape == (1000,)


def test_parquet_is_read_with_its_units(run, columns, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    from tactile_lab.store.export import parquet as to_parquet

    to_parquet.export(run, tmp_path, Selection())
    read = parquet.read_table(tmp_path / "signals.parquet")
    assert read.column_names == ["time", *SIGNALS]
    np.testing.assert_allclose(read["V_C1"], columns[1]["V_C1"], rtol=1e-6)
    assert read.schema.field("I_DS").metadata == {b"unit": b"A"}
    assert read.schema.metadata[b"note lab"] == b"Touch"
    attrs = (
        pytest.importorskip("pandas").read_parquet(tmp_path / "trials.parquet").attrs
    )
    assert (attrs["units"]["level"], attrs["about"]["note lab"]) == ("N", "Touch")
    (trial,) = parquet.read_table(tmp_path / "trials.parquet").to_pylist()
    held = [trial[name] for name in ("hold_start", "hold_end")]
    assert held == pytest.approx(stood(run))


def test_nwb_says_who_where_and_with_what(run, tmp_path):
    pynwb = pytest.importorskip("pynwb")
    from tactile_lab.store.export import nwb

    nwb.export(run, tmp_path / "run.nwb", Selection())
    with pynwb.NWBHDF5IO(str(tmp_path / "run.nwb"), "r") as reader:
        session = reader.read()
        assert session.experimenter == ("Petaru, Ada B.",)
        assert (session.lab, session.institution) == ("Touch", "TU")
        assert set(session.devices) >= {"coil", "scope"}
        assert "[protocol]" in session.source_script
        force = session.stimulus["force"]
        assert max(force.data[:]) == pytest.approx(0.2, rel=0.02)
        assert set(session.processing["ecephys"].data_interfaces) == {"rate", "I_DS"}
        held = [session.trials[name][0] for name in ("hold_start", "hold_end")]
        assert held == pytest.approx(stood(run))


def test_nwb_of_spikes_alone_passes_its_inspector(tmp_path):
    inspector = pytest.importorskip("nwbinspector")
    from tactile_lab.store.export import nwb

    alone = (*OVERRIDES, 'record.signals=["spikes"]')
    done = Execution(load("demo", alone), tmp_path, notes=NOTES).run()
    with Run.load(done.folder) as loaded:
        assert loaded.signals == ()
        nwb.export(loaded, tmp_path / "run.nwb", Selection())
    found = inspector.inspect_nwbfile(nwbfile_path=tmp_path / "run.nwb")
    told = {message.check_function_name for message in found}
    # a sensor has no species, this run one trial
    assert told <= {"check_subject_species_exists", "check_single_row"}


def test_the_folder_is_an_ro_crate(run, folder, tmp_path):
    rocrate = pytest.importorskip("rocrate.rocrate")
    (file,) = ro_crate.export(run, folder / ro_crate.METADATA, Selection())
    read = rocrate.ROCrate(folder)
    assert read.mainEntity is None and read.name == f"Pulses: {folder.name}"
    parts = {entity.id for entity in read.data_entities}
    assert {"data.h5", "run.json", "scene.toml", "inputs/pulses.py"} <= parts
    assert read.get("#measurement")["agent"][0]["name"] == "Ada B. Petaru"
    file.unlink()
    ro_crate.export(run, tmp_path / "run.zip", Selection())
    assert rocrate.ROCrate(tmp_path / "run.zip").get("data.h5") is not None
    with pytest.raises(RunFolderError, match="whole run folder"):
        ro_crate.export(run, tmp_path / "x.zip", Selection(end=1.0))


def test_a_crate_names_all_that_is_needed_to_repeat_the_run(tmp_path):
    """A waveform's table may end in anything and be called anything."""
    rocrate = pytest.importorskip("rocrate.rocrate")
    table = tmp_path / "Kraft \u00e4#1.dat"
    table.write_text("time_s,force_N\n0,0\n0.1,0.1\n0.2,0\n")
    asked = (f"protocol.file={table}", 'record.signals=["force", "field"]')
    done = Execution(load("waveform", asked), tmp_path / "runs").run()
    folder = done.folder
    (folder / f"{folder.name}.nwb").write_text("an export")
    (folder / f"{folder.name}.brian2.py").write_text("another")
    (folder / "ledger.bin").write_text("as a run that was killed has it")
    with Run.load(folder) as run:
        ro_crate.export(run, tmp_path / "run.zip", Selection())
    with zipfile.ZipFile(tmp_path / "run.zip") as packed:
        names = set(packed.namelist()) - {ro_crate.METADATA}
        (graph,) = [json.loads(packed.read(ro_crate.METADATA))["@graph"]]
        sizes = {name: str(packed.getinfo(name).file_size) for name in names}
    files = {e["@id"]: e["contentSize"] for e in graph if e["@type"] == "File"}
    assert {unquote(name): size for name, size in files.items()} == sizes
    assert names == {
        "data.h5", "run.json", "scene.toml", "log.jsonl", "ledger.bin",
        f"inputs/{table.name}", "inputs/waveform.py",
    }  # fmt: skip
    ids = [entity["@id"] for entity in graph]
    assert "#field%20meter" in ids and not any(" " in one for one in ids)
    read = rocrate.ROCrate(tmp_path / "run.zip")
    assert read.get(f"inputs/{quote(table.name)}") is not None


def test_a_run_that_goes_on_is_no_crate_and_one_cut_short_says_so(folder, tmp_path):
    copy = tmp_path / "run"
    shutil.copytree(folder, copy)
    write_info(copy, {**read_info(copy), "status": "running"})
    with Run.load(copy) as run:
        assert about(run)["status"] == "cut short"
        assert "cut short" in ro_crate.crate(run)["@graph"][1]["description"]
        with (copy / "log.jsonl").open("a") as log:
            assert lock(log)
            assert about(run)["status"] == "running"
            with pytest.raises(RunFolderError, match="still recorded"):
                ro_crate.export(run, tmp_path / "run.zip", Selection())


@pytest.mark.parametrize("form", ["csv", "mat", "netcdf", "nwb", "parquet"])
def test_a_full_disk_is_told_in_plain_words(folder, tmp_path, form, capfd):
    """HDF5 told hundreds of lines of a trace and ended in a segmentation fault."""
    out = tmp_path / "made"
    asked = ["export", str(folder), "--to", form, "--out", str(out)]
    with full_after(50_000):
        done = CliRunner().invoke(cli, asked)
    assert done.exit_code == 2
    assert f"{out} cannot be written: File too large. Name another" in done.output
    assert "Traceback" not in capfd.readouterr().err
    assert not [file for file in tmp_path.rglob("*") if file.is_file()]


@pytest.mark.parametrize("form", ["csv", "mat", "netcdf", "nwb", "parquet"])
def test_a_window_with_nothing_in_it_is_refused_in_every_format(folder, form):
    before = sorted(folder.rglob("*"))
    wrong = ["export", str(folder), "--to", form, "--from", "1 s", "--until", "0.5 s"]
    done = CliRunner().invoke(cli, wrong)
    assert done.exit_code == 2
    assert "nothing from 1 s until 500 ms" in done.output
    assert sorted(folder.rglob("*")) == before


def text(rows):
    return [bytes(row[row != 0]).decode() for row in rows]


def test_numbers_as_text():
    values = np.array([0.0, -0.25, -1e-12, np.nan, 12.000000001, 1e-9])
    assert text(fixed(values)) == [
        "0.000000000", "-0.250000000", "0.000000000", "", "12.000000001",
        "0.000000001",
    ]  # fmt: skip
    held = np.array([1.5, 1.5, np.nan, np.nan, -2e-9])
    assert text(steps(held)) == text(written(held)) == ["1.5", "1.5", "", "", "-2e-09"]


@pytest.mark.parametrize("part", [{}, {"signals": ("V_C1",)}, {"rate": 10e3}])
@pytest.mark.parametrize("form", ["mat", "netcdf", "nwb", "parquet"])
def test_what_a_format_will_take_is_told_as_it_is(run, tmp_path, form, part):
    """It was told up to twenty times too large, and refused where there was room."""
    told, takes = told_and_taken(run, tmp_path / "out", form, Selection(**part))
    assert takes <= told < 1.5 * takes


@pytest.mark.parametrize("form", ["netcdf", "nwb", "parquet"])
def test_what_is_told_of_a_long_run_by_stretches_is_not_less(
    run, tmp_path, form, monkeypatch
):
    monkeypatch.setattr(packed, "PROBES", 2)
    monkeypatch.setattr(packed, "PROBED", run.samples // 3)
    told, takes = told_and_taken(run, tmp_path / "out", form, Selection())
    assert takes <= told < 1.5 * takes


@pytest.mark.parametrize(
    "part", [{}, {"signals": ("V_K",)}, {"signals": ("V_C1", "force")}, {"rate": 10e3}]
)
@pytest.mark.parametrize("probes", [packed.PROBES, 2])
def test_what_csv_will_take_is_told_as_it_is(run, tmp_path, part, probes, monkeypatch):
    """Of V_K, whose text is short where it rests, 1.57 times as much was told."""
    monkeypatch.setattr(packed, "PROBES", probes)
    monkeypatch.setattr(packed, "PROBED", run.samples // 3)
    signals, *_ = to_csv.export(run, tmp_path, Selection(**part))
    takes, told = signals.stat().st_size, to_csv.size(run, Selection(**part))
    assert takes <= told < 1.3 * takes


def told_and_taken(run, out, form, selection):
    """Bytes told beforehand, and those of what was written."""
    for library in ("h5netcdf", "pynwb", "pyarrow"):
        pytest.importorskip(library)
    if form == "nwb" and selection.rate:
        pytest.skip("NWB holds samples as stored")
    module = of_whole_run(form)
    written = module.export(run, out, selection)
    return module.size(run, selection), sum(one.stat().st_size for one in written)


def test_how_much_it_takes_is_reckoned_once(folder, tmp_path, monkeypatch):
    """Of netCDF stretches were packed to tell it, and again to see if there is room."""
    pytest.importorskip("h5netcdf")
    reckoned, whole = [], to_netcdf.size
    monkeypatch.setattr(
        to_netcdf, "size", lambda *of: reckoned.append(of) or whole(*of)
    )
    asked = ["export", str(folder), "--to", "netcdf", "--out", str(tmp_path / "run.nc")]
    assert CliRunner().invoke(cli, asked).exit_code == 0
    assert len(reckoned) == 1
