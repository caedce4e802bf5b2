"""A study on disk: the same whoever computes it, and never twice."""

import multiprocessing
import multiprocessing.connection
import os
import signal
import socket
import subprocess
import sys
import textwrap
from concurrent.futures import Future
from pathlib import Path

import cloudpickle
import numpy as np
import pytest
from click.testing import CliRunner
from distributed.protocol import pickle

from tactile_lab import simulate, study
from tactile_lab.cli import cli
from tactile_lab.engine import cluster
from tactile_lab.engine.cluster import _check_versions, code_digests
from tactile_lab.errors import (
    LinkLostError,
    NotFoundError,
    RecordingError,
    SceneError,
)
from tactile_lab.scene.load import load
from tactile_lab.store.run import Run
from tactile_lab.studies.carry_out import Progress, carry_out, forecast
from tactile_lab.studies.dataset import Gathered
from tactile_lab.studies.live import look_at
from tactile_lab.studies.page import write_page
from tactile_lab.studies.study import Study, load_study

SHORT = {
    "scene": "demo",
    "set": {
        "protocol.levels": ["200 mN"],
        "protocol.hold": "300 ms",
        "protocol.rest": "50 ms",
    },
    "keep": ["spike_count", "first_spike", "spike_times", "critical_force"],
}
LEVELS = {
    **SHORT,
    "axis": [
        {"key": "sensor.V_GS", "values": "1.38 V : 1.42 V : 20 mV"},
        {"key": "sensor.R1", "normal": "1 %"},
    ],
    "draw": {"points": 5},
}


def done(asked: Study, out: Path, **how) -> tuple[Gathered, list[Progress]]:
    told: list[Progress] = []
    return carry_out(asked, out, tell=told.append, **{"count": 1, **how}), told


def same(one: Gathered, other: Gathered) -> bool:
    return one.to_xarray().identical(other.to_xarray())


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


def test_workers_and_batches_change_nothing(tmp_path: Path) -> None:
    asked = load_study(LEVELS)
    alone, _ = done(asked, tmp_path / "alone")
    pool, told = done(asked, tmp_path / "pool", count=2)
    assert same(alone, pool)
    assert told[-1].workers == 2


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

    def stop(progress: Progress) -> None:
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


def test_the_run_of_a_point_is_kept_and_found_again(tmp_path: Path) -> None:
    axis = {"key": "sensor.V_GS", "values": ["1.4 V", "1.41 V"]}
    asked = {**SHORT, "on": "simulated", "keep": ["spike_count"], "axis": [axis]}
    plain = load_study({**asked, "seed": 2}, "plain")
    kept = load_study({**asked, "runs": True}, "kept")
    for one in (plain, kept):
        found, _ = done(one, tmp_path, count=2)
        write_page(found, tmp_path / one.name)
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


TIMES = {"spike_times": {"most": 1}}
ZIPPED = {"key": "sensor.R1", "normal": "1 %", "zip": "a"}
VAST = {"key": "sensor.R1", "values": "1 MOhm : 2 MOhm : 1 mOhm"}
LARGE = {"key": "sensor.R1", "values": "1 MOhm : 2 MOhm : 100 Ohm"}
LARGER = {"key": "sensor.R2", "values": "1 MOhm : 2 MOhm : 100 Ohm"}
BOTH = {"key": "sensor.R1", "values": ["1 MOhm"], "normal": "1 %"}


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"axis": [{"key": "sensor.R11", "values": [1]}]}, 'did you mean "R1"'),
        ({"axis": [{"key": "sensor.R1"}]}, "no values"),
        ({"axis": [BOTH]}, "values and normal"),
        ({"keep": ["spike_cuont"]}, 'did you mean "spike_count"'),
        ({"keep": {"a": "len("}}, "no Python expression"),
        ({"keep": {"a": "no.py:f"}}, "cannot be read"),
        ({"keep": []}, "keeps nothing"),
        ({"keep": {"a": "len(spiks)"}}, 'did you mean "spikes"'),
        ({"keep": {"a": "run.duration"}}, 'there is no run; With on = "model"'),
        (
            {"keep": ["spike_times"], "require": {"spike_times": {"most": 1}}},
            "is a row",
        ),
        ({"require": {"first_spike": {"most": "1 N"}}}, "s is needed"),
        ({"require": {"spike_count": {"least": 3, "most": 2}}}, "lies above most"),
        ({"require": {"spike_count": {}}}, "asks for nothing"),
        ({"repeat": 2}, "the model gives the same"),
        ({"runs": True}, "makes no runs"),
        ({"on": "bench"}, "needs real instruments"),
        ({"require": {"spikes": {"least": 1}}}, "nothing of that name is kept"),
        ({"draw": {"points": 4}}, "draws no axis"),
        ({"axes": []}, 'did you mean "axis"'),
        ({"scene": "dmeo"}, 'did you mean "demo"'),
        ({"axis": [ZIPPED]}, "is drawn and cannot go"),
        ({"axis": [VAST]}, r"larger steps"),
        (
            {"axis": [LARGE, LARGER]},
            r"10001 × 10001 = 1e\+08 points.* GB.* h of a core",
        ),
    ],
)
def test_what_cannot_be_used_is_refused(change: dict, told: str) -> None:
    with pytest.raises(SceneError, match=told):
        load_study({**SHORT, **change})


def test_a_study_that_is_not_there_is_named_with_those_that_are() -> None:
    with pytest.raises(SceneError, match=r'did you mean "spread"\? Studies that ship'):
        load_study("spraed")


def test_a_scheduler_that_does_not_answer_is_named(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match=r"tcp://127\.0\.0\.1:9 does not answer"):
        done(load_study(LEVELS), tmp_path, count=None, scheduler="tcp://127.0.0.1:9")


