"""Spikes come back from the library that reads a format as they went out."""

import gc
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from full_disk import full_after

from tactile_lab.cli import cli
from tactile_lab.errors import ParameterError, RunFolderError
from tactile_lab.neuro import neo as to_neo
from tactile_lab.neuro import scripts
from tactile_lab.neuro.formats import SPIKES, format_of, write
from tactile_lab.neuro.of_run import events_of
from tactile_lab.neuro.tonic import structured
from tactile_lab.skin.events import Events
from tactile_lab.store.selection import Selection


def tell(*words):
    return CliRunner().invoke(cli, [str(word) for word in words])


@pytest.fixture(params=["skin", "run"])
def some(request, events, run):
    """The spikes of an array and those of a run go out alike."""
    return events if request.param == "skin" else events_of(run)


@pytest.fixture
def quiet(events):
    """The same array had nothing moved it."""
    about = {**events.about, "started": "2026-11-22T10:00:00", "error_s": 0.0}
    return replace(
        events, time=events.time[:0], taxel=events.taxel[:0], count=events.count * 0,
        about=about,
    )  # fmt: skip


def complaints(file):
    """Checks of NWB's own inspector that a file does not pass."""
    from nwbinspector import inspect_nwbfile

    return {one.check_function_name for one in inspect_nwbfile(nwbfile_path=file)}


OF_PEOPLE_AND_ANIMALS = {
    "check_subject_species_exists", "check_experimenter_exists", "check_institution",
}  # fmt: skip
"""What a simulated array has none of."""


def test_csv_gives_every_time_in_full(some, tmp_path):
    write(some, tmp_path / "e.csv")
    rows = np.loadtxt(tmp_path / "e.csv", delimiter=",", skiprows=1, ndmin=2)
    assert np.array_equal(rows[:, 0], some.time[:])
    assert np.array_equal(rows[:, 1], some.taxel[:])
    assert np.array_equal(rows[:, 2:], some.places[some.taxel[:]])


def test_tonic_counts_the_spikes_of_each_taxel(some, tmp_path):
    transforms = pytest.importorskip("tonic.transforms")
    write(some, tmp_path / "e.npy")
    array = np.load(tmp_path / "e.npy")
    size = (4, 3, 2) if len(some.count) > 1 else (1, 1, 2)
    image = transforms.ToImage(sensor_size=size)(array)
    assert np.array_equal(image[1].ravel(), some.count)
    assert np.abs(array["t"] * 1e-6 - some.time[:]).max() <= 0.5000001e-6


def test_pixels_are_counted_from_the_top_left(events):
    array = structured(events)
    assert np.array_equal(array["y"] * 4 + array["x"], events.taxel[:])
    scattered = np.arange(80_000.0).reshape(-1, 2)
    many = replace(events, places=scattered)
    with pytest.raises(ParameterError, match="40,000 columns or rows"):
        structured(many)


def test_neo_reads_a_train_for_each_taxel(some, tmp_path):
    io = pytest.importorskip("neo.io")
    write(some, tmp_path / "e.nix")
    with io.NixIO(str(tmp_path / "e.nix"), "ro") as opened:
        (block,) = opened.read_all_blocks()
    (segment,) = block.segments
    assert len(segment.spiketrains) == len(some.count)
    for taxel, train in enumerate(segment.spiketrains):
        assert np.array_equal(train.rescale("s").magnitude, some.train(taxel))
        assert train.annotations["taxel"] == taxel
        place = train.annotations["x_m"], train.annotations["y_m"]
        assert np.array_equal(place, some.places[taxel])
        assert float(train.t_stop) == some.duration


def test_neo_of_a_run_has_its_force_and_trials(run):
    pytest.importorskip("neo")
    (segment,) = to_neo.block(events_of(run)).segments
    (force,) = segment.irregularlysampledsignals
    assert float(force.max()) == pytest.approx(0.2, rel=0.02)
    (trials,) = segment.epochs
    assert trials.labels.tolist() == ["200 mN"]
    inside = (segment.spiketrains[0] >= trials.times[0]) & (
        segment.spiketrains[0] <= trials.times[0] + trials.durations[0]
    )
    assert inside.all() and inside.size > 3


def test_nwb_has_a_unit_with_its_place_for_each_taxel(events, tmp_path):
    pynwb = pytest.importorskip("pynwb")
    pytest.importorskip("nwbinspector")
    write(events, tmp_path / "e.nwb")
    with pynwb.NWBHDF5IO(str(tmp_path / "e.nwb"), "r") as reader:
        units = reader.read().units
        for taxel, place in enumerate(events.places):
            times = units.get_unit_spike_times(taxel)
            assert np.array_equal(times, events.train(taxel))
            assert (units["x"][taxel], units["y"][taxel]) == tuple(place)
        assert np.array_equal(units["largest_force"][:], events.largest_force)
    assert complaints(tmp_path / "e.nwb") <= OF_PEOPLE_AND_ANIMALS


def test_nwb_of_a_silent_skin_passes_the_inspector_too(quiet, tmp_path):
    """Its empty trains ended checks of nwbinspector with an error."""
    pynwb = pytest.importorskip("pynwb")
    pytest.importorskip("nwbinspector")
    write(quiet, tmp_path / "q.nwb")
    with pynwb.NWBHDF5IO(str(tmp_path / "q.nwb"), "r") as reader:
        read = reader.read()
        assert read.units is None
        told = read.processing["misc"]["silence"].to_dataframe()
    assert told["taxel"].tolist() == list(range(len(quiet.count)))
    assert (told["duration"] == quiet.duration).all()
    assert np.array_equal(told[["x", "y"]], quiet.places)
    assert np.array_equal(told["largest_force"], quiet.largest_force)
    assert complaints(tmp_path / "q.nwb") <= OF_PEOPLE_AND_ANIMALS


