"""What a study says, against what can be computed by hand."""

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from tactile_lab import Circuit
from tactile_lab.cli import cli
from tactile_lab.model.equations import critical_force
from tactile_lab.quantity import parse, show, typed
from tactile_lab.studies.answers import conclude
from tactile_lab.studies.carry_out import carry_out
from tactile_lab.studies.figures import plots
from tactile_lab.studies.study import load_study

PARTS = {"R1": 9.58e4, "V_GS": 2e-3, "V_th": 5e-3}
STUDY = """
title = "Tolerances"
scene = "demo"
keep = ["critical_force"]

[[axis]]
key = "sensor.R1"
normal = "1 %"

[[axis]]
key = "sensor.V_GS"
normal = "2 mV"

[[axis]]
key = "sensor.V_th"
normal = "5 mV"

[[axis]]
key = "sensor.C1"
normal = "5 %"
"""


def said(text: str, tmp_path: Path):
    file = tmp_path / "parts.toml"
    file.write_text(text)
    return conclude(carry_out(load_study(file), tmp_path, count=1))


def test_the_papers_circuit_has_the_papers_critical_force() -> None:
    assert critical_force(Circuit()) == pytest.approx(92.60e-3, abs=5e-6)
    assert np.isnan(critical_force(Circuit(V_th=1e4)))


def slopes() -> dict[str, float]:
    """Change of the critical force by one deviation, central differences, N."""
    found = {}
    for name, width in PARTS.items():
        at = getattr(Circuit(), name)
        up, down = (Circuit(**{name: at + sign * width}) for sign in (1, -1))
        found[name] = (critical_force(up) - critical_force(down)) / 2
    return found


def test_sobol_indices_are_the_squares_of_the_slopes(tmp_path: Path) -> None:
    answer = said(STUDY + '[draw]\npoints = 256\nmethod = "indices"\n', tmp_path).values
    changes = slopes()
    whole = sum(change**2 for change in changes.values())
    for name, change in changes.items():
        first = answer[f"sobol_critical_force_sensor.{name}"]["first"]
        assert first.value == pytest.approx(change**2 / whole, abs=0.06)
        assert first.low - 0.03 < change**2 / whole < first.high + 0.03
    nothing = answer["sobol_critical_force_sensor.C1"]["total"]
    assert nothing.value == nothing.low == nothing.high == 0


def test_a_tornado_has_the_slopes_largest_first(tmp_path: Path) -> None:
    (table,) = said(STUDY + '[draw]\nmethod = "tornado"\n', tmp_path).tables
    changes = slopes()
    order = sorted(changes, key=lambda name: -abs(changes[name]))
    assert [row[0] for row in table.rows][:3] == [f"sensor.{name}" for name in order]
    for row in table.rows[:3]:
        change = changes[row[0].removeprefix("sensor.")]
        high = parse(typed(row[3]).lstrip("+"), "N")
        assert high == pytest.approx(change, rel=0.02)


def test_the_yield_counts_what_is_good_with_an_interval(tmp_path: Path) -> None:
    text = (
        STUDY + "[draw]\npoints = 200\n[require]\ncritical_force = { most = 0.0926 }\n"
    )
    share = said(text, tmp_path).values["yield"]
    assert 0.35 < share.value < 0.65
    assert share.low < share.value < share.high
    assert share.high - share.low == pytest.approx(
        2 * 1.96 * (0.25 / 200) ** 0.5, rel=0.1
    )


def test_what_not_every_point_has_is_told_of_those_that_have_it(tmp_path: Path) -> None:
    given = tomllib.loads(STUDY) | {"keep": ["spike_count", "first_spike"]}
    given |= {"set": {"protocol.levels": ["96.5 mN"]}, "draw": {"points": 20}}
    found = carry_out(load_study(given), tmp_path, count=1)
    fired = found.numbers()["spike_count"] > 0
    (of,) = (s for s in conclude(found).sentences if s.startswith("first_spike"))
    assert 0 < fired.sum() < 20
    assert f"of the {fired.sum()} of 20 that have one, median" in of
    assert conclude(found).values["first_spike"]["points"] == fired.sum()


def test_a_tornado_says_none_where_a_point_has_no_number(tmp_path: Path) -> None:
    given = tomllib.loads(STUDY) | {"keep": ["first_spike"]}
    given |= {"set": {"protocol.levels": ["96 mN"]}, "draw": {"method": "tornado"}}
    (table,) = conclude(carry_out(load_study(given), tmp_path, count=1)).tables
    assert "nan" not in f"{table.title} {table.rows}"


