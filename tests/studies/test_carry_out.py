"""A study on disk: what is known is kept, and never computed twice."""

import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from short_studies import LEVELS, SHORT, done, same

from tactile_lab import simulate, study
from tactile_lab.cli import cli
from tactile_lab.errors import (
    RecordingError,
    SceneError,
)
from tactile_lab.scene.load import load
from tactile_lab.store.run import Run
from tactile_lab.studies.carry_out import StudyProgress, carry_out, forecast
from tactile_lab.studies.figures import plots
from tactile_lab.studies.live import look_at
from tactile_lab.studies.page import write_page
from tactile_lab.studies.points import Points, PointTask
from tactile_lab.studies.shelf import Batch
from tactile_lab.studies.study import load_study


def test_a_point_is_what_simulate_gives(tmp_path: Path) -> None:
    found = done(load_study(LEVELS), tmp_path)[0].to_xarray()
    R1 = float(found["sensor.R1"][3])
    changes = {"sensor.V_GS": 1.4, "sensor.R1": R1, **SHORT["set"]}
    alone = simulate("demo", changes, keep=("spikes",)).spike_times
    at = found.isel({"sensor.V_GS": 1, "draw": 3})
    assert int(at["spike_count"]) == len(alone) > 0
    assert float(at["first_spike"]) == alone[0]
    before = int(found["spike_times_size"].values.ravel()[: 5 + 3].sum())
    rows = found["spike_times"].values[before : before + len(alone)]
    assert np.array_equal(rows, alone)
    assert found["sensor.V_GS"].attrs["units"] == "V"


def test_what_is_known_is_not_computed_again(tmp_path: Path) -> None:
    first, told = done(load_study(LEVELS), tmp_path)
    assert told[-1].done == 15
    again, told = done(load_study(LEVELS), tmp_path)
    assert not told
    assert same(first, again)
    wider = {"key": "sensor.V_GS", "values": "1.36 V : 1.42 V : 20 mV"}
    more = {**LEVELS, "axis": [wider, LEVELS["axis"][1]]}
    _, told = done(load_study(more, "another"), tmp_path)
    assert (told[0].there, told[-1].done) == (15, 20)


def test_a_finished_study_is_not_written_again(tmp_path: Path) -> None:
    file = tmp_path / "one.toml"
    (tmp_path / "mine.py").write_text("def f(result):\n    return 1.0\n")
    file.write_text('scene = "demo"\n[keep]\none = "mine.py:f"\n')
    arguments = ["study", str(file), "--out", str(tmp_path), "--workers", "1"]
    written = tmp_path / "one" / "data.zarr" / ".zattrs", tmp_path / "one/report.html"

    def again() -> tuple[str, list[int]]:
        said = CliRunner().invoke(cli, arguments)
        assert said.exit_code == 0, said.output
        return said.stdout, [path.stat().st_mtime_ns for path in written]

    first, before = again()
    assert "Nothing to do" not in first
    second, after = again()
    assert second.startswith("Nothing to do: all points are known (1).\n")
    assert second.partition("\n")[2] == first and after == before
    study(file, out=tmp_path, workers=1)
    assert again()[1] == before
    (tmp_path / "mine.py").write_text("def f(result):\n    return 2.0\n")
    third, after = again()
    assert "Nothing to do" not in third and all(map(int.__lt__, before, after))
    written[1].unlink()
    assert "Nothing to do" not in again()[0]


def test_points_are_shared_whichever_key_varies(tmp_path: Path) -> None:
    one = {**SHORT, "axis": [{"key": "sensor.V_GS", "values": ["1.4 V", "1.41 V"]}]}
    other = {**SHORT, "axis": [{"key": "sensor.R1", "values": ["9.58 MOhm", "9 MOhm"]}]}
    done(load_study(one), tmp_path)
    assert done(load_study(other), tmp_path)[1][0].there == 1


def test_an_interrupted_study_goes_on(tmp_path: Path) -> None:
    asked = load_study(LEVELS)

    def stop(progress: StudyProgress) -> None:
        if progress.done >= 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        carry_out(asked, tmp_path, count=1, tell=stop)
    found, told = done(asked, tmp_path)
    assert told[0].there >= 3
    assert same(found, done(asked, tmp_path / "whole")[0])


def test_killed_in_the_midst_it_loses_no_finished_batch(tmp_path: Path) -> None:
    """SIGKILL of the client as a batch has just been told of."""
    script = textwrap.dedent(f"""
        import os, signal
        from pathlib import Path
        from tactile_lab.studies.carry_out import carry_out
        from tactile_lab.studies.study import load_study

        def tell(progress):
            if progress.done >= 4:
                os.kill(os.getpid(), signal.SIGKILL)

        carry_out(load_study({LEVELS!r}), Path({str(tmp_path)!r}), count=1, tell=tell)
    """)
    killed = subprocess.run([sys.executable, "-c", script], check=False)
    assert killed.returncode == -signal.SIGKILL
    found, told = done(load_study(LEVELS), tmp_path)
    assert told[0].there >= 4
    assert same(found, done(load_study(LEVELS), tmp_path / "whole")[0])


