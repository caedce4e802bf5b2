"""The catalogue lists what is there, and its index is never trusted too far."""

import csv
import json
import math
import re
import shutil
import sqlite3
from contextlib import closing
from datetime import date, timedelta

import pytest
from click.testing import CliRunner

from tactile_lab.cli import cli
from tactile_lab.errors import RunFolderError, SceneError
from tactile_lab.store.catalogue import Catalogue
from tactile_lab.store.facts import grouped, of_results
from tactile_lab.store.folder import RunFolder, read_info, write_json
from tactile_lab.store.index import FILE as INDEX
from tactile_lab.store.remarks import add_note


def catalogue(root, **asked):
    with Catalogue(root) as found:
        return found.runs(**asked)


@pytest.fixture
def root(tmp_path):
    for protocol, sensor in (("pulses", "S12"), ("hold", "S12"), ("pulses", "S7")):
        folder = RunFolder.create(
            tmp_path, protocol, {"protocol": protocol, "notes": {"sensor": sensor}}
        )
        folder.finish("complete", spikes_online=3)
    (tmp_path / "something else").mkdir()
    return tmp_path


def test_filters(root):
    assert len(catalogue(root)) == 3
    pulses = catalogue(root, where="protocol = pulses")
    assert [e.sensor for e in pulses] == ["S12", "S7"]
    assert len(catalogue(root, where="sensor ~ s12")) == 2
    today = date.today()
    yesterday, tomorrow = today - timedelta(1), today + timedelta(1)
    days = f"started >= {yesterday} and started < {tomorrow + timedelta(1)}"
    assert len(catalogue(root, where=days)) == 3
    assert catalogue(root, where=f"started >= {tomorrow + timedelta(1)}") == []
    assert catalogue(root, where=f"started < {yesterday}") == []


def test_index_follows_what_changes(root):
    catalogue(root)
    entry = catalogue(root, where="sensor = S7")[0]
    path = root / entry.name
    write_json(path / "run.json", {**read_info(path), "spikes_online": 1234})
    assert catalogue(root, where="sensor = S7")[0].spikes == 1234


@pytest.mark.parametrize("rubbish", [b"", b"{", b"SQLite format 3\0" + bytes(99)])
def test_a_broken_index_is_rebuilt(root, rubbish):
    catalogue(root)
    (root / INDEX).write_bytes(rubbish)
    assert len(catalogue(root)) == 3
    with closing(sqlite3.connect(root / INDEX)) as base:
        assert base.execute("SELECT count(*) FROM runs").fetchone() == (3,)


def test_an_index_of_another_version_is_thrown_away(root):
    with closing(sqlite3.connect(root / INDEX)) as base:
        base.executescript("PRAGMA user_version = 99; CREATE TABLE runs (x);")
    assert len(catalogue(root)) == 3


def test_an_index_that_another_program_holds_is_not_waited_for_long(root, monkeypatch):
    monkeypatch.setattr("tactile_lab.store.index.PATIENCE", 0.01)
    with closing(sqlite3.connect(root / INDEX, isolation_level=None)) as other:
        other.execute("BEGIN EXCLUSIVE")
        assert len(catalogue(root)) == 3
    assert len(catalogue(root)) == 3


def test_a_run_that_is_gone_is_forgotten(root):
    name = catalogue(root)[0].name
    shutil.rmtree(root / name)
    assert name not in [entry.name for entry in catalogue(root)]
    assert catalogue(root, where=f"name = {name}") == []


@pytest.fixture
def levels(tmp_path):
    for force, tau, note in (("0.05 N", 2.0, "calibrated"), ("0.2 N", 9.5, "CAL 50%")):
        parameters = {"level": force, "levels": ["0.1 N", "0.3 N"], "order": "given"}
        told = {"protocol": "hold", "parameters": parameters, "title": "A hold"}
        folder = RunFolder.create(tmp_path, "hold", told)
        folder.finish("complete", spikes_online=int(tau))
        add_note(folder.path, note)
        conclusion = {"critical_force_N": {"value": 0.09 + tau / 1000}, "fine": True}
        trial = {
            "rest_V_C1_V": 4.3,
            "circuit_adaptation": {"tau_s": tau},
            "adaptation": None,
        }
        results = {"conclusion": conclusion, "trials": [trial, {"rest_V_C1_V": None}]}
        write_json(folder.path / "results.json", results)
    return tmp_path


