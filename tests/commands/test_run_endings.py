"""How a run ended is told at once and by the exit code, whatever comes after it."""

import json
import os
import subprocess
import sys
from contextlib import nullcontext

import pytest

from tactile_lab.lab import Lab

SHORT = [
    "--set", 'protocol.levels=["200 mN"]',
    "--set", "protocol.hold=0.2 s",
    "--set", "protocol.rest=0.1 s",
]  # fmt: skip
GONE = ["--set", 'simulated.coil_unplugged="0.8 s"']
"""The source is unplugged for good: nobody can verify that it is off."""

AFTERWARDS = [
    ValueError("a report with a bug"),
    MemoryError(),
    KeyboardInterrupt(),
    BrokenPipeError(32, "Broken pipe"),
]


@pytest.mark.parametrize("failure", AFTERWARDS, ids=lambda one: type(one).__name__)
@pytest.mark.parametrize(("lost", "code"), [([], 0), (GONE, 4)], ids=["off", "unknown"])
def test_nothing_in_the_report_changes_how_the_run_ended(
    tactile_lab, tmp_path, monkeypatch, failure, lost, code
):
    def fails(*_):
        raise failure

    monkeypatch.setattr("tactile_lab.report.write.write", fails)
    done = tactile_lab("run", *SHORT, *lost, "--out", tmp_path)
    assert done.code == code
    (run,) = tmp_path.iterdir()
    assert str(run) in done.err + done.out
    info = json.loads((run / "run.json").read_text())
    assert info["coil_verified_off"] is (code == 0)
    if code == 4:
        # told before the report is begun, once
        warned = done.err.index("warning: the report")
        assert done.err.index("OUTPUT STATE UNKNOWN") < warned
        assert done.err.count("OUTPUT STATE UNKNOWN") == 1


@pytest.mark.skipif(sys.platform == "win32", reason="pipes are POSIX's")
@pytest.mark.parametrize(
    ("closed", "options"),
    [("stdout", ["--no-report"]), ("stderr", ["--no-report"]), ("both", [])],
    ids=["stdout", "stderr", "both"],
)
def test_a_terminal_that_was_closed_does_not_end_the_run(tmp_path, closed, options):
    read, write = os.pipe()
    os.close(read)
    ends = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    ends |= {name: write for name in ends if closed in (name, "both")}
    asked = ["run", *SHORT, *options, "--out", tmp_path]
    command = [sys.executable, "-m", "tactile_lab", *asked]
    done = subprocess.run(command, **ends, check=False)
    os.close(write)
    assert done.returncode == 0
    (run,) = tmp_path.iterdir()
    info = json.loads((run / "run.json").read_text())
    assert info["status"] == "complete" and info["coil_verified_off"] is True


@pytest.mark.parametrize("failure", AFTERWARDS, ids=lambda one: type(one).__name__)
def test_a_report_that_fails_leaves_the_answer_whole(
    tactile_lab, tmp_path, monkeypatch, failure
):
    def fails(*_):
        raise failure

    monkeypatch.setattr("tactile_lab.report.write.write", fails)
    done = tactile_lab("run", *SHORT, "--json", "--out", tmp_path)
    (run,) = tmp_path.iterdir()
    assert done.json["run"] == str(run)
    assert done.json["status"] == "complete" and done.json["report"] is None


def test_what_follows_a_run_is_called_where_nobody_reads_on(
    tactile_lab, tmp_path, monkeypatch
):
    def full(*_):
        raise OSError(28, "No space left on device")

    followed = []
    monkeypatch.setattr(Lab, "follow", lambda _, run: followed.append(run) or "")
    monkeypatch.setattr("tactile_lab.commands.run.print_run", full)
    done = tactile_lab("run", *SHORT, "--no-report", "--out", tmp_path)
    assert done.code == 1, "complete, but its answer is lost"
    assert followed == [*tmp_path.iterdir()]
    assert "the report was cut short" not in done.err


def test_nothing_is_said_of_what_follows_where_nothing_does(
    tactile_lab, tmp_path, monkeypatch
):
    """A terminal showed `after_run:  ...` after every run."""
    said = []
    shown = lambda text: said.append(text) or nullcontext()  # noqa: E731
    monkeypatch.setattr("tactile_lab.commands.one_run.working", shown)
    assert tactile_lab("run", *SHORT, "--no-report", "--out", tmp_path).code == 0
    assert said == []
