"""Several runs in turn: planned before, kept on disk, gone on with after a fault."""

import json
import signal
import socket
import subprocess
import sys
import time
from datetime import datetime, timedelta
from pathlib import Path

import pytest
from late_ctrl_c import late

from tactile_lab.commands.sequence import _time
from tactile_lab.commands.status_server import StatusServer
from tactile_lab.engine.execution import Execution
from tactile_lab.lab import Lab

SHORT = {
    "protocol.hold": "0.2 s",
    "protocol.ramp": "0.1 s",
    "protocol.rest": "0.1 s",
    "protocol.levels": ["50 mN"],
    "record.sample_rate": "20 kS/s",
}


@pytest.fixture
def asked(tmp_path):
    def write(*runs):
        text = ""
        for one in runs:
            changes = json.dumps({**SHORT, **one.pop("set", {})})
            changes = changes.replace('": ', '" = ')
            text += f"[[run]]\nset = {changes}\n"
            text += "".join(f"{k} = {json.dumps(v)}\n" for k, v in one.items())
        (tmp_path / "night.toml").write_text(text)
        return tmp_path / "night.toml"

    return write


@pytest.fixture
def sequence(tactile_lab, tmp_path):
    def run(*arguments):
        out = ("--out", tmp_path / "runs", "--no-report")
        return tactile_lab("sequence", *arguments, *out)

    return run


def kept(tmp_path):
    held = json.loads((tmp_path / "runs" / "sequence.json").read_text())["runs"]
    return [(one["status"], one["run"]) for one in held]


FAULTS = """
from typing import ClassVar

from tactile_lab.trial import Protocol, Trial, Trials
from tactile_lab.waveform import Waveform
from pathlib import Path


class Faults(Protocol):
    name: ClassVar[str] = "faults"
    title: ClassVar[str] = "Faults until it is mended"
    signals: ClassVar[tuple[str, ...]] = ("V_C1",)

    def trials(self) -> Trials:
        yield Trial(force=Waveform.pulse(0.05, ramp=0.1, hold=0.2), label="1")
        if not Path(__file__).with_name("mended").exists():
            raise RuntimeError("the probe fell off")
"""


def test_a_fault_ends_it_and_resume_goes_on_with_that_run(
    sequence, asked, tmp_path, monkeypatch
):
    (tmp_path / "faults.py").write_text(FAULTS)
    text = asked({"scene": "demo", "times": 2}, {"scene": "demo"}).read_text()
    text += '[[run]]\nscene = "faults.py"\n[[run]]\nscene = "faults.py"\n'
    (tmp_path / "night.toml").write_text(text)
    (tmp_path / "mended").touch()  # the plan draws the trials, too

    def load_then_break(step):
        if kept(tmp_path)[2][0] == "complete":
            (tmp_path / "mended").unlink(missing_ok=True)
        return real(step)

    from tactile_lab.engine import execution

    real = execution.Execution.run
    monkeypatch.setattr(execution.Execution, "run", load_then_break)
    ended = sequence(tmp_path / "night.toml")
    assert ended.code == 3, ended.err
    assert "the probe fell off" in ended.err
    done = kept(tmp_path)
    assert [status for status, _ in done] == ["complete"] * 3 + ["faulted", ""]
    assert "sequence --resume" in ended.err

    refused = sequence("demo")
    assert refused.code == 2
    assert "2 runs to be done" in refused.err

    monkeypatch.setattr(execution.Execution, "run", real)
    (tmp_path / "mended").touch()
    again = sequence("--resume")
    assert again.code == 0, again.err
    assert kept(tmp_path)[:3] == done[:3], "what was complete was run again"
    assert [status for status, _ in kept(tmp_path)] == ["complete"] * 5
    assert all(Path(run).is_dir() for _, run in kept(tmp_path))


def test_a_stop_between_two_runs_begins_no_other(
    sequence, asked, tmp_path, monkeypatch
):
    ended = StatusServer.end

    def stopped_by_another_program(server, result):
        ended(server, result)
        host, port = server.address.removeprefix("tcp://").split(":")
        with socket.create_connection((host, int(port))) as link:
            link.sendall(b'{"do": "stop"}\n')
            told = (json.loads(line)["event"] for line in link.makefile())
            assert "stopping" in told

    monkeypatch.setattr(StatusServer, "end", stopped_by_another_program)
    runs = asked({"scene": "demo", "times": 2})
    answer = sequence(runs, "--status", "tcp://127.0.0.1:0")
    assert answer.code == 130, answer.err
    assert [status for status, _ in kept(tmp_path)] == ["complete", ""]


def test_ctrl_c_while_a_run_is_told_of_begins_no_other(
    sequence, asked, tmp_path, monkeypatch
):
    monkeypatch.setattr(Lab, "follow", lambda *_: signal.raise_signal(signal.SIGINT))
    answer = sequence(asked({"scene": "demo", "times": 2}))
    assert answer.code == 130, answer.err
    assert "cut short" in answer.err
    assert [status for status, _ in kept(tmp_path)] == ["complete", ""]


def test_ctrl_c_as_a_run_is_complete_begins_no_other(
    sequence, asked, tmp_path, monkeypatch
):
    """It comes when all is stored, so the run cannot be ended by it any more."""
    monkeypatch.setattr(Execution, "run", late(Execution.run))
    answer = sequence(asked({"scene": "demo", "times": 2}))
    assert answer.code == 130, answer.err
    assert [status for status, _ in kept(tmp_path)] == ["complete", ""]


