"""An array under a load: each taxel what it is alone, whatever the cores."""

import shutil
import subprocess
import sys
from collections import namedtuple

import numpy as np
import pytest
from click.testing import CliRunner

from tactile_lab.cli import cli as command_line
from tactile_lab.errors import (
    NotFoundError,
    ParameterError,
    RecordingError,
    RunFolderError,
    SceneError,
    SolverError,
)
from tactile_lab.skin import kernel
from tactile_lab.skin.events import Events, EventWriter
from tactile_lab.skin.forces import Loads
from tactile_lab.skin.press import highest, press
from tactile_lab.skin.receptive import receptive_field
from tactile_lab.skin.single import force_of, simulate_taxel
from tactile_lab.skin.skin import load_skin

SLIDE = {
    "duration": "1 s",
    "sensor": {"preset": "fig5b"},
    "array": {"grid": [9, 10], "dead": [44], "stuck": [0], "stuck_rate": "10 Hz"},
    "stimulus": [
        {
            "kind": "sphere", "force": "0.6 N", "start": "50 ms", "hold": "700 ms",
            "speed": "15 mm/s", "rests": "300 ms", "at": ["-6 mm", "1 mm"],
            "vibration": 0.2, "frequency": "20 Hz",
        },
        {"kind": "braille", "text": "ab", "at": ["4 mm", "0 mm"], "start": "0.2 s"},
    ],
}  # fmt: skip


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("skin")
    skin = load_skin(SLIDE)
    return skin, press(skin, folder), Events.read(folder), folder


def test_every_taxel_fires_as_it_would_alone_to_the_last_bit(pressed):
    skin, done, events, _ = pressed
    assert done.taxels["fired"] > 20 and done.taxels["left out"] > 20
    for taxel in set(range(skin.array.size)) - {0, 44}:
        alone = simulate_taxel(skin, taxel).spike_times
        assert np.array_equal(events.train(taxel), alone), taxel
    assert events.train(44).size == 0
    assert events.train(0) == pytest.approx(np.arange(1, 11) / 10)


@pytest.mark.parametrize("preset", ["table1", "fig5b"])
@pytest.mark.parametrize(
    "more", [{}, {"firing": "put"}, {"t1": "direct", "I_T1s": "2.873e-20 A"}]
)
def test_where_t1_saturates_a_taxel_is_what_it_is_alone(preset, more, tmp_path):
    skin = load_skin(
        {
            "duration": "0.5 s" if "t1" not in more else "10 ms",
            "sensor": {"preset": preset, "saturation": True, **more},
            "array": {"grid": [3, 4]},
            "stimulus": [
                {"kind": "sphere", "force": "2 N", "ramp": "20 ms"},
                {"kind": "punch", "force": "0.2 N", "speed": "20 mm/s"},
            ],
        }
    )
    done = press(skin, tmp_path)
    events = Events.read(tmp_path)
    for taxel in range(skin.array.size):
        alone = simulate_taxel(skin, taxel).spike_times
        assert np.array_equal(events.train(taxel), alone), taxel
    assert done.events > 0


def test_a_taxel_whose_parts_make_no_circuit_is_refused_with_the_reason(tmp_path):
    near = {"V_fire": "0.58 V", "V_reset": "0.578 V"}
    skin = load_skin({**SLIDE, "sensor": {"preset": "fig5b", **near}})
    with pytest.raises(ParameterError, match=r"Taxel \d+: V_reset .* must be below"):
        press(skin, tmp_path)


def test_what_the_solver_refuses_of_a_taxel_is_said_as_for_it_alone(tmp_path):
    fast = {"t1": "direct", "C2": "0.1 fF"}
    skin = load_skin({**SLIDE, "sensor": {"preset": "fig5b", **fast}})
    with pytest.raises(SolverError, match=r"Taxel 1, pressed with .*More than"):
        press(skin, tmp_path)


def test_events_are_in_order_and_the_same_on_any_cores(pressed, tmp_path):
    skin, done, events, _ = pressed
    assert np.all(np.diff(events.time[:]) >= 0)
    assert events.time.shape == (done.events,)
    for cores in (1, 3):
        press(skin, tmp_path, cores=cores)
        again = Events.read(tmp_path)
        assert np.array_equal(again.time[:], events.time[:])
        assert np.array_equal(again.taxel[:], events.taxel[:])


