"""A study is the same whoever computes it: processes, or a cluster."""

import multiprocessing
import multiprocessing.connection
import os
import signal
import socket
import subprocess
import sys
import time
from concurrent.futures import Future
from pathlib import Path

import cloudpickle
import pytest
from distributed.protocol import pickle
from short_studies import LEVELS, done, same

from tactile_lab.engine import cluster
from tactile_lab.engine.cluster import _check_versions, code_digests
from tactile_lab.engine.process import BEHIND
from tactile_lab.errors import LinkLostError, NotFoundError, SceneError
from tactile_lab.studies.carry_out import StudyProgress, carry_out
from tactile_lab.studies.study import load_study


def test_workers_and_batches_change_nothing(tmp_path: Path) -> None:
    asked = load_study(LEVELS)
    alone, _ = done(asked, tmp_path / "alone")
    pool, told = done(asked, tmp_path / "pool", count=2)
    assert same(alone, pool)
    assert told[-1].workers == 2


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


def test_a_worker_that_is_killed_is_replaced(tmp_path: Path) -> None:
    """SIGKILL of one worker in the midst: the study goes on by itself.

    Workers leave the processor to whoever runs a bench here.
    """
    asked = load_study({**LEVELS, "keep": {"n": "result.spike_times.size"}})
    hit, behind = [], []

    def tell(progress: StudyProgress) -> None:
        if not hit and progress.done > 1:
            hit.append(multiprocessing.active_children()[0].pid)
            behind.append(os.getpriority(os.PRIO_PROCESS, hit[0]))
            os.kill(hit[0], signal.SIGKILL)

    found = carry_out(asked, tmp_path, count=2, tell=tell)
    assert behind == [BEHIND]
    assert hit and same(found, done(asked, tmp_path / "alone")[0])


@pytest.mark.parametrize("killed", [0, 1])
def test_the_last_worker_ends_though_another_was_killed_as_it_waited(
    tmp_path: Path, killed: int
) -> None:
    """One of the two holds the lock of the queue through which both are told to end."""
    asked = load_study({**LEVELS, "draw": {"points": 100}})
    others, workers = multiprocessing.active_children(), []

    def tell(progress: StudyProgress) -> None:
        if progress.done == progress.total:
            now = multiprocessing.active_children()
            workers.extend(one for one in now if one not in others)
            for worker in workers:
                os.kill(worker.pid, signal.SIGSTOP)
                # till it has stopped, or ended before; who ended is left to `join`
                state = os.WSTOPPED | os.WEXITED | os.WNOWAIT
                os.waitid(os.P_PID, worker.pid, state)

    carry_out(asked, tmp_path, count=2, tell=tell)
    gone, left = workers[killed], workers[1 - killed]
    gone.kill()
    os.kill(left.pid, signal.SIGCONT)
    late = time.monotonic() + 30
    # not `join`: the pool's thread joins it, too, and who comes second is told nothing
    while left.is_alive() and time.monotonic() < late:
        time.sleep(0.01)
    ended = not left.is_alive()
    left.kill()
    assert ended


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