def test_a_damaged_batch_is_computed_again(tmp_path: Path) -> None:
    first, _ = done(load_study(LEVELS), tmp_path)
    files = (tmp_path / "points").glob("*.npz")
    file = max(files, key=lambda path: path.stat().st_size)
    file.write_bytes(file.read_bytes()[:100])
    again, told = done(load_study(LEVELS), tmp_path)
    assert told[0].there < 15
    assert same(first, again)


def test_a_point_that_is_refused_keeps_its_reason(tmp_path: Path) -> None:
    asked = {**SHORT, "axis": [{"key": "sensor.d", "values": ["1 mm", "9 mm"]}]}
    found, told = done(load_study(asked), tmp_path)
    assert told[-1].failed == 1
    assert found.reasons[0] == ""
    assert "must lie between 0 and L" in found.reasons[1]
    assert np.isnan(found.numbers()["spike_count"][1])
    assert found.numbers()["spike_count"][0] > 0


def test_expressions_and_functions_of_a_user(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("def last(result):\n    return result.end.V_C1\n")
    own = tmp_path / "own.toml"
    kept = (
        'scene = "demo"\n[keep]\nrest = "result.sample(\'V_C1\', np.array(0.0))"\n'
        'last = "mine.py:last"\n'
    )
    own.write_text(kept + 'wrong = "1 / 0"\n')
    found, _ = done(load_study(own), tmp_path)
    assert "wrong: ZeroDivisionError" in found.reasons[0]
    own.write_text(kept)
    found, _ = done(load_study(own), tmp_path)
    assert 3.5 < found.numbers()["rest"] < 5.0
    assert 3.5 < found.numbers()["last"] < 5.0


def test_an_expression_that_fails_at_a_point_takes_no_other_value_with_it(
    tmp_path: Path,
) -> None:
    """Solved with others, or alone; the one that fails is named."""
    levels = {"key": "protocol.levels", "values": [["20 mN"], ["200 mN"]]}
    for first in ("spikes[0]", "result.spike_times[0]"):
        keep = {"number": "len(spikes)", "first": first, "other": f"1e3 * {first}"}
        asked = load_study({**SHORT, "axis": [levels], "keep": keep})
        found, told = done(asked, tmp_path)
        assert told[-1].failed == found.failed == 1
        numbers = found.numbers()
        assert numbers["number"].tolist() == [0.0, numbers["number"][1]]
        assert np.isnan(numbers["first"]).tolist() == [True, False]
        assert found.reasons[0].startswith("first: IndexError")
        assert "; other: IndexError" in found.reasons[0] and not found.reasons[1]


def test_a_point_is_crossed_out_only_where_it_has_no_value(tmp_path: Path) -> None:
    V_GS = {"key": "sensor.V_GS", "values": "1.38 V : 1.40 V : 20 mV"}
    R1 = {"key": "sensor.R1", "values": ["9 MOhm", "10 MOhm"]}
    keep = {"number": "len(spikes)", "first": "spikes[0] if spikes.size else [][0]"}
    silent = {**SHORT["set"], "protocol.levels": ["20 mN"]}
    asked = {**SHORT, "set": silent, "axis": [V_GS, R1], "keep": keep}
    found, _ = done(load_study(asked), tmp_path)
    assert found.failed == 4
    for plot in plots(found):
        crosses = [
            sum(len(series.x) for series in panel.series if series.mark == "crosses")
            for panel in plot.panels
        ]
        assert crosses[0] == 0 < crosses[1], plot.name


def test_the_whole_bench_repeats_with_seeds(tmp_path: Path) -> None:
    asked = {
        **SHORT,
        "on": "simulated",
        "repeat": 2,
        "keep": {"count": "len(spikes)", "noise": "run.signal('V_C1')[:200].std()"},
    }
    found, _ = done(load_study(asked), tmp_path)
    numbers = found.numbers()
    assert found.failed == 0, found.reasons
    assert numbers["count"].shape == (2,) and np.all(numbers["count"] > 0)
    assert numbers["noise"][0] != numbers["noise"][1]


@pytest.mark.parametrize(
    ("recorded", "why"),
    [
        ({"record.sample_rate": "100 kS/s"}, "spikes are missed: one fits between"),
        ({"record.signals": ["V_C1", "force"]}, "spikes were not looked for"),
    ],
)
def test_spikes_that_are_no_count_are_not_kept_as_one(
    tmp_path: Path, recorded: dict[str, Any], why: str
) -> None:
    """5 of 16 were kept and drawn, of runs that refuse their own rates."""
    asked = {
        **SHORT,
        "on": "simulated",
        "set": {**SHORT["set"], **recorded},
        "keep": {"count": "len(spikes)", "rest": "run.signal('V_C1')[:200].mean()"},
    }
    found, _ = done(load_study(asked), tmp_path)
    numbers = found.numbers()
    assert np.isnan(numbers["count"]).all() and np.isfinite(numbers["rest"]).all()
    assert all(f"count: {why}" in reason for reason in found.reasons)


def test_a_fitted_number_of_the_answer_is_kept_by_its_value(tmp_path: Path) -> None:
    asked = {
        "scene": "hold_10s",
        "set": {"protocol.hold": "2 s", "protocol.rest": "0.2 s"},
        "on": "simulated",
        "keep": {"tau": "answer['tau_s']", "least": "answer['tau_s']['low_95']"},
        "axis": [{"key": "protocol.level", "values": ["180 mN"]}],
    }
    found, _ = done(load_study(asked), tmp_path)
    assert found.failed == 0, found.reasons
    numbers = found.numbers()
    assert 0 < numbers["least"] < numbers["tau"] == pytest.approx(8.69, rel=0.05)


def test_the_run_of_a_point_is_kept_and_found_again(tmp_path: Path) -> None:
    axis = {"key": "sensor.V_GS", "values": ["1.4 V", "1.41 V"]}
    asked = {**SHORT, "on": "simulated", "keep": ["spike_count"], "axis": [axis]}
    plain = load_study({**asked, "seed": 2}, "plain")
    kept = load_study({**asked, "runs": True}, "kept")
    for one in (plain, kept):
        found, _ = done(one, tmp_path, count=2)
        write_page(found, tmp_path / one.name)
    page = (tmp_path / "kept" / "report.html").read_text(encoding="utf-8")
    assert "Simulated bench" in page and "response to sensor.V_GS" in page
    seen, none = look_at(tmp_path / "kept"), look_at(tmp_path / "plain")
    for number, count in enumerate(found.numbers()["spike_count"]):
        folder = seen.run_of(number)
        assert folder is not None and none.run_of(number) is None
        with Run.load(folder) as run:
            assert len(run.spikes) == count
            again = load(none.scene_of(number))
            assert again.circuit == run.scene.circuit
            assert again.simulated.seed == 2 * run.scene.simulated.seed
    with pytest.raises(SceneError, match="runs = true"):
        done(kept, tmp_path / "other", count=None, scheduler="tcp://127.0.0.1:9")


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "points").write_text("in the way")
    with pytest.raises(RecordingError, match="cannot be written"):
        done(load_study(SHORT), tmp_path)
    (tmp_path / "points").unlink()
    found, _ = done(load_study(SHORT), tmp_path)
    (tmp_path / "study" / "report.html").mkdir()
    with pytest.raises(RecordingError, match="All points are kept"):
        write_page(found, tmp_path / "study")
    (tmp_path / "other").write_text("in the way")
    with pytest.raises(RecordingError, match="other cannot be written"):
        done(load_study(SHORT, "other"), tmp_path)