def test_who_is_left_out_would_not_have_fired_and_fewer_do_with_more_force(pressed):
    skin, _, events, _ = pressed
    left_out = np.flatnonzero(events.role == kernel.UNTOUCHED)
    for taxel in left_out[::10]:
        assert simulate_taxel(skin, int(taxel)).spike_times.size == 0


def test_the_force_is_as_true_as_asked(pressed):
    skin, *_ = pressed
    loads = Loads(skin)
    fine = load_skin({**SLIDE, "force_error": "0.01 uN"})
    at = np.linspace(0, 1, 4001)
    for taxel in (33, 47, 56):
        coarse = force_of(skin, taxel)
        exact = force_of(fine, taxel)
        assert np.abs(coarse.at(at) - exact.at(at)).max() < 1.01 * skin.force_error
        assert coarse.time.size < exact.time.size
    assert loads.largest(np.array([0.5])) > 0.01


def test_a_receptive_field_is_the_array_with_its_stimuli_moved():
    ball = {"kind": "sphere", "force": "1 N", "start": "50 ms"}
    skin = load_skin({**SLIDE, "duration": "0.3 s", "stimulus": [ball]})
    moved, count, force = receptive_field(skin, 45, 0)
    k = int(np.argmax(count)) + 3
    there = {**ball, "at": [f"{moved[k]} m", "0 m"]}
    alone = load_skin({**SLIDE, "duration": "0.3 s", "stimulus": [there]})
    assert simulate_taxel(alone, 45).spike_times.size == count[k] > 0
    assert count.max() > count[k] and count[0] < count.max()
    nearest = np.argmin(np.abs(moved - skin.array.places[45, 0]))
    assert force.argmax() == nearest


def test_frames_are_the_force_on_each_taxel(tmp_path):
    frames = np.zeros((3, 2, 2))
    frames[1, 0, 1] = 0.5
    np.save(tmp_path / "f.npy", frames)
    skin = load_skin(
        {
            "duration": "0.5 s",
            "array": {"grid": [2, 2], "spread": False},
            "stimulus": [{"kind": "frames", "file": "f.npy", "rate": "10 S/s"}],
        },
        folder=tmp_path,
    )
    assert force_of(skin, 1).at(np.array([0.05, 0.1, 0.15, 0.3])) == pytest.approx(
        [0.25, 0.5, 0.25, 0]
    )
    done = press(skin, tmp_path)
    events = Events.read(tmp_path)
    assert done.events > 0 and set(events.taxel[:]) == {1}


def test_what_no_model_describes_is_refused_beforehand(pressed):
    strong = {"kind": "punch", "force": "1 MN", "radius": "1 mm"}
    with pytest.raises(ParameterError, match="Press less"):
        highest(load_skin({**SLIDE, "stimulus": [strong]}))
    wide = {"kind": "sphere", "force": "40 N", "radius": "5 mm"}  # 1 MPa
    with pytest.raises(SceneError, match=r"40 N would touch .* less than 33.33 N"):
        highest(load_skin({**SLIDE, "stimulus": [wide]}))
    firm = {"kind": "punch", "force": "20 N", "radius": "1 mm"}
    assert "exponential law" in highest(load_skin({**SLIDE, "stimulus": [firm]}))[1][0]
    assert highest(pressed[0])[1] == ()
    restless = load_skin({**SLIDE, "sensor": {"V_GS": "1.7 V"}})
    assert "fire at rest" in highest(restless)[1][0]
    with pytest.raises(ParameterError, match="numbered 0 to 89"):
        force_of(pressed[0], 90)


def test_from_the_command_line_to_a_page(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tap.toml").write_text(
        'duration = "0.3 s"\n[array]\nhexagonal = [4, 4]\n'
        '[[stimulus]]\nkind = "sphere"\nforce = "2 N"\nstart = "0.1 s"\n'
    )
    run = CliRunner().invoke
    plan = run(command_line, ["skin", "tap.toml", "--plan"])
    assert plan.exit_code == 0 and "on one taxel" in plan.output
    assert not (tmp_path / "skins").exists()
    done = run(command_line, ["skin", "tap.toml", "--export", "tap.npy"])
    assert done.exit_code == 0, done.output
    page = (tmp_path / "skins/tap/report.html").read_text()
    assert "Spikes on the skin" in page and "<canvas" in page
    assert (tmp_path / "tap.npy").exists()
    wrong = run(command_line, ["skin", "none.toml"])
    assert wrong.exit_code != 0 and "does not exist" in wrong.output


