"""Who computes the points: this process, a pool of processes, or a Dask cluster."""

from __future__ import annotations

import os
import pickle
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from multiprocessing import parent_process
from multiprocessing.connection import wait as wait_for
from threading import Thread
from typing import Any, Protocol

from tactile_lab.errors import LinkLostError, NotFoundError, SceneError
from tactile_lab.studies.addresses import code_digests
from tactile_lab.studies.points import Points, Task
from tactile_lab.studies.shelf import Batch
from tactile_lab.studies.study import Study

AHEAD = 2
"""Batches that wait at each worker, so that none stands idle."""
ANSWER = 60.0
"""For which a Dask worker is waited for to tell its version, s."""
SCHEMES = ("tcp://", "inproc://", "tls://", "ucx://", "ws://", "wss://")
"""With which an address of a scheduler may begin."""
MOST_ENDED = 3
"""So often in a row workers may be ended from outside before a batch is finished."""


class Workers(Protocol):
    """Whoever computes batches."""

    count: int

    def batches(self, tasks: Iterable[Task]) -> Iterator[Batch]:
        """Each task's batch, in any order; tasks are taken as they are needed."""


class Alone:
    """This process, one point after another: what real instruments need.

    Args:
        points: computes them.
    """

    count = 1

    def __init__(self, points: Points) -> None:
        self._points = points

    def batches(self, tasks: Iterable[Task]) -> Iterator[Batch]:
        """In the order of the tasks."""
        return map(self._points.batch, tasks)


class Pool:
    """Processes of this machine, or the workers of a Dask cluster.

    Args:
        start: gives an executor that sends them work; called again where all of its
            workers are gone.
        study: what they compute.
        count: how many they are.
        lost: what an executor raises where its workers are gone for good.
    """

    def __init__(
        self,
        start: Callable[[], Executor],
        study: Study,
        count: int,
        lost: tuple[type[BaseException], ...] = (),
    ) -> None:
        self.count = count
        self._start = start
        self._study = pickle.dumps(_without_points(study))
        self._lost: tuple[type[BaseException], ...] = (
            BrokenExecutor,
            CancelledError,
            *lost,
        )

    def batches(self, tasks: Iterable[Task]) -> Iterator[Batch]:
        """As they are finished; a worker that is ended is replaced.

        Raises:
            LinkLostError: workers are gone, or end again and again.
        """
        coming, waiting = iter(tasks), deque[Task]()
        running: dict[Future[Batch], Task] = {}
        executor, ended = self._start(), 0
        try:
            while True:
                try:
                    while len(running) < self.count * AHEAD:
                        task = waiting.popleft() if waiting else next(coming, None)
                        if task is None:
                            break
                        waiting.appendleft(task)  # until it is sent
                        running[executor.submit(_on_worker, self._study, task)] = task
                        waiting.popleft()
                    if not running:
                        return
                    done, _ = wait(running, return_when=FIRST_COMPLETED)
                    for one in done:
                        batch = one.result()
                        del running[one]
                        ended = 0
                        yield batch
                except BrokenExecutor:
                    ended += 1
                    if ended > MOST_ENDED:
                        raise
                    executor.shutdown()
                    waiting.extend(running.values())
                    running.clear()
                    executor = self._start()
        except self._lost as reason:
            raise LinkLostError(
                "Workers were ended from outside (too little memory?), or their "
                "scheduler was. What was finished is kept; start the study again and "
                "it goes on."
            ) from reason
        finally:
            for one in running:
                one.cancel()
            executor.shutdown(wait=False)


def _without_points(study: Study) -> Study:
    """The study as a worker needs it: the values of its points come with each task."""
    axes = tuple(replace(axis, values=axis.values[:1]) for axis in study.design.axes)
    return replace(study, design=replace(study.design, axes=axes), source={})


@contextmanager
def workers(
    study: Study, points: Points, count: int | None, scheduler: str | None
) -> Iterator[Workers]:
    """Whoever computes this study.

    Args:
        study: which.
        points: computes them in this process.
        count: processes; as many as cores unless given.
        scheduler: address of a Dask scheduler; None for this machine.

    Raises:
        SceneError: real instruments cannot be shared; another version runs there.
        NotFoundError: the scheduler does not answer, or Dask is not installed.
    """
    if study.on == "bench":
        if scheduler is not None:
            raise SceneError(
                'on = "bench" plays one run after another on this machine\'s '
                "instruments; leave --scheduler out."
            )
        yield Alone(points)
    elif scheduler is not None:
        with _client(scheduler) as client:
            from distributed.scheduler import KilledWorker

            threads = sum(client.nthreads().values())
            yield Pool(client.get_executor, study, threads, (KilledWorker, OSError))
    elif count == 1:
        yield Alone(points)
    else:
        count = count or os.cpu_count() or 1
        yield Pool(lambda: _processes(count), study, count)


def _processes(count: int) -> Executor:
    return ProcessPoolExecutor(count, initializer=_end_with_parent)


def _end_with_parent() -> None:
    """Let this process end when the one that began it is killed."""
    parent = parent_process()
    if parent is not None:
        sentinel = parent.sentinel
        Thread(target=lambda: (wait_for([sentinel]), os._exit(1)), daemon=True).start()


@contextmanager
def _client(address: str) -> Iterator[Any]:
    try:
        import distributed
    except ImportError as reason:
        raise NotFoundError(
            "--scheduler needs Dask: pip install 'tactile-lab[cluster]'."
        ) from reason
    if not address.startswith(SCHEMES):
        raise NotFoundError(
            f"--scheduler {address}: write its address, such as tcp://HOST:8786."
        )
    try:
        open_client: Any = distributed.Client  # untyped
        client = open_client(address, timeout="5s", set_as_default=False)
    except (OSError, ValueError, TimeoutError) as reason:
        raise NotFoundError(
            f"The scheduler {address} does not answer: {reason}. Is `dask scheduler` "
            "running there, and the address of the form tcp://HOST:8786?"
        ) from reason
    try:
        _check_versions(client, address)
        yield client
    finally:
        client.close()


def _check_versions(client: Any, address: str) -> None:
    """Refuse workers that would compute something else."""
    if not client.nthreads():
        raise NotFoundError(f"The scheduler {address} has no workers; start some.")
    try:
        asked = {
            where: client.submit(code_digests, workers=[where], pure=False)
            for where in client.nthreads()
        }
        theirs = {where: one.result(timeout=ANSWER) for where, one in asked.items()}
    except OSError as reason:  # a timeout, too
        raise LinkLostError(
            f"The scheduler {address} or one of its workers went silent: {reason}. "
            "Nothing is lost; start the study again."
        ) from reason
    except ImportError as reason:
        raise SceneError(
            f"Workers of {address} lack this program ({reason}); install the same "
            "version on each."
        ) from reason
    ours = code_digests()
    for where, found in theirs.items():
        missing = [package for package in ours if package not in found]
        other = [p for p, digest in found.items() if ours.get(p, digest) != digest]
        if missing or other:
            what = (
                f"lacks {', '.join(missing)}"
                if missing
                else f"has another version of {', '.join(other)}"
            )
            raise SceneError(
                f"The worker {where} of {address} {what}; install the same version of "
                "this program on each."
            )


@lru_cache(maxsize=2)
def _points(study: bytes) -> Points:
    return Points(pickle.loads(study))


def _on_worker(study: bytes, task: Task) -> Batch:
    return _points(study).batch(task)
