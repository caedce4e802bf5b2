import json
import re
import shutil

import numpy as np
import pytest
from click.testing import CliRunner

from tactile_lab.cli import cli
from tactile_lab.engine.execution import Execution
from tactile_lab.scene.load import load


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    scene = load("demo", ['protocol.levels=["180 mN"]', 'protocol.rest="0.5 s"'])
    return Execution(scene, tmp_path_factory.mktemp("runs")).run().folder


def call(*arguments):
    return CliRunner().invoke(cli, [str(a) for a in arguments])


def test_report_writes_all_files_again(run_folder, tmp_path):
    done = call("report", run_folder, "--pdf", "--out", tmp_path, "--json")
    assert done.exit_code == 0, done.output
    for name in ("figure.png", "figure.svg", "figure.pdf", "report.html"):
        assert (tmp_path / name).exists()
    assert json.loads(done.stdout) == json.loads(
        (tmp_path / "results.json").read_text()
    )


def test_several_runs_are_reported_side_by_side(run_folder, tmp_path):
    other = tmp_path / "again"
    shutil.copytree(run_folder, other)
    done = call("report", run_folder, other, "--out", tmp_path / "both")
    assert done.exit_code == 0, done.output
    assert "2 runs of 2 specimens" in done.stdout and "rest_V_C1" in done.stdout
    page = (tmp_path / "both" / "runs.html").read_text(encoding="utf-8")
    assert "<svg" in page and "again" in page
    out = ("--out", tmp_path / "both", "--json")
    told = json.loads(call("report", run_folder, other, *out).stdout)
    (rate,) = told["runs"]["again"]["rates"]
    assert rate["force_N"] == 0.18 and rate["rate_Hz"] > 5
    twice = call("report", run_folder, run_folder, "--out", tmp_path / "both")
    assert twice.exit_code == 2 and "named twice" in twice.stderr


def test_report_of_no_run_is_refused(tmp_path):
    done = call("report", tmp_path)
    assert done.exit_code == 2
    assert done.stdout == ""


def test_report_into_an_unwritable_place_is_refused(run_folder, tmp_path):
    (tmp_path / "file").write_text("")
    done = call("report", run_folder, "--out", tmp_path / "file" / "inside")
    assert done.exit_code == 2
    assert "cannot be written" in done.stderr


def test_identify_finds_the_bench_s_own_parameters(run_folder):
    said = call("identify", run_folder, "V_GS", "tau").stdout
    V_GS = re.search(r"^V_GS +(1\.\S+) V \(1\.\S+ to 1\.\S+ V, 95 %\)$", said, re.M)
    tau = re.search(r"^tau +(\S+) s \(\S+ to \S+ s, 95 %\)$", said, re.M)
    assert V_GS and tau, said
    assert float(V_GS[1]) == pytest.approx(1.4, abs=5e-3)
    assert float(tau[1]) == pytest.approx(8.69, rel=0.1)
    assert "What is not fitted counts as exact." in said and "fit V_GS" not in said
    assert "fit V_GS as well" in call("identify", run_folder, "tau").stdout


def test_what_a_run_holds_is_shown_as_json(run_folder):
    done = call("show", run_folder, "--json")
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert [trial["complete"] for trial in told["trials"]] == [True]
    assert told["trials"][0]["level_N"] == 0.18


def test_one_run_is_identified_with_all_keys(run_folder):
    told = json.loads(call("identify", run_folder, "V_GS", "--json").stdout)
    assert told["runs"] is None and told["parameters"]["V_GS"]["value"] > 1


def test_identify_fits_several_runs_together(run_folder):
    other = run_folder.with_name("other")
    shutil.copytree(run_folder, other)
    told = json.loads(call("identify", run_folder, other, "V_GS", "--json").stdout)
    alone = told["runs"]["other"]["parameters"]["V_GS"]
    together = told["parameters"]["V_GS"]["value"]
    # what the bench's bands hold weighs half as much beside twice the data
    assert alone["low_95"] < together < alone["high_95"]
    said = call("identify", run_folder, other, "V_GS")
    assert "other alone 1." in said.stdout, said.output
    refused = call("identify", run_folder, other)
    assert refused.exit_code == 2 and "Name what to fit" in refused.stderr
    refused = call("identify", run_folder, run_folder, "V_GS")
    assert refused.exit_code == 2 and "named twice" in refused.stderr
    refused = call("identify", run_folder, "V_GS", "--force-scales")
    assert refused.exit_code == 2 and "fit g31 instead" in refused.stderr