def test_a_dask_cluster_gives_the_same_to_the_last_bit(tmp_path):
    distributed = pytest.importorskip("distributed")
    np.save(tmp_path / "f.npy", np.linspace(0, 0.1, 270).reshape(3, 90))
    frames = {"kind": "frames", "file": "f.npy", "rate": "10 S/s"}
    more = {**SLIDE, "stimulus": [*SLIDE["stimulus"], frames]}
    skin = load_skin(more, folder=tmp_path)
    press(skin, tmp_path / "here")
    (tmp_path / "there").mkdir()
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None
    ) as cluster:
        press(skin, tmp_path / "there", scheduler=cluster.scheduler_address)
    here, there = (Events.read(tmp_path / name) for name in ("here", "there"))
    assert here.time.size > 0
    for name in ("time", "taxel", "count", "role", "largest_force"):
        assert np.array_equal(getattr(here, name)[:], getattr(there, name)[:]), name


def test_a_scheduler_that_cannot_be_used_is_named_and_nothing_is_left(tmp_path):
    skin = load_skin(SLIDE)
    with pytest.raises(NotFoundError, match="such as tcp://HOST:8786"):
        press(skin, tmp_path / "s", scheduler="somewhere:8786")
    assert not list((tmp_path / "s").iterdir())
    (tmp_path / "s.toml").write_text(
        'duration = "0.1 s"\n[array]\ngrid = [2, 2]\n[[stimulus]]\nkind = "sphere"\n'
    )
    words = ["skin", str(tmp_path / "s.toml"), "--scheduler", "tcp://127.0.0.1:9"]
    refused = CliRunner().invoke(command_line, [*words, "--cores", "2"])
    assert refused.exit_code == 2 and "no --cores" in refused.output


def test_what_the_disk_cannot_hold_is_refused_before_it_is_computed(
    tmp_path, monkeypatch
):
    skin = load_skin(SLIDE)
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage(10**6, 10**6, 4000))
    told = []
    with pytest.raises(RecordingError, match=r"room for 4 kB; about .* 90 taxels and"):
        press(skin, tmp_path / "new" / "skin", tell=told.append)
    assert not told and not (tmp_path / "new").exists()


def test_a_run_that_was_killed_is_told_and_its_remains_are_removed(tmp_path):
    code = (
        "import os, sys; from pathlib import Path;"
        "from tactile_lab.skin.events import EventWriter;"
        "begun = EventWriter(Path(sys.argv[1]) / 'events.h5', 1.0); os._exit(9)"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=False)
    left = next(tmp_path.glob(".events-*"))
    with pytest.raises(RunFolderError, match="not finished"):
        Events.read(tmp_path)
    with EventWriter(tmp_path / "events.h5", 1.0), EventWriter(tmp_path / "b", 1.0):
        there = set(tmp_path.glob(".events-*"))
        assert left not in there and len(there) == 2


def test_what_is_no_file_of_frames_is_refused_by_name(tmp_path):
    (tmp_path / "f.npy").touch()
    file = {"kind": "frames", "file": "f.npy"}
    with pytest.raises(SceneError, match=r"f\.npy is no \.npy file: No data left"):
        load_skin({**SLIDE, "stimulus": [file]}, folder=tmp_path)
    (tmp_path / "f.npy").write_bytes(b"MATLAB 5.0 MAT-file" + bytes(200))
    with pytest.raises(SceneError, match=r"numbers; write one with numpy\.save \(what"):
        load_skin({**SLIDE, "stimulus": [file]}, folder=tmp_path)
    (tmp_path / "f.npy").unlink()
    with pytest.raises(SceneError, match=r"f\.npy does not exist\.$"):
        load_skin({**SLIDE, "stimulus": [file]}, folder=tmp_path)
