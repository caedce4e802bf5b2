"""Ctrl-C in a program whose run was just complete: it ends, and begins no other run."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from served_source import Source

from tactile_lab.store.folder import read_info

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")

SUPPORT = Path(__file__).parents[1] / "support"

PROGRAM = """
import sys
from late_ctrl_c import late
from tactile_lab.cli import main
from tactile_lab.commands import day_one
from tactile_lab.engine.execution import Execution

Execution.run = late(Execution.run)
day_one._verb = lambda words: (words[0], "")  # doctor and devices have their own tests
main(sys.argv[1:])
"""


def ended(*arguments: object, state: Path) -> "subprocess.CompletedProcess[str]":
    """The program, ended."""
    return subprocess.run(
        [sys.executable, "-c", PROGRAM, *map(str, arguments)],
        capture_output=True,
        text=True,
        env=os.environ | {"XDG_STATE_HOME": str(state), "PYTHONPATH": str(SUPPORT)},
    )


def states(runs: Path) -> list[str]:
    """How its runs ended."""
    return [read_info(run)["status"] for run in sorted(runs.glob("2*"))]


def test_a_study_on_a_bench_plays_no_other_point(tmp_path: Path):
    """It said so with exit code 0, as if all points were done."""
    source = Source(tmp_path)
    file = tmp_path / "late.toml"
    file.write_text(
        f'scene = "demo"\non = "bench"\nbench = "{source.bench}"\n'
        'keep = ["spike_count"]\n[set]\n"record.signals" = ["force"]\n'
        '"protocol.ramp" = "20 ms"\n"protocol.hold" = "50 ms"\n'
        '"protocol.rest" = "50 ms"\n'
        '[[axis]]\nkey = "protocol.levels"\nvalues = [["40 mN"], ["60 mN"]]\n'
    )
    done = ended("study", file, "--out", tmp_path / "out", state=tmp_path)
    source.served.close()
    assert done.returncode == 130, done.stdout + done.stderr
    assert "interrupted" in done.stderr and "read back" in done.stderr
    # the second was made, and does not stand as one that still goes on
    assert states(tmp_path / "out" / "late" / "runs") == ["complete", "aborted"]
    assert not source.output


def test_a_first_day_begins_no_other_step(tmp_path: Path):
    short = ("hold=0.2 s", "calibrate=false", "push=20 mN")
    words = [w for one in short for w in ("--set", f"wiring_check:protocol.{one}")]
    words += ["--set", "wiring_check:record.sample_rate=20 kS/s"]
    day = tmp_path / "day"
    done = ended("day-one", "--bench", "sim", "--out", day, *words, state=tmp_path)
    assert done.returncode == 130, done.stdout + done.stderr
    assert states(day / "runs") == ["complete"]
    assert "calibrate_field --bench" not in done.stdout
    held = json.loads((day / "day-one.json").read_text())
    assert "calibrate_field" not in held["done"]