def test_identify_refuses_what_is_no_parameter(run_folder):
    done = call("identify", run_folder, "voltage")
    assert done.exit_code == 2
    assert "no numeric parameter" in done.stderr


def test_transfer_fits_a_csv(tmp_path):
    volts = np.linspace(0, 2.5, 26)
    amperes = 1.216e-12 * np.exp(volts / (5.646 * 0.025))
    path = tmp_path / "curve.csv"
    path.write_text(
        "VG,ID\n" + "\n".join(f"{v},{i}" for v, i in zip(volts, amperes, strict=True))
    )
    found = json.loads(call("transfer", path, "--json").stdout)
    assert found["m"]["value"] == pytest.approx(5.646)
    said = call("transfer", path, "--between", "1 V", "2 V").stdout
    assert "11 points between 1 V and 2 V" in said
    # a curve tells m V_T alone: 2 % of m lie between 290 K and 296 K
    assert "m is for V_T = 25 mV" in said and "290.1 K" in said
    assert "mV/decade" in said
    assert found["V_T_V"] == 0.025
    assert call("transfer", path, "--figure", tmp_path / "fig1c").exit_code == 0
    assert (tmp_path / "fig1c.png").read_bytes().startswith(b"\x89PNG")
    lost = call("transfer", path, "--figure", path / "fig1c")  # beneath a file
    assert lost.exit_code == 2
    assert "cannot be written" in lost.stderr


def test_transfer_refuses_a_bad_file_and_a_bad_unit(tmp_path):
    assert call("transfer", tmp_path / "none.csv").exit_code == 2
    path = tmp_path / "curve.csv"
    path.write_text("VG,ID\n0,1e-12\n1,nan\n")
    done = call("transfer", path)
    assert done.exit_code == 2
    assert "rows without a number are left out: 1 (line 3)" in done.stderr
    assert "6 are needed" in done.stderr
    assert call("transfer", path, "--between", "1 A", "2 V").exit_code == 2


def test_a_run_without_v_k_says_what_it_cannot_tell_and_keeps_the_rest(tmp_path):
    done = call(
        "run", "hold_10s", "--set", 'protocol.hold="0.5 s"', "--set",
        'protocol.rest="0 s"', "--set", 'record.signals=["V_C1"]', "--set",
        'record.sample_rate="50 kS/s"', "--out", tmp_path,
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    assert "warning: No result: spikes were not looked for" in done.stderr
    (folder,) = tmp_path.iterdir()
    found = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    assert found["missing"][0].startswith("No result: spikes were not looked for")
    assert found["twin"]["voltages"]["V_C1"]["rms_V"] < 0.05
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "Not determined" in page
    again = call("report", folder)
    assert again.exit_code == 0
    assert "150 mN" in again.stdout
    assert "spikes were not looked for" in again.stderr


def test_identify_of_a_run_without_force_says_what_it_needs(tmp_path):
    """A monitor's run, which has V_C1, was said to have neither V_C1 nor spikes."""
    changes = {"protocol.duration": 1.0, "protocol.part": 1.0}
    folder = Execution(load("monitor", changes), tmp_path).run().folder
    refused = call("identify", folder, "V_GS")
    assert refused.exit_code == 2
    assert "drove no coil" in refused.stderr and "demo" in refused.stderr


def test_runs_of_which_one_has_lost_its_samples_are_compared(tmp_path):
    """They were refused as a whole, though both folders say what they were run with."""
    folders = []
    for hold in (0.2, 0.3):
        changes = {"protocol.hold": hold, "protocol.levels": (0.1,)}
        folders.append(Execution(load("demo", changes), tmp_path).run().folder)
    (folders[1] / "data.h5").unlink()
    done = call("compare", *folders)
    assert done.exit_code == 0, done.stderr
    assert "protocol.hold" in done.stdout
    assert "results: not compared" in done.stdout and "data.h5" in done.stdout
