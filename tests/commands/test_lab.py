"""What a lab sets once counts where nothing else is said, with where it came from."""

import json
import os
import signal
import sys
from pathlib import Path

import pytest

from tactile_lab.errors import SceneError
from tactile_lab.lab import NICENESS, config_file, lab
from tactile_lab.scene.load import load

SHORT = ("--set", "protocol.hold=0.3 s", "--set", 'protocol.levels=["50 mN"]')
SHORT += ("--set", "record.sample_rate=20 kS/s", "--no-report", "--json")


@pytest.fixture
def set_by_lab(tmp_path, monkeypatch):
    def write(text):
        (tmp_path / "lab.toml").write_text(text)
        monkeypatch.setenv("TACTILE_LAB_CONFIG", str(tmp_path / "lab.toml"))

    return write


def test_without_a_file_nothing_is_set(monkeypatch):
    monkeypatch.delenv("TACTILE_LAB_CONFIG", raising=False)
    found = lab()
    assert (found.bench, found.runs, found.notes) == ("sim", Path("runs"), {})
    assert config_file().name == "lab.toml"


def test_runs_go_where_the_lab_says_with_its_notes_and_what_follows(
    tactile_lab, set_by_lab, tmp_path
):
    after = tmp_path / "after.py"
    after.write_text(
        "import sys, pathlib\n"
        "run = pathlib.Path(sys.argv[1])\n"
        "(run / 'after.txt').write_text((run / 'run.json').read_text())\n"
    )
    set_by_lab(
        'runs = "kept"\noperator = "Ada"\ninstitution = "Kiel"\n'
        f"after_run = {json.dumps([sys.executable, str(after)])}\n"
    )
    done = tactile_lab("run", "demo", *SHORT, "--note", "operator=Grace")
    assert done.code == 0, done.err
    run = Path(done.json["run"])
    assert run.parent == tmp_path / "kept"
    seen = json.loads((run / "after.txt").read_text())
    assert seen["notes"] == {"operator": "Grace", "institution": "Kiel"}
    assert seen["status"] == "complete"
    assert run.name in tactile_lab("runs").out

    set_by_lab('runs = "kept"\nafter_run = ["false", "{run}"]\n')
    failed = tactile_lab("run", "demo", *SHORT)
    assert failed.code == 0
    assert "after_run: false " in failed.err


def test_plan_and_doctor_say_what_holds_and_why(
    tactile_lab, set_by_lab, monkeypatch, tmp_path
):
    set_by_lab('operator = "Ada"\n')
    monkeypatch.setenv("TACTILE_LAB_RUNS", str(tmp_path / "there"))
    said = tactile_lab("plan", "demo").out
    assert f"operator    Ada, from {tmp_path / 'lab.toml'}" in said
    assert f"runs        {tmp_path / 'there'}, from TACTILE_LAB_RUNS" in said
    assert "bench       sim, unless you say otherwise" in said
    (finding,) = (
        one for one in tactile_lab("doctor", "--json").json["findings"]
        if one["topic"] == "lab"
    )  # fmt: skip
    assert "Ada" in finding["text"]


def test_the_labs_bench_is_that_of_scenes_which_name_none(
    tactile_lab, set_by_lab, tmp_path
):
    (tmp_path / "bench.toml").write_text(
        'name = "left bench"\n[magnet]\nr = "6 mm"\nA1 = "2.8e-5 m^2"\n'
        'A2 = "2.25e-3 m^2"\nB1 = "163 mT"\nB2_per_ampere = "11 mT/A"\n'
        '[coil]\ndialect = "kepco-bop"\nport = "/dev/ttyUSB0"\n'
    )
    set_by_lab('bench = "bench.toml"\n')

    def bench(*asked):
        return tactile_lab("plan", *asked, "--json").json["bench"]

    wanted = ("--set", 'record.signals=["force"]')
    force = ("--set", 'protocol.levels=["20 mN"]')
    assert bench("demo", *wanted, *force) == {"name": "left bench", "simulated": False}
    assert bench("demo", "--bench", "sim")["simulated"]
    assert bench()["simulated"], "the bare demo reached for real instruments"
    assert load("demo").bench.simulated, "a script reads no file that it did not name"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('bnech = "sim"\n', 'no key "bnech"; did you mean "bench"'),
        ("operator = 3\n", "operator = 3: a text in quotes"),
        ('after_run = "rsync"\n', "a list of texts"),
        ("after_run = []\n", "a list of texts"),
        ("what", "not TOML"),
    ],
)
def test_a_wrong_file_is_refused_in_words(tactile_lab, set_by_lab, text, told):
    set_by_lab(text)
    answer = tactile_lab("plan", "demo")
    assert answer.code == 2
    assert told in answer.err
    assert "lab.toml" in answer.err


def test_a_file_that_is_named_must_be_there(monkeypatch, tmp_path):
    monkeypatch.setenv("TACTILE_LAB_CONFIG", str(tmp_path / "none.toml"))
    with pytest.raises(SceneError, match="does not exist"):
        lab()


@pytest.mark.skipif(sys.platform == "win32", reason="needs a shell")
def test_what_follows_a_run_holds_up_nothing(set_by_lab, monkeypatch, tmp_path):
    monkeypatch.setattr("tactile_lab.lab.LONGEST", 0.2)
    set_by_lab('after_run = ["sleep", "600", "{run}"]\n')
    told = lab().follow(Path("0"))
    assert "did not end within" in told
    monkeypatch.setattr("tactile_lab.lab.LONGEST", 30.0)

    # nor does it take the processor from the next one
    behind = f"until [ $(nice) = {NICENESS} ]; do :; done"
    left = f'["sh", "-c", "{behind}; sleep 60 & echo $! gone; exit 3"]'
    (tmp_path / "left.toml").write_text(f"after_run = {left}\n")
    monkeypatch.setenv("TACTILE_LAB_CONFIG", str(tmp_path / "left.toml"))
    told = lab().follow(tmp_path)
    assert "ended with 3" in told
    number = int(told.split()[-2])
    os.kill(number, signal.SIGKILL)  # it was not waited for: it is there to be ended


def test_a_tilde_is_the_home_folder(set_by_lab, monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    set_by_lab('runs = "~/runs"\nbench = "~/bench.toml"\n')
    assert lab().runs == tmp_path / "runs"
    assert lab().bench == str(tmp_path / "bench.toml")
    monkeypatch.setenv("TACTILE_LAB_RUNS", "~/there")
    assert lab().runs == tmp_path / "there"
