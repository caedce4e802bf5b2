"""Damaged, odd and foreign input to the verbs: one message, its code, no traceback."""

import json
import os
import subprocess
import sys

import pytest

from tactile_lab.engine.execution import Execution
from tactile_lab.scene.load import load
from tactile_lab.store.folder import RunFolder, is_live
from tactile_lab.trust import INFO


@pytest.fixture
def empty_run(tmp_path):
    folder = RunFolder.create(tmp_path / "runs", "empty", {"protocol": "pulses"})
    folder.finish("faulted", reason="the scope did not answer")
    return folder.path


@pytest.mark.parametrize(
    "odd",
    [
        {"status": 5},
        {"status": None},
        {"started": "yesterday"},
        {"notes": ["Ada"]},
        {"duration_s": "long"},
        {"parameters": 3},
        {"simulated": "x"},
    ],
)
def test_one_odd_run_does_not_hide_the_others(tactile_lab, empty_run, odd):
    folder = RunFolder.create(empty_run.parent, "odd", {})
    folder.finish("complete")
    info = json.loads((folder.path / INFO).read_text())
    (folder.path / INFO).write_text(json.dumps({**info, **odd}))
    listed = tactile_lab("runs", empty_run.parent)
    assert listed.code == 0
    assert empty_run.name in listed.out
    (line,) = (line for line in listed.out.splitlines() if folder.path.name in line)
    assert "unreadable" in line
    assert "damaged" in line


@pytest.mark.parametrize("verb", [("identify", "V_GS"), ("report",), ("export",)])
def test_a_run_without_samples_says_what_to_do(tactile_lab, empty_run, verb):
    name, *rest = verb
    extra = ("--to", "csv") if name == "export" else ()
    answer = tactile_lab(name, empty_run, *rest, *extra)
    assert answer.code == 2
    assert "before the first sample" in answer.err
    assert "run --again" in answer.err


def test_a_run_killed_before_its_first_sample_did_not_end(tactile_lab, tmp_path):
    killed = RunFolder.create(tmp_path, "killed", {})
    killed._log.close()
    answer = tactile_lab("report", killed.path)
    assert answer.code == 2
    assert "was cut short before the first sample" in answer.err


def test_a_run_killed_before_its_first_sample_tells_what_it_was_to_use(
    tactile_lab, tmp_path
):
    """No instrument was named, and none that nothing was recorded."""
    field = 'record.signals=["V_C1", "field"]'
    killed = Execution(load("demo", (field,)), tmp_path).folder
    killed._log.close()
    listed = tactile_lab("runs", tmp_path).out.splitlines()[1]
    assert listed.endswith("none recorded")
    shown = tactile_lab("show", killed.path).out
    for line in (
        "coil         kepco-bop at sim://coil: not heard from",
        "scope        ps3000a: not heard from",
        "field meter  lakeshore-425 at sim://field_meter: not heard from",
        "samples      none recorded",
    ):
        assert line in shown.splitlines(), shown
    told = tactile_lab("show", killed.path, "--json").json
    names = {"coil", "scope", "field meter"}
    assert told["instruments"] == dict.fromkeys(names)
    assert told["instruments_planned"].keys() == names
    report = tactile_lab("report", killed.path)
    assert "`tactile-lab show` tells what it was to use" in report.err


def test_a_folder_of_runs_is_refused_with_their_names(tactile_lab, tmp_path):
    """Only that it is none was told, and of a study nothing of its data."""
    study = tmp_path / "study"
    (study / "data.zarr").mkdir(parents=True)
    answer = tactile_lab("export", study, "--to", "csv")
    assert answer.code == 2
    assert "is a study" in answer.err and "xarray.open_zarr" in answer.err
    runs = [RunFolder.create(study / "runs", f"point-{n}", {}) for n in range(5)]
    for run in runs:
        run.finish("complete")
    names = sorted(str(run.path) for run in runs)
    for asked in (study, study / "runs"):
        answer = tactile_lab("export", asked, "--to", "csv")
        assert answer.code == 2
        assert f"one of the runs in it: {', '.join(names[:3])} and 2 more" in answer.err


@pytest.mark.parametrize("verb", ["show", "recover", "report"])
def test_a_file_in_place_of_a_run_is_no_damage(tactile_lab, empty_run, verb):
    answer = tactile_lab(verb, empty_run / INFO)
    assert answer.code == 2
    assert "is no run folder: it is no folder" in answer.err
    assert "damaged" not in answer.err


