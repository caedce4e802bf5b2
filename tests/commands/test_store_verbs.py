"""runs, show, verify, recover and export, as a user types them."""

import json
import runpy
from pathlib import Path

import pytest
from click.testing import CliRunner
from growing_run import begins_a_trial

from tactile_lab.cli import cli
from tactile_lab.engine.execution import Execution
from tactile_lab.scene.load import load
from tactile_lab.store.certificate import write_certificate
from tactile_lab.store.folder import RunFolder
from tactile_lab.store.layout import Layout
from tactile_lab.store.recorder import Recorder
from tactile_lab.store.run import Run
from tactile_lab.store.verify import verify

BENCH = runpy.run_path(str(Path(__file__).parents[1] / "store" / "conftest.py"))


@pytest.fixture
def run(tmp_path):
    return recorded(tmp_path / "runs")


def recorded(root, produced=5000):
    """A run that stored 5000 samples a channel, of as many as the scope `produced`."""
    folder = RunFolder.create(
        root,
        "pulses",
        {"protocol": "pulses", "simulated": True, "notes": {"sensor": "S12"}},
    )
    layout = Layout(
        signals=BENCH["SIGNALS"], detection=BENCH["DETECTION"], simulated=True
    )
    recorder = Recorder(folder, layout, reserve=0)
    BENCH["play"](recorder, BENCH["codes"](5000), 500)
    recorder.close("complete", produced, duration_s=5.0)
    write_certificate(folder.path)
    return folder.path


def tell(*arguments):
    return CliRunner().invoke(cli, [str(a) for a in arguments])


def test_runs_lists_and_filters(run):
    listed = tell("runs", run.parent)
    assert listed.exit_code == 0
    assert run.name in listed.output
    assert "0 of 10,000 samples" in listed.output
    found = json.loads(tell("runs", run.parent, "--search", "s12", "--json").stdout)
    assert [entry["name"] for entry in found["runs"]] == [run.name]
    none = tell("runs", run.parent, "--search", "hold")
    assert none.exit_code == 0
    assert run.name not in none.output


def test_spikes_that_are_no_count_are_marked_in_the_list(tmp_path):
    """Those of a run stood there like a count, though V_K missed half of them."""
    asked = {"protocol.levels": (0.2,), "protocol.hold": 1.5, "protocol.rest": 0.3}
    for rate in (1e5, 1e6):
        scene = load("demo", {**asked, "record.sample_rate": rate})
        assert Execution(scene, tmp_path).run().exit_code == 0
    slow, fast = json.loads(tell("runs", tmp_path, "--json").stdout)["runs"]
    assert (slow["uncounted"], fast["uncounted"]) == (True, False)
    listed = tell("runs", tmp_path).stdout.splitlines()
    assert f" {slow['spikes']} spikes†  " in listed[1]
    assert f" {fast['spikes']} spikes  " in listed[2]
    assert listed[3:] == ["†: seen, no count of the spikes there were."]


def test_show_tells_what_a_run_holds(run):
    shown = tell("show", run)
    assert shown.exit_code == 0
    for part in ("complete, simulated", "V_K", "5000 samples", "7", "S12"):
        assert part in shown.output
    summary = json.loads(tell("show", run, "--json").stdout)
    assert summary["signals"]["V_C1"]["samples"] == 5000
    assert summary["loss"]["spikes"] == 0


def test_show_calls_a_changed_run_json_damaged(run):
    info = json.loads((run / "run.json").read_text())
    info["detection"] = {"sigoal": "V_K", "from": "scene", "threshold_V": 0.5}
    (run / "run.json").write_text(json.dumps(info))  # its hash stays
    shown = tell("show", run)
    assert shown.exit_code == 2, shown.exception
    assert "is damaged (run.json: was changed" in shown.output