@pytest.mark.parametrize(
    ("where", "taus"),
    [
        ("protocol.level > 100 mN", [9.5]),
        ("protocol.level >= 0.05", [2.0, 9.5]),
        ("protocol.level = 50 mN or tau > 9 s", [2.0, 9.5]),
        ("protocol.levels > 250 mN", [2.0, 9.5]),
        ("protocol.levels > 350 mN", []),
        ("note ~ cal and not protocol.level < 100 mN", [9.5]),
        ("note ~ 'cal 50%'", [9.5]),
        ("note ~ 50%", [9.5]),
        ("note ~ 5_%", []),
        ('title = "a hold" and spikes = 2', [2.0]),
        ("(spikes = 2 or spikes = 9) and protocol != pulses", [2.0, 9.5]),
        ("critical_force < 95 mN", [2.0]),
        ("rest_V_C1 and starred = no", [2.0, 9.5]),
        ("tag = cal or peak_rate > 3 Hz", []),
        ("not tag", [2.0, 9.5]),
    ],
)
def test_runs_are_found_by_what_they_are(levels, where, taus):
    with Catalogue(levels) as found:
        fitting = found.known(found.runs(where=where))
    assert [table["tau"][0].number for table in fitting] == taus


def test_what_a_protocol_concludes_stands_for_its_trials_and_is_a_number():
    trial = {"circuit_adaptation": {"tau_s": 9.0}, "rest_V_C1_V": 4.3}
    concluded = {"tau_s": {"value": 3.0}, "gain": math.nan, "offset_V": math.inf}
    told = of_results({"conclusion": concluded, "trials": [trial, trial]})
    found = [(fact.key, fact.number, fact.unit) for fact in told]
    assert found == [("tau", 3.0, "s"), *[("rest_V_C1", 4.3, "V")] * 2]


@pytest.mark.parametrize(
    ("trials", "rests"),
    [
        # a staircase: its second step begins under the first one's force
        ([(4.34, 0.0, 0.05), (4.23, None, 0.1), (4.43, None, 0.0)], [4.34]),
        # a wiring check: the probe lay on 0 V
        ([(-0.02, None, None), (4.35, None, None)], []),
        # a trim: V_GS was moved
        ([(4.26, None, 0.09)], []),
        # a monitor pushes nothing, and judges no drift
        ([(4.35, None, 0.0)], [4.35]),
    ],
)
def test_V_C1_is_at_rest_where_no_force_is_and_the_probe_is_on_it(trials, rests):
    """A staircase's rest was 4.18 V beside 4.35 V of the others, a mean under force."""
    names = "rest_V_C1_V", "drift_V", "level_N"
    told = of_results({"trials": [dict(zip(names, t, strict=True)) for t in trials]})
    assert [fact.number for fact in told if fact.key == "rest_V_C1"] == rests


def test_a_trial_that_was_cut_short_gives_no_number_to_compare():
    """A chart and a page of runs counted it, and did not say so."""
    whole = {"complete": True, "peak_rate_Hz": 20.0, "latency_s": 0.2}
    cut = {"complete": False, "peak_rate_Hz": 3.0, "latency_s": 0.1}
    cut["adaptation"] = {"time_constant_s": {"value": 1.0}}
    found = grouped(of_results({"trials": [whole, cut]}))
    told = {key: [fact.number for fact in facts] for key, facts in found.items()}
    assert told == {"peak_rate": [20.0], "first_spike": [0.2]}