@pytest.mark.skipif(sys.platform == "win32", reason="no pipes with names")
def test_a_pipe_is_no_scene(tactile_lab, tmp_path):
    os.mkfifo(tmp_path / "scene.toml")
    answer = tactile_lab("plan", tmp_path / "scene.toml")
    assert answer.code == 2
    assert "is a pipe" in answer.err


def test_a_force_too_small_for_a_number_is_not_zero(tactile_lab):
    answer = tactile_lab("plan", "demo", "--set", 'protocol.levels=["1e-400 N"]')
    assert answer.code == 2
    assert "1e-400 N" in answer.err


def test_a_log_of_the_served_bench_that_cannot_be_written(tactile_lab, tmp_path):
    answer = tactile_lab("serve-bench", "--log", tmp_path / "none" / "log")
    assert answer.code == 2
    assert "--log" in answer.err


def test_a_protocol_that_leaves_the_program_is_refused(tactile_lab, tmp_path):
    (tmp_path / "leaves.py").write_text("import sys\nsys.exit(7)\n")
    answer = tactile_lab("plan", tmp_path / "leaves.py")
    assert answer.code == 2
    assert "SystemExit: 7 (line 2)" in answer.err


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="a device of Linux")
def test_a_full_disk_under_stdout_is_told():
    with open("/dev/full", "w") as full:
        verb = [sys.executable, "-m", "tactile_lab", "runs", "--json", "."]
        done = subprocess.run(
            verb, stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    assert "No space left" in done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX locks")
def test_who_asks_whether_a_run_is_live_never_stops_its_writer(tmp_path):
    """A reader took the writer's own lock: a second reader, or the writer, lost it."""
    import fcntl

    folder = RunFolder.create(tmp_path, "live", {})
    assert is_live(folder.path)
    folder.finish("complete")
    with (folder.path / "log.jsonl").open() as other:
        fcntl.flock(other, fcntl.LOCK_SH)
        assert not is_live(folder.path)


@pytest.mark.parametrize("table", ["coil", "field_meter"])
def test_an_empty_port_is_refused_before_anything_is_opened(tactile_lab, table):
    answer = tactile_lab("plan", "demo", "--set", f'bench.{table}.port=""')
    assert answer.code == 2
    assert "a text that is not empty is needed" in answer.err


def test_what_only_hardware_needs_is_no_problem_of_a_simulating_computer(
    tactile_lab, tmp_path, monkeypatch
):
    from drivers import attached
    from tactile_lab.errors import NotFoundError

    def missing():
        raise NotFoundError("The libusb library was not found. Install libusb 1.0.")

    monkeypatch.setattr(attached, "present", missing)
    answer = tactile_lab("doctor", "--json", "--out", tmp_path)
    found = {one["text"]: one for one in answer.json["findings"]}
    (usb,) = (one for text, one in found.items() if text.startswith("USB cannot"))
    assert usb["state"] == "note"
    assert all(len(one["remedy"] or "") < 200 for one in found.values())


def test_doctor_looks_where_the_bench_file_says(tactile_lab, tmp_path):
    bench = '[magnet]\nr = "6 mm"\n[scope]\nlibrary = "/opt/own/ps3000a.so"\n'
    (tmp_path / "bench.toml").write_text(bench)
    asked = ("--bench", tmp_path / "bench.toml", "--out", tmp_path)
    findings = tactile_lab("doctor", "--json", *asked).json["findings"]
    (pico,) = (one for one in findings if one["topic"] == "picosdk")
    assert "/opt/own/ps3000a.so" in pico["text"]


@pytest.mark.parametrize("verb", ["plan", "simulate"])
def test_spikes_beyond_number_are_refused(tactile_lab, verb):
    """Up to 1e8 were computed: 18 s and 2 GB for a scene of 18 s."""
    answer = tactile_lab(verb, "demo", "--set", "sensor.V_th=3.213e-6 V")
    assert answer.code == 2
    assert "More than 1e+07 spikes in one simulation of 18" in answer.err


@pytest.mark.parametrize(
    ("scene", "change", "told"),
    [
        ("demo", "protocol.ramp=1e6 s", "changes its force for 2 Ms"),
        ("staircase", "protocol.ramp=1e6 s", "changes its force for"),
        ("sine_sweep", "protocol.lowest=1e-6 Hz", "changes its force for"),
        ("demo", "protocol.hold=1e7 s", "lasts for 10 Ms"),
        ("texture", "protocol.lasts=1e6 s", "200000 are the most"),
    ],
)
def test_what_would_fill_the_memory_is_refused_before(tactile_lab, scene, change, told):
    answer = tactile_lab("plan", scene, "--set", change)
    assert answer.code == 2
    assert told in answer.err
    assert "Ask for" in answer.err
    assert "MemoryError" not in answer.err