def test_verify_tells_sound_from_damaged(run):
    sound = tell("verify", run)
    assert (sound.exit_code, "sound" in sound.output) == (0, True)
    data = bytearray((run / "data.h5").read_bytes())
    (run / "data.h5").write_bytes(data[: len(data) // 3])
    damaged = tell("verify", run, "--json")
    assert damaged.exit_code == 1
    assert json.loads(damaged.stdout)["findings"][0]["where"].startswith("data.h5")


def test_a_run_that_lost_samples_is_not_called_sound(tmp_path):
    told = tell("verify", recorded(tmp_path, produced=6000)).output.splitlines()
    assert told[0].startswith("loss: 2,000 of 12,000 samples")
    assert told[-1] == "as it was written, but samples are lost"


def test_a_run_has_its_name_where_it_is_given_as_a_dot(run, monkeypatch):
    monkeypatch.chdir(run)
    assert tell("note", ".", "--tag", "cal").output.splitlines() == [f"{run.name} #cal"]
    with Run.load(".") as stored:
        assert stored.to_xarray(1.0, 2.0).attrs["run"] == run.name
    assert repr(stored) == f"<Run {run.name}: closed>"


def test_recover_refuses_a_whole_run(run):
    refused = tell("recover", run)
    assert refused.exit_code == 2
    assert "not cut short" in refused.output


def test_export_writes_beside_the_data(run):
    done = tell("export", run, "--to", "csv", "--from", "1 s", "--until", "2 s")
    assert done.exit_code == 0, done.output
    assert len((run / "csv" / "signals.csv").read_text().splitlines()) == 1001
    assert tell("export", run, "--to", "mat").exit_code == 0
    wrong = tell("export", run, "--to", "csv", "--from", "1 V")
    assert wrong.exit_code == 2
    assert "--from: " in wrong.output and "unit V" in wrong.output
    none = tell("export", run, "--to", "csv", "--rate", "0 S/s")
    assert none.exit_code == 2 and "above 0 S/s" in none.output


@pytest.mark.parametrize("file", ["data.h5", "run.json", "inputs/pulses.py"])
def test_no_export_takes_the_place_of_what_a_run_is_made_of(run, file):
    """`--to mat --out RUN/data.h5` did: the samples were gone."""
    before = {f: f.read_bytes() for f in run.rglob("*") if f.is_file()}
    for to, beside in (("mat", run), ("neo", run), ("mat", run.parent / "x" / "..")):
        out = beside / file if beside == run else beside / run.name / file
        refused = tell("export", run, "--to", to, "--out", out)
        assert refused.exit_code == 2 and "Give another name" in refused.output
    assert {f: f.read_bytes() for f in run.rglob("*") if f.is_file()} == before


def test_a_trial_that_the_run_ended_before_is_not_said_to_end_before_it_begins(run):
    from tactile_lab.commands.show import describe, rows

    told = describe(run)
    told["trials"] = [
        {
            "label": "9 N",
            "start_s": 4.7,
            "end_s": 3.1,
            "spikes": 0,
            "uncounted": None,
            "skipped": 0,
            "complete": False,
        }
    ]
    (trial,) = (text for name, text in rows(told) if name == "trial")
    assert trial.split(maxsplit=2)[2].startswith("would have begun at 4.700 s, 0 ")


def test_a_run_that_begins_a_trial_while_it_is_described(run, monkeypatch):
    """As the window's page on a run that goes on may find it."""
    from tactile_lab.commands.show import describe

    before = len(describe(run)["trials"])
    begins_a_trial(monkeypatch)
    assert len(describe(run)["trials"]) == before


@pytest.mark.parametrize("verb", ["show", "verify", "recover"])
def test_a_folder_that_is_no_run_is_one_clear_message(verb, tmp_path):
    missing = tell(verb, tmp_path / "nothing")
    assert missing.exit_code == 2
    assert "Traceback" not in missing.output


def test_verify_tells_how_far_it_is(run):
    told = []
    assert verify(run, told.append).sound
    assert told == sorted(told) and told[-1] == 1.0
    assert len(told) > 3, "one for each chunk of each channel"