def test_nothing_is_begun_if_one_of_them_cannot_be(sequence, asked, tmp_path):
    levels = {"protocol.levels": ["9 N"]}
    answer = sequence(asked({"scene": "demo"}, {"scene": "demo", "set": levels}))
    assert answer.code == 2
    assert "9 N" in answer.err
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[[run]]\nscene = 3\n", "scene is missing"),
        ('[[run]]\nscene = "demo"\ntimes = 0\n', "times = 0"),
        ('[[run]]\nscene = "demo"\ntime = 2\n', 'no key "time"; did you mean "times"'),
        ('run = "demo"\n', "[[run]]"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused(sequence, tmp_path, text, told):
    (tmp_path / "night.toml").write_text(text)
    answer = sequence(tmp_path / "night.toml")
    assert answer.code == 2
    assert told in answer.err


def test_a_time_to_begin(sequence):
    past = f"{datetime.now() - timedelta(hours=1):%Y-%m-%dT%H:%M}"
    for text, told in (("25:00", "write HH:MM"), (past, "has passed")):
        answer = sequence("demo", "--at", text)
        assert answer.code == 2
        assert told in answer.err
    assert "no sequence was begun" in sequence("--resume").err


def test_what_a_kill_left_undone_after_a_run_is_done_on_resume(
    tactile_lab, sequence, asked, tmp_path, monkeypatch
):
    assert sequence(asked({"scene": "demo", "times": 2})).code == 0
    state = tmp_path / "runs" / "sequence.json"
    held = json.loads(state.read_text())
    first, second = held["runs"]
    first["told"] = False  # killed as its report was written
    second["status"] = "running"  # and another as it ran
    state.write_text(json.dumps(held))
    called = tmp_path / "called"
    script = f"import sys; open({str(called)!r}, 'a').write(sys.argv[1])"
    after = [sys.executable, "-c", script]
    (tmp_path / "lab.toml").write_text(f"after_run = {json.dumps(after)}\n")
    monkeypatch.setenv("TACTILE_LAB_CONFIG", str(tmp_path / "lab.toml"))

    resumed = tactile_lab("sequence", "--resume", "--out", tmp_path / "runs")
    assert resumed.code == 0, resumed.err
    assert (Path(first["run"]) / "report.html").exists()
    assert f"{second['run']} was not ended" in resumed.err
    again = kept(tmp_path)[1]
    assert again[0] == "complete"
    assert again[1] != second["run"]
    assert called.read_text() == f"{first['run']}{again[1]}"
    assert sequence("--resume").code == 0
    assert called.read_text() == f"{first['run']}{again[1]}"


def test_one_that_goes_on_is_not_gone_on_with_by_another_program(
    sequence, asked, tmp_path, monkeypatch
):
    """It was: the run in progress was said not to have ended, and done again."""
    ended = StatusServer.end

    def another_program(server, result):
        ended(server, result)
        second = [sys.executable, "-m", "tactile_lab", "sequence", "--resume"]
        second += ["--no-report", "--out", tmp_path / "runs"]
        answers.append(subprocess.run(second, check=False, capture_output=True))

    answers = []
    monkeypatch.setattr(StatusServer, "end", another_program)
    runs = asked({"scene": "demo"})
    assert sequence(runs, "--status", "tcp://127.0.0.1:0").code == 0
    assert [answer.returncode for answer in answers] == [2]
    assert b"Another program goes on with" in answers[0].stderr
    assert len([*(tmp_path / "runs").glob("*/run.json")]) == 1


def test_a_time_of_another_zone_is_that_time_here(monkeypatch):
    monkeypatch.setenv("TZ", "Europe/Berlin")
    time.tzset()
    try:
        assert _time("2031-01-01T22:00Z") == datetime(2031, 1, 1, 23, 0)
        assert _time("2031-01-01T22:00") == datetime(2031, 1, 1, 22, 0)
    finally:
        monkeypatch.undo()
        time.tzset()


def test_a_folder_that_cannot_be_made_is_refused(tactile_lab, tmp_path):
    (tmp_path / "file").touch()
    answer = tactile_lab("sequence", "v_c1_only", "--out", tmp_path / "file" / "runs")
    assert answer.code == 2
    assert "No sequence can be kept in" in answer.err


def test_what_follows_a_run_finds_it_from_another_folder(
    sequence, tactile_lab, asked, tmp_path, monkeypatch
):
    """`--out runs` is kept as it was given, and the next program begins elsewhere."""
    monkeypatch.chdir(tmp_path)
    runs = asked({"scene": "demo"})
    assert tactile_lab("sequence", runs, "--no-report", "--out", "runs").code == 0
    state = tmp_path / "runs" / "sequence.json"
    state.write_text(state.read_text().replace('"told": true', '"told": false'))
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    followed = []
    monkeypatch.setattr(Lab, "follow", lambda _, run: followed.append(run) or "")
    assert sequence("--resume").code == 0
    assert [run.is_dir() for run in followed] == [True]


def test_resume_is_not_told_another_bench(sequence, asked):
    assert sequence(asked({"scene": "demo"})).code == 0
    answer = sequence("--resume", "--bench", "sim")
    assert answer.code == 2
    assert "leave --bench out" in answer.err


def test_what_is_noted_of_a_sequence_is_noted_of_what_is_resumed(
    sequence, asked, tmp_path
):
    """--resume forgot the --note of the night before."""
    file = asked({"scene": "demo", "times": 2})
    assert sequence(file, "--note", "sensor=S7").code == 0
    state = tmp_path / "runs" / "sequence.json"
    held = json.loads(state.read_text())
    assert held["notes"] == {"sensor": "S7"}
    held["runs"][1] |= {"status": "", "run": "", "told": False}
    state.write_text(json.dumps(held))
    assert sequence("--resume", "--note", "operator=Ada").code == 0
    _, again = kept(tmp_path)
    info = json.loads((Path(again[1]) / "run.json").read_text())
    assert info["notes"] == {"sensor": "S7", "operator": "Ada"}