@pytest.mark.parametrize(
    ("method", "told"), [("random", False), ("latin hypercube", True), ("sobol", True)]
)
def test_a_share_of_draws_that_are_not_independent_says_so(
    tmp_path: Path, method: str, told: bool
) -> None:
    given = tomllib.loads(STUDY) | {"draw": {"points": 32, "method": method}}
    given |= {"require": {"critical_force": {"most": "92.6 mN"}}}
    found = conclude(carry_out(load_study(given), tmp_path, count=1))
    assert ("as of independent draws" in found.text) is told


@pytest.mark.parametrize("most", [0.0926, "92.6 mN"])
def test_draws_at_several_values_have_a_yield_at_each_and_none_together(
    tmp_path: Path, most: float | str
) -> None:
    given = tomllib.loads(STUDY)
    given["axis"][2] = {"key": "sensor.V_th", "values": ["2.55 V", "2.56 V", "2.57 V"]}
    given |= {"draw": {"points": 50}, "require": {"critical_force": {"most": most}}}
    found = conclude(carry_out(load_study(given), tmp_path, count=1))
    assert isinstance(found.values["yield"], float)
    assert "there is no interval" in found.text and "at most 92.6 mN" in found.text
    (table,) = found.tables
    assert table.title == "Yield" and len(table.rows) == 3
    assert "% (" in table.rows[0][-1]


def test_values_without_draws_are_told_one_by_one(tmp_path: Path) -> None:
    given: dict[str, Any] = {"scene": "demo", "keep": ["critical_force"]}
    given["axis"] = [
        {"key": "sensor.V_GS", "values": ["1.38 V", "1.4 V"]},
        {"key": "sensor.R1", "values": ["9 MOhm", "10 MOhm", "11 MOhm"]},
    ]
    given["require"] = {"critical_force": {"most": "90 mN"}}
    found = conclude(carry_out(load_study(given), tmp_path, count=1))
    (table,) = found.tables
    assert table.headings == ("sensor.V_GS", "sensor.R1", "critical_force")
    here = critical_force(Circuit(V_GS=1.4, R1=9e6))
    assert ("1.4 V", "9 MOhm", show(float(here), "N")) in table.rows
    assert "interval" not in found.text.replace("there is no interval", "")


def test_bars_stand_where_something_was_drawn_and_not_over_a_grid(
    tmp_path: Path,
) -> None:
    drawn = {"key": "sensor.R1", "normal": "1 %"}
    grid = [
        {"key": f"sensor.{key}", "values": [f"{at} {unit}" for at in values]}
        for key, values, unit in (
            ("V_GS", (1.4, 1.38), "V"),
            ("C1", (200, 220), "pF"),
            ("R2", (1, 2), "MOhm"),
        )
    ]
    for axes, bars in (([*grid[:2], drawn], True), (grid, False)):
        draw = {"draw": {"points": 8}} if bars else {}
        asked = {"scene": "demo", "keep": ["critical_force"], "axis": axes, **draw}
        found = carry_out(load_study(asked, f"bars {bars}"), tmp_path, count=1)
        first = next(p for p in plots(found) if p.name.startswith("response"))
        assert ("95 %" in first.caption) is bars
        curve = first.panels[0].series[0]
        assert (curve.y_error is not None) is bars
        # a line through values in another order would go back over itself
        assert list(curve.x) == [1.38, 1.4]
        values = found.study.design.values(np.array(curve.of))
        assert [value[0] for value in values] == [1.38, 1.4]


def test_from_the_command_line_to_a_page(tmp_path: Path) -> None:
    (tmp_path / "grid.toml").write_text("""
        scene = "demo"
        keep = ["spike_count", "first_spike"]
        set = { "protocol.levels" = ["200 mN"], "protocol.hold" = "200 ms" }
        [[axis]]
        key = "sensor.V_GS"
        values = ["1.38 V", "1.4 V"]
        [[axis]]
        key = "sensor.C2"
        uniform = "5 %"
        [draw]
        points = 4
    """)
    arguments = ["study", str(tmp_path / "grid.toml"), "--out", str(tmp_path)]
    planned = CliRunner().invoke(cli, [*arguments, "--plan"])
    assert "points    2 × 4 = 8, 0 of them known" in planned.output
    assert "start and report take about 6 s besides" in planned.output
    answer = CliRunner().invoke(cli, [*arguments, "--workers", "1"])
    assert answer.exit_code == 0, answer.output
    assert "first_spike: median" in answer.output
    assert " ms" in answer.output
    page = (tmp_path / "grid" / "report.html").read_text(encoding="utf-8")
    assert "response to sensor.V_GS" in page and "draws of sensor.C2" in page
    again = CliRunner().invoke(cli, [*arguments, "--json"])
    told = json.loads(again.stdout)
    assert told["points"] == 8 and told["failed"] == 0
    refused = CliRunner().invoke(cli, ["study", str(tmp_path / "gird.toml")])
    assert refused.exit_code == 2 and "does not exist" in refused.output
