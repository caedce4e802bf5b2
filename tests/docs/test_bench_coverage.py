"""The page on the coverage of intervals: what it calls evidence."""

import json
import runpy
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from bench_coverage_again import SAME, SEEDS, again, keep, read
from bench_coverage_page import stands, table


@pytest.mark.parametrize(
    ("values", "share"),
    [((-0.5, -0.5, -0.5), "one number repeated"), ((-0.5, 0.1, 1.5), "66.7 %")],
)
def test_one_number_repeated_is_no_share_of_hits(values, share):
    rows = [
        {
            "case": "wiring_check", "seed": seed, "commit": "0000000", "cpu": 1.0,
            "told": [["offset of a channel", value, value - 1, value + 1, 0.0]],
        }
        for seed, value in enumerate(values)
    ]  # fmt: skip
    page = table(rows)
    (row,) = [line for line in page.splitlines() if "| offset of" in line]
    assert row.split(" | ")[3] == share


def test_a_case_that_was_not_measured_here_stays_on_the_page():
    line = (
        "| wiring_check | V_GS | 26 in 26 | 100.0 % | 86.8 to 100.0 % | cannot tell "
        "| -0.03 | 0.21 | 0 of 26 | – | 0000000 |"
    )
    row = {
        "case": "rate_force, three forces", "seed": 0, "commit": "1111111",
        "cpu": 1.0, "told": [["V_GS", 0.5, 0.0, 1.0, 0.2]],
    }  # fmt: skip
    page = table([row], f"| run |\n{line}\n| rate_force, three forces | old |")
    assert line in page
    assert "| old |" not in page
    assert "| rate_force, three forces | V_GS | 1 in 1 |" in page


def told(seed: int, *, by: float = 0.0) -> dict[str, Any]:
    """A row of a run that told one name twice, the second interval moved by so much."""
    first, second = ["V_GS", 0.5, 0.4, 0.6, 0.5], ["V_GS", 0.5, 0.4, 0.6 + by, 0.5]
    return {
        "case": "force_check", "seed": seed, "commit": "0000000", "cpu": 1.0,
        "told": [first, second],
    }  # fmt: skip


def test_first_seeds_tell_whether_a_case_still_stands(tmp_path):
    file, half = tmp_path / "kept.csv", 0.1
    keep(map(told, range(SEEDS + 5)), file)
    assert list(read(file)["force_check"]) == list(range(SEEDS))
    keep([told(0, by=1.0)], file)  # stopped after one run: not what it tells
    kept = read(file)["force_check"]
    assert again(kept, told) == 0.0
    most = again(kept, lambda seed: told(seed, by=0.5 * SAME * half if seed else 0.0))
    assert 0.0 < most < SAME
    assert again(kept, lambda seed: told(seed, by=half * (seed == 7))) > SAME
    refused = {**told(0), "told": []}
    assert again(kept, lambda seed: refused) == float("inf")


def test_a_case_that_stands_names_where_it_was_run_again():
    line, other = (
        "| wiring_check | V_GS | 1 | {} |",
        "| force_check | F | 1 | 1111111 |",
    )
    page = f"{line.format('0000000')}\n{other}"
    page = stands(page, "wiring_check", "2222222")
    assert page == f"{line.format('0000000 to 2222222')}\n{other}"
    page = stands(page, "wiring_check", "3333333")
    assert page == f"{line.format('0000000 to 3333333')}\n{other}"


@pytest.mark.parametrize(
    ("runs", "outside", "said"),
    [(26, 3, "cannot tell"), (100, 0, "cannot tell"), (200, 0, "no"),
     (200, 20, "cannot tell"), (1000, 50, "yes"), (1000, 100, "no")],
)  # fmt: skip
def test_93_to_97_is_said_of_runs_that_can_tell_it(runs, outside, said):
    # three numbers of one run that hold or miss together are one draw
    rows = [
        {
            "case": "force_check", "seed": seed, "commit": "0000000", "cpu": 1.0,
            "told": [
                ["F(I) - F(0) by the field", 1.0, 0.9, 1.1, 1.0 if held else 2.0]
                for _ in range(3)
            ],
        }
        for seed, held in enumerate([False] * outside + [True] * (runs - outside))
    ]  # fmt: skip
    rows[-1]["told"][0][1] = 1.01  # or it is one number repeated
    page = table(rows)
    (row,) = [line for line in page.splitlines() if "F(0) by the field |" in line]
    cells = row.split(" | ")
    assert cells[2] == f"{3 * runs} in {runs}"
    assert cells[5] == said


def test_what_is_told_as_a_bound_is_not_held_to_be_an_interval():
    rows = [
        {
            "case": "wiring_check", "seed": seed, "commit": "0000000", "cpu": 1.0,
            "told": [["V_GS", 1.4 + seed * 1e-5, 1.37, 1.43, 1.4]],
        }
        for seed in range(200)
    ]  # fmt: skip
    page = table(rows)
    (row,) = [line for line in page.splitlines() if "| V_GS |" in line]
    assert row.split(" | ")[5] == "told as a bound"


def test_every_page_that_measures_is_listed_with_what_it_measures():
    root = Path(__file__).parents[2]
    made = runpy.run_path(str(root / "docs" / "make_reports.py"))
    for name, paths in made["PAGES"].items():
        assert (root / "docs" / f"{name}.md").exists()
        assert all((root / path).exists() for path in paths.split()), name
    told = made["pages"]()
    for path in (root / "docs").glob("*-figures.md"):
        assert f"| {path.stem} |" in told


def test_reports_say_how_long_they_take_and_go_on_where_they_were(tmp_path, capsys):
    made = runpy.run_path(str(Path(__file__).parents[2] / "docs" / "make_reports.py"))
    main, names, done = made["main"], made["STEPS"], tmp_path / "reports.json"
    names.clear()
    names.update(first=(2, "-c pass"), second=(70, "-c raise(SystemExit(3))"))
    asked = SimpleNamespace(argv=[""], executable=sys.executable, exit=sys.exit)
    main.__globals__.update(DONE=done, sys=asked)
    with pytest.raises(SystemExit, match="second"):
        main()
    assert capsys.readouterr().out.startswith("72 minutes left: first 2, second 70")
    names["second"] = (70, "-c pass")
    main()
    assert capsys.readouterr().out.startswith("first: done at")
    assert set(json.loads(done.read_text())) == {"first", "second"}
