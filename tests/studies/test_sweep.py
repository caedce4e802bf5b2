"""``run --sweep KEY=VALUES --repeat N``: the short form of a study."""

import json
from pathlib import Path

import xarray
from click.testing import CliRunner

from tactile_lab.cli import cli

SHORT = (
    "run", "demo", "--set", "protocol.levels=[\"200 mN\"]",
    "--set", "protocol.hold=200 ms", "--set", "protocol.rest=100 ms",
    "--set", "record.sample_rate=20 kS/s",
)  # fmt: skip


def test_a_sweep_runs_the_bench_at_each_value(tmp_path: Path) -> None:
    answer = CliRunner().invoke(
        cli,
        [*SHORT, "--sweep", "sensor.V_GS=1.4 V,1.42 V",
         "--sweep", "protocol.levels=180 mN:200 mN:20 mN",
         "--out", str(tmp_path), "--json"],
    )  # fmt: skip
    assert answer.exit_code == 0, answer.output
    assert json.loads(answer.stdout)["points"] == 4
    page = (tmp_path / "demo_sweep" / "report.html").read_text(encoding="utf-8")
    assert "response to sensor.V_GS" in page
    assert "response to protocol.levels" in page
    levels = xarray.open_zarr(tmp_path / "demo_sweep" / "data.zarr")["protocol.levels"]
    assert levels.values.tolist() == [0.18, 0.2] and levels.attrs["units"] == "N"
    assert "Simulated bench" in page
    listed = CliRunner().invoke(cli, ["runs", str(tmp_path)])
    assert listed.exit_code == 0, "what a study keeps is no broken run"


def test_what_belongs_to_one_run_is_refused(tmp_path: Path) -> None:
    for more in (["--repeat", "2"], ["--sweep", "sensor.V_GS=1.4 V"]):
        answer = CliRunner().invoke(cli, [*SHORT, *more, "--realtime"])
        assert answer.exit_code == 2
        assert "--realtime cannot go with --sweep" in answer.stderr
    answer = CliRunner().invoke(cli, [*SHORT, "--sweep", "protocol.level=1 N:2 N:1 N"])
    assert answer.exit_code == 2 and 'did you mean "levels"' in answer.stderr
    answer = CliRunner().invoke(cli, [*SHORT, "--sweep", "sensor.V_GS"])
    assert answer.exit_code == 2 and "KEY=FROM:TO:STEP" in answer.stderr