@pytest.mark.parametrize("room", [100, 20_000])
@pytest.mark.parametrize("form", ["neo", "nwb"])
def test_a_full_disk_is_told_in_plain_words(skin_folder, tmp_path, form, room, capfd):
    """HDF5 under Neo told of it in a hundred lines of a trace, and crashed."""
    out = tmp_path / "made"
    asked = "export", skin_folder, "--to", form, "--out", out
    with full_after(room):
        done = tell(*asked)
    gc.collect()
    assert done.exit_code == 2
    assert f"{out} cannot be written: File too large. Name another" in done.output
    assert not capfd.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_script_that_found_no_room_leaves_no_spikes(events, tmp_path, monkeypatch):
    monkeypatch.setattr(scripts, "script", lambda name: " " * 1_000_000)
    with full_after(500_000), pytest.raises(OSError, match="too large"):
        write(events, tmp_path / "e.brian2.py")
    assert not list(tmp_path.iterdir())


def test_aedat4_is_read_by_dv_processing(some, tmp_path):
    dv = pytest.importorskip("dv_processing")
    write(some, tmp_path / "e.aedat4")
    camera = dv.io.MonoCameraRecording(str(tmp_path / "e.aedat4"))
    batches = []
    while (batch := camera.getNextEventBatch()) is not None:
        batches.append(batch.numpy())
    read, sent = np.concatenate(batches), structured(some)
    assert np.array_equal(read["timestamp"], sent["t"])
    assert np.array_equal(read["x"], sent["x"]) and np.array_equal(read["y"], sent["y"])
    assert (read["polarity"] == 1).all()
    assert camera.getEventResolution() == ((4, 3) if len(some.count) > 1 else (1, 1))


@pytest.mark.parametrize("name", SPIKES)
def test_silence_goes_out_too(quiet, name, tmp_path):
    (file, *_) = write(quiet, tmp_path / f"quiet{SPIKES[name].ending}")
    assert file.stat().st_size > 0


def test_a_part_of_a_run_has_the_spikes_of_that_part(run):
    whole = events_of(run)
    middle = float(np.median(whole.time))
    part = events_of(run, Selection(end=middle))
    assert np.array_equal(part.time, whole.time[whole.time < middle])


def test_neo_of_a_part_ends_where_the_part_does(run):
    """Else a silence is told of where nothing was looked for."""
    pytest.importorskip("neo")
    part = events_of(run, Selection(start=0.3, end=0.9))
    (segment,) = to_neo.block(part).segments
    (train,), (force,) = segment.spiketrains, segment.irregularlysampledsignals
    assert (float(train.t_start), float(train.t_stop)) == (0.3, 0.9)
    assert 0 < len(train) < len(events_of(run).time)
    assert (float(force.times[0]), float(force.times[-1])) == (0.3, 0.9)
    assert force.magnitude[-1, 0] == pytest.approx(
        float(run.force.at(np.array([0.9]))[0])
    )
    assert 1e3 * part.largest_force[0] == pytest.approx(1e3 * float(force.max()))


def test_runs_and_skins_are_exported_from_the_command_line(
    run_folder, skin_folder, tmp_path
):
    for name, one in SPIKES.items():
        for folder in (run_folder, skin_folder):
            out = tmp_path / f"{folder.name}{one.ending}"
            if folder == run_folder and one.fixed:
                continue
            done = tell("export", folder, "--to", name, "--out", out)
            assert done.exit_code == 0, done.output
            assert out.exists() and out.name in done.output
    assert tell("export", skin_folder, "--to", "tonic").exit_code == 0
    (skin_folder / "ball.npy").unlink()
    for wrong, why in (
        ((skin_folder, "--to", "mat"), "spikes only; choose --to csv, nwb"),
        ((skin_folder, "--to", "csv", "--from", "1 s"), "exported whole"),
        ((run_folder, "--to", "neo", "--signal", "V_K"), "leave out --signal"),
        ((run_folder, "--to", "tonic", "--from", "9 s"), "nothing from 9 s"),
    ):
        done = tell("export", *wrong)
        assert done.exit_code == 2 and why in done.output, done.output


def test_an_ending_says_the_format(tmp_path, events):
    assert format_of(tmp_path / "x.nix") == "neo"
    with pytest.raises(ParameterError, match=r"no format of spikes.*\.npy"):
        write(events, tmp_path / "e.xyz")
    with pytest.raises(RunFolderError, match="holds no events"):
        Events.read(tmp_path)


def test_a_missing_library_is_named_with_what_installs_it(
    events, tmp_path, monkeypatch
):
    monkeypatch.setitem(sys.modules, "dv_processing", None)
    with pytest.raises(RunFolderError, match="`pip install dv-processing`"):
        write(events, tmp_path / "e.aedat4")
    assert not list(tmp_path.iterdir())


def test_a_run_without_spikes_says_so(run, monkeypatch):
    monkeypatch.setattr(type(run), "detection", None)
    with pytest.raises(RunFolderError, match="none were detected"):
        events_of(run)


@pytest.mark.parametrize("name", ["e.dat", "e"])
def test_aedat4_has_its_ending(skin_folder, tmp_path, name):
    """Else dv-processing ends the whole program."""
    pytest.importorskip("dv_processing")
    verb = ["-m", "tactile_lab", "export", skin_folder, "--to", "aedat4"]
    command = [sys.executable, *verb, "--out", tmp_path / name]
    done = subprocess.run(command, check=False, capture_output=True)
    assert done.returncode == 2
    assert b"ends in .aedat4; let --out end so." in done.stderr
    assert b".part" not in done.stderr  # the name it has until it is whole
    assert not list(tmp_path.iterdir())
