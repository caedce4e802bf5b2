"""The verbs that measure the solver, on the shortest of their work."""

import os
import re
import signal
import subprocess
import sys

import pytest

MET_IN_COMPILED_CODE = """
import ctypes
import signal
import sys

import numpy as np
from numba import njit

from tactile_lab.cli import main
from tactile_lab.validation import accuracy

come = ctypes.CDLL(None)["raise"]
come.argtypes, come.restype = [ctypes.c_int], ctypes.c_int

@njit
def solve(number):
    come(number)
    return 1, np.zeros(3), 1.0, 2

signal.signal(signal.SIGINT, signal.default_int_handler)  # may be ignored, as by nohup
accuracy.compete = lambda *_, **__: solve(int(sys.argv[1]))
main(["validate", "accuracy"])
"""


def test_the_verbs_are_in_the_help(tactile_lab):
    said = tactile_lab("validate", "--help").out
    assert all(verb in said for verb in ("accuracy", "honesty", "stability"))


def test_honesty_of_a_few_scenes(tactile_lab, tmp_path):
    answer = tactile_lab("validate", "honesty", "--scenes", 2, "--out", tmp_path)
    assert answer.code == 0
    page = (tmp_path / "honesty.md").read_text(encoding="utf-8")
    assert "below the estimates: 2 of 2 (100.0%)" in page
    assert "T1 saturates" in page
    assert re.search(r"Commit \w+, 20\d\d-", page)


def test_stability_of_a_few_cases_ours_alone(tactile_lab):
    answer = tactile_lab("validate", "stability", "--ours", "--case", "tau = 1e")
    assert answer.code == 0
    rows = [line for line in answer.out.splitlines() if line.startswith("| tau")]
    assert len(rows) > 2
    assert all("| right, " in row for row in rows)


def test_stability_beside_the_others(tactile_lab):
    answer = tactile_lab("validate", "stability", "--case", "R_k", "--cap", 0.1)
    (row,) = [line for line in answer.out.splitlines() if line.startswith("| R_k")]
    (head,) = [line for line in answer.out.splitlines() if line.startswith("| case")]
    assert row.count("|") == head.count("|")
    # the others have so much CPU time as a busy machine gives them: right, or stopped
    assert "RK45" in answer.out and row.split("|")[4].startswith(" right")
    assert all("right" in cell or "timed out" in cell for cell in row.split("|")[7:-1])


def test_a_number_that_measures_nothing_is_refused(tactile_lab):
    for option in ("--cap=-1", "--cap=0", "--repeats=0"):
        answer = tactile_lab("validate", "accuracy", "--scene", "pulses", option)
        assert answer.code == 2 and "not in the range" in answer.err


def test_cases_that_are_none_are_refused(tactile_lab):
    answer = tactile_lab("validate", "stability", "--ours", "--case", "nonsense")
    assert answer.code == 2 and "no case with nonsense" in answer.err


def test_a_scene_that_is_none_is_refused(tactile_lab):
    answer = tactile_lab("validate", "accuracy", "--scene", "nonsense")
    assert answer.code == 2
    assert "choose from pulses" in answer.err


@pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_a_signal_that_meets_compiled_code_ends_as_elsewhere(name):
    """A SystemError of numba's was printed with its trace, and the exit code was 1."""
    number = getattr(signal, name)
    done = subprocess.run(
        [sys.executable, "-c", MET_IN_COMPILED_CODE, str(int(number))],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 128 + number, done.stderr
    assert "Error" not in done.stderr and "Traceback" not in done.stderr