@pytest.mark.parametrize(
    ("where", "why"),
    [
        ("protocol.levl > 1 N", 'did you mean "protocol.level"'),
        ("protocol.level > 1 V", "N is needed"),
        ("peak_rate > 1 V", "Hz is needed"),
        ("protocol.level >", "a value is missing"),
        ("> 3", "a key is missing"),
        ("(spikes = 2", "a bracket is not closed"),
        ("spikes = 2)", "stands where it ends"),
        ("spikes = many", "is no number"),
        ('note ~ "half', "cannot be read"),
        ("   ", "it is empty"),
    ],
)
def test_a_condition_that_cannot_be_read_says_why(levels, where, why):
    with pytest.raises(SceneError, match=re.escape(why)):
        catalogue(levels, where=where)


def test_the_list_the_table_and_the_keys(levels):
    def said(*words):
        done = CliRunner().invoke(cli, ["runs", str(levels), *words])
        assert done.exit_code == 0, done.output
        return done.output.splitlines()

    assert said()[0].split() == ["run", "status", "length", "spikes", "samples"]
    listed = said("--sort", "-tau")
    assert listed[0].endswith("tau") and [x.split()[-2] for x in listed[1:]] == [
        "9.5",
        "2",
    ]
    rows = list(csv.DictReader(said("--csv", "--sort", "tau")))
    assert [row["tau (s)"] for row in rows] == ["2.0", "9.5"]
    assert rows[0]["protocol.levels (N)"] == "0.1 0.3"
    assert any(x.split() == ["critical_force", "99.5", "mN"] for x in said("--keys"))
    (told,) = said("--keys", "--json")
    assert json.loads(told)["keys"]["critical_force"] == "99.5 mN"
    assert len(said("--sort", "tag")) == 3
    assert said("--sort", "tau", "--where", "note ~ 50%")[1].split()[-2] == "9.5"
    wrong = CliRunner().invoke(cli, ["runs", str(levels), "--sort", "taw"])
    assert wrong.exit_code == 2 and 'did you mean "tau"' in wrong.output
    both = CliRunner().invoke(cli, ["runs", str(levels), "--csv", "--json"])
    assert both.exit_code == 2 and "leave out --json" in both.output


def test_a_run_that_cannot_be_read_is_listed_as_such(root):
    (root / "broken").mkdir()
    (root / "broken" / "run.json").write_text("{")
    broken = [entry for entry in catalogue(root) if entry.trouble]
    assert [entry.name for entry in broken] == ["broken"]


def test_running_and_cut_short_are_told_apart(tmp_path):
    folder = RunFolder.create(tmp_path, "pulses", {})
    assert catalogue(tmp_path)[0].status == "running"
    folder._log.close()  # what the kernel does when the process dies
    assert catalogue(tmp_path)[0].status == "cut short"


def test_a_run_whose_data_was_deleted_is_not_called_complete(tmp_path):
    folder = RunFolder.create(tmp_path, "pulses", {})
    (folder.path / "data.h5").touch()
    folder.finish("complete", samples={"V_K": {"produced": 9, "written": 9}})
    assert catalogue(tmp_path)[0].status == "complete"
    (folder.path / "data.h5").unlink()
    assert catalogue(tmp_path)[0].status == "data gone"
    shown = CliRunner().invoke(cli, ["show", str(folder.path)])
    assert f"{folder.path}: data gone, measured" in shown.output


def test_a_folder_without_runs_gets_no_index(tmp_path):
    assert catalogue(tmp_path) == []
    assert list(tmp_path.iterdir()) == []


def test_where_there_are_no_runs_none_is_found(tmp_path):
    assert catalogue(tmp_path, where="protocol.levels > 1 N and tag = cal") == []
    with pytest.raises(SceneError, match="a value is missing"):
        catalogue(tmp_path, where="tag =")


def test_a_folder_that_is_none_is_refused(tmp_path):
    with pytest.raises(RunFolderError, match="cannot be listed"):
        catalogue(tmp_path / "nowhere")