def test_a_port_that_takes_a_client_and_is_silent_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Dask's client waits for it without end."""
    monkeypatch.setattr(cluster, "GREETING", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        with pytest.raises(NotFoundError, match=r"silent for 0\.2 s"):
            done(load_study(LEVELS), tmp_path, count=None, scheduler=address)


def test_a_worker_without_this_program_understands_what_it_is_asked(
    tmp_path: Path,
) -> None:
    """One that did not was waited for for a minute."""
    sent = pickle.dumps(cluster._question())
    libraries = str(Path(cloudpickle.__file__).parents[1])
    answer = (
        f"import sys, pickle; sys.path.append({libraries!r}); "
        f"print(pickle.loads({sent!r})())"
    )
    told = subprocess.run(
        [sys.executable, "-S", "-c", answer],
        cwd=tmp_path, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert told.stdout == "None\n"
    ours = pickle.loads(sent)()
    assert ours == OURS


class Cluster:
    """A scheduler whose workers answer so when they are asked for their version."""

    def __init__(self, answers: dict) -> None:
        self.answers = answers

    def nthreads(self) -> dict[str, int]:
        return dict.fromkeys(self.answers, 1)

    def submit(self, function, *, workers: list[str], pure: bool) -> Future:
        answer: Future = Future()
        told = self.answers[workers[0]]
        if isinstance(told, Exception):
            answer.set_exception(told)
        else:
            answer.set_result(told)
        return answer


OURS = code_digests()


@pytest.mark.parametrize(
    ("answers", "error", "told"),
    [
        ({}, NotFoundError, "has no workers"),
        (
            {"a": OURS, "b": {**OURS, "drivers": "0"}},
            SceneError,
            "worker b of .* has another version of drivers",
        ),
        (
            {"a": {n: d for n, d in OURS.items() if n != "drivers"}},
            SceneError,
            "worker a of .* lacks drivers",
        ),
        ({"a": None}, SceneError, "worker a of .* lacks this program"),
        ({"a": TimeoutError("timed out")}, LinkLostError, "went silent"),
    ],
)
def test_workers_that_would_compute_something_else_are_refused(
    answers: dict, error: type[Exception], told: str
) -> None:
    with pytest.raises(error, match=told):
        _check_versions(Cluster(answers), "tcp://there:8786")


def test_an_address_without_a_scheme_is_refused_at_once(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match="such as tcp://HOST:8786"):
        done(load_study(LEVELS), tmp_path, count=None, scheduler="there:8786")
    with pytest.raises(NotFoundError, match="such as tcp://HOST:8786"):
        done(load_study(LEVELS), tmp_path, count=None, scheduler="http://there:8786")
    with pytest.raises(NotFoundError, match="does not answer: Port"):
        done(load_study(LEVELS), tmp_path, count=None, scheduler="tcp://there:port")


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

    def tell(progress: Progress) -> None:
        with pytest.raises(RecordingError, match="Another process carries out"):
            carry_out(asked, tmp_path, count=1)
        told.append(progress)

    found = carry_out(asked, tmp_path, count=1, tell=tell)
    assert told and same(found, done(asked, tmp_path)[0])


def test_a_worker_that_is_killed_is_replaced(tmp_path: Path) -> None:
    """SIGKILL of one worker in the midst: the study goes on by itself."""
    asked = load_study({**LEVELS, "keep": {"n": "result.spike_times.size"}})
    hit = []

    def tell(progress: Progress) -> None:
        if not hit and progress.done > 1:
            hit.append(multiprocessing.active_children()[0].pid)
            os.kill(hit[0], signal.SIGKILL)

    found = carry_out(asked, tmp_path, count=2, tell=tell)
    assert hit and same(found, done(asked, tmp_path / "alone")[0])


def test_workers_answer_so_briefly_that_no_kill_leaves_half_an_answer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The client would wait for the rest of it without end.

    What a pipe takes at once it has whole or not at all.
    """
    send, most = multiprocessing.connection.Connection._send, 512  # by POSIX
    (tmp_path / "answers").touch()

    def watched(self, message, *how) -> None:
        if multiprocessing.parent_process() is not None:
            with (tmp_path / "answers").open("a") as told:
                told.write(f"{len(message)}\n")
        send(self, message, *how)

    monkeypatch.setattr(multiprocessing.connection.Connection, "_send", watched)
    asked = load_study({**LEVELS, "draw": {"points": 100}})
    pool, _ = done(asked, tmp_path, count=2)
    sizes = [int(line) for line in (tmp_path / "answers").read_text().split()]
    assert sizes and max(sizes) <= most
    assert pool.failed == 0


def test_a_dask_cluster_gives_the_same(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        address = cluster.scheduler_address
        found, _ = done(load_study(LEVELS), tmp_path, count=None, scheduler=address)
    assert same(found, done(load_study(LEVELS), tmp_path / "alone")[0])


def test_the_forecast_opens_nothing_and_keeps_nothing(tmp_path: Path) -> None:
    cost = forecast(load_study(LEVELS), tmp_path)
    assert (cost.points, cost.there) == (15, 0)
    assert cost.seconds is not None and cost.seconds > 0
    assert not list(tmp_path.iterdir())
    cost = forecast(load_study({**LEVELS, "keep": {"a": "1 / 0"}}), tmp_path)
    assert cost.seconds is None, "the time of what fails tells nothing"
    assert "ZeroDivisionError" in cost.reason


def test_a_script_gets_one_labelled_data_set(tmp_path: Path) -> None:
    import xarray

    found = study(LEVELS, out=tmp_path, workers=1)
    kept = xarray.open_zarr(tmp_path / "study" / "data.zarr", consolidated=False)
    assert kept.load().equals(found)
