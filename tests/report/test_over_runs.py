"""One number over many runs: what is usual, what is not, and for which specimen."""

import math
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from click.testing import CliRunner

from tactile_lab.analysis.control_chart import control_chart
from tactile_lab.cli import cli
from tactile_lab.errors import ParameterError
from tactile_lab.report.over_runs import OverRuns, RunValue
from tactile_lab.store.folder import RunFolder, write_json


def points(values, sensors="A"):
    begun = datetime(2026, 1, 1, tzinfo=UTC)
    return [
        RunValue(
            f"run{i:02d}", begun + timedelta(days=i), sensors[i % len(sensors)], v, True
        )
        for i, v in enumerate(values)
    ]


def test_limits_are_shewharts():
    # NIST e-Handbook 6.3.2.2: flow rates of ten batches; UCL 53.71, LCL 46.50
    flow = [49.6, 47.6, 49.9, 51.3, 47.8, 51.2, 52.6, 52.4, 53.6, 52.1]
    found = control_chart(flow)
    moving = np.abs(np.diff(flow)).mean()
    assert moving == pytest.approx(1.8778, abs=1e-4)
    assert found.mean == pytest.approx(50.81)
    assert found.high == pytest.approx(50.81 + 3 * moving / 1.128, abs=2e-3)
    assert found.low == pytest.approx(50.81 - 3 * moving / 1.128, abs=2e-3)
    assert found.outside == () and found.drifting == ()


def test_of_normal_values_few_lie_outside():
    drawn = np.random.default_rng(3).normal(size=20_000)
    found = control_chart(drawn)
    assert len(found.outside) / 20_000 == pytest.approx(0.0027, abs=0.002)


def test_what_jumps_and_what_drifts_is_told():
    jump = OverRuns.of("tau", "s", points([8.0, 8.1] * 6 + [9.0]))
    assert any("run12 lies outside: 9 s" in text for text in jump.sentences)
    step = OverRuns.of("tau", "s", points([8.0, 8.1] * 5 + [8.2, 8.3] * 5))
    assert any("it drifts" in text for text in step.sentences)
    still = OverRuns.of("tau", "s", points([8.0, 8.1] * 6))
    assert "All lie within, and none drifts." in still.sentences


def test_equal_values_lie_within_and_do_not_drift():
    """Their mean differs from them in its last digit: all were told as outside."""
    same = OverRuns.of("rest_V_C1", "V", points([4.36877] * 12))
    assert same.sentences[-1] == "All lie within, and none drifts."


def test_no_number_of_spikes_below_none_is_usual():
    """ "Usual is −215 to 340.8" of spikes was told."""
    found = OverRuns.of("spikes", "", points([3.0, 60.0, 0.0, 49.0, 470.0] * 3))
    (usual,) = (text for text in found.sentences if text.startswith("Usual"))
    assert usual.startswith("Usual is 0 to ")
    volts = OverRuns.of("rest_V_C1", "V", points([3.0, 60.0, 0.0, 49.0, 470.0] * 3))
    assert volts.chart is not None and volts.chart.low < 0


def test_what_lies_outside_is_not_told_as_a_limit():
    values = [8.6900, 8.6901] * 6
    found = OverRuns.of("tau", "s", points([*values, 8.69045]))
    assert found.chart is not None and found.chart.outside == (12,)
    (usual,) = (text for text in found.sentences if text.startswith("Usual"))
    told = found.sentences[-1].rpartition(": ")[2].removesuffix(".")
    assert told not in usual
    low, high = (float(word) for word in usual.replace(" s", "").split()[2:5:2])
    assert low < high < float(told.removesuffix(" s"))


def test_few_runs_have_a_mean_and_no_limits():
    found = OverRuns.of("tau", "s", points([8.0, 9.0], "AB"))
    assert found.chart is None and "8 runs or more" in found.sentences[-1]
    assert [row[:2] for row in found.table.rows] == [("A", "1"), ("B", "1")]
    with pytest.raises(ParameterError, match="at least 8"):
        control_chart([1.0, math.nan])
    with pytest.raises(ParameterError, match="No run has the number"):
        OverRuns.of("tau", "s", [])


def test_runs_of_one_specimen_are_no_specimens():
    """Four runs of two were told as four independent values, with half the error."""
    found = OverRuns.of("tau", "s", points([8.0, 9.0, 8.000002, 9.0], "AB"))
    assert found.sentences[0] == (
        "tau: 8.50 ± 0.50 s (standard error, over the means of 2 specimens, 4 runs)."
    )
    assert found.table.rows[0] == ("A", "2", "8.000001 s", "1 µs"), "to its error"
    unnamed = OverRuns.of("tau", "s", points([8.0, 9.0], [""]))
    assert unnamed.sentences[0].endswith("(standard error, 2 runs).")


@pytest.mark.parametrize(
    ("apart", "told"), [(20.0, "Seconds"), (3000.0, "Minutes"), (86400.0, "Days")]
)
def test_time_is_told_in_what_the_runs_are_apart_in(apart, told):
    begun = datetime(2026, 1, 1, 9, 30, tzinfo=UTC)
    runs = [
        RunValue(f"run{i}", begun + i * timedelta(seconds=apart), "A", 8.0 + i, True)
        for i in range(3)
    ]
    plot = OverRuns.of("tau", "s", runs).plot
    assert plot.x_label == f"{told} since 2026-01-01 09:30"
    assert 2 <= plot.panels[0].series[0].x[-1] < 101


def test_from_run_folders_to_a_page(tmp_path):
    for k in range(9):
        told = {"protocol": "hold", "notes": {"sensor": f"S{k % 2 + 1}"}}
        folder = RunFolder.create(tmp_path, "hold", {**told, "simulated": True})
        folder.finish("complete")
        trials = [{"rest_V_C1_V": 4.3 + 0.001 * (k % 3)}, {"rest_V_C1_V": 4.3}]
        write_json(folder.path / "results.json", {"trials": trials})
    page = tmp_path / "rest.html"
    asked = ["chart", "rest_V_C1", str(tmp_path)]
    done = CliRunner().invoke(cli, [*asked, "--out", str(page)])
    assert done.exit_code == 0, done.output
    assert "Usual is" in done.output and "S1" in done.output
    assert "<svg" in page.read_text() and "Shewhart" in page.read_text()
    info = folder.path / "run.json"  # the page took its place
    before = info.read_bytes()
    refused = CliRunner().invoke(cli, [*asked, "--out", str(info)])
    assert refused.exit_code == 2 and "in .html" in refused.output
    assert info.read_bytes() == before
    wrong = CliRunner().invoke(cli, ["chart", "rest", str(tmp_path)])
    assert wrong.exit_code == 2 and "runs --keys" in wrong.output
