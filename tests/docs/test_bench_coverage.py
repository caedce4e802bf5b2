"""The page on the coverage of intervals: what it calls evidence."""

import runpy
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "make_bench_coverage.py"


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
    page = runpy.run_path(str(PAGE))["table"](rows)
    (row,) = [line for line in page.splitlines() if "| offset of" in line]
    assert row.split(" | ")[3] == share
