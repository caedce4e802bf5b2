"""The verbs that measure the solver, on the shortest of their work."""

import re


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