def test_two_at_once_are_told_of_each_other(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("tactile_lab.studies.carry_out.PATIENCE", 0.01)
    asked, told = load_study(SHORT), []

    def tell(progress: StudyProgress) -> None:
        with pytest.raises(RecordingError, match="Another process carries out"):
            carry_out(asked, tmp_path, count=1)
        told.append(progress)

    found = carry_out(asked, tmp_path, count=1, tell=tell)
    assert told and same(found, done(asked, tmp_path)[0])


def test_the_forecast_opens_nothing_and_keeps_nothing(tmp_path: Path) -> None:
    cost = forecast(load_study(LEVELS), tmp_path)
    assert (cost.points, cost.there) == (15, 0)
    assert cost.seconds is not None and cost.seconds > 0
    assert not list(tmp_path.iterdir())
    cost = forecast(load_study({**LEVELS, "keep": {"a": "1 / 0"}}), tmp_path)
    assert cost.seconds is None, "the time of what fails tells nothing"
    assert "ZeroDivisionError" in cost.reason


def test_the_forecast_is_of_all_points_and_not_of_the_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Points are solved many at once, and those with more spikes take longer."""
    axis = {"key": "protocol.hold", "values": "100 ms : 4 s : 10 ms"}
    asked, clock = load_study({**SHORT, "axis": [axis]}), [0.0]

    def batch(points: Points, task: PointTask) -> Batch:
        held = np.asarray(task.columns[0], dtype=float)
        clock[0] += 1e-3 + 1e-3 * float(held.sum())
        return Batch(task.addresses, {}, {})

    monkeypatch.setattr(Points, "batch", batch)
    monkeypatch.setattr(time, "perf_counter", lambda: clock[0])
    seconds = forecast(asked, tmp_path).seconds
    assert seconds == pytest.approx(2.05e-3, rel=0.1)


def test_a_script_gets_one_labelled_data_set(tmp_path: Path) -> None:
    import xarray

    found = study(LEVELS, out=tmp_path, workers=1)
    kept = xarray.open_zarr(tmp_path / "study" / "data.zarr", consolidated=False)
    assert kept.load().equals(found)
