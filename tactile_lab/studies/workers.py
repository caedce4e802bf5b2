"""Who computes the points: this process, a pool of processes, or a Dask cluster."""

from __future__ import annotations

import os
import pickle
from collections.abc import Iterable, Iterator, Mapping
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
from functools import lru_cache
from itertools import islice
from typing import Any, Protocol

from tactile_lab.errors import LinkLostError, NotFoundError, SceneError, UnsafeError
from tactile_lab.studies.points import Points, code_digest, why
from tactile_lab.studies.shelf import Batch
from tactile_lab.studies.study import Study

AHEAD = 2
"""Batches that wait at each worker, so that none stands idle."""
Task = tuple[list[bytes], list[tuple[Any, ...]], list[int]]
"""Addresses, values of the axes and repeats of some points."""


class Workers(Protocol):
    """Whoever computes batches."""

    count: int

    def batches(self, tasks: Iterable[Task]) -> Iterator[Batch]:
        """Each task's batch, in any order; tasks are taken as they are needed."""


def batch_of(points: Points, task: Task) -> Batch:
    """What is kept of the points of a task; one that fails keeps its reason."""
    addresses, values, repeats = task
    found: list[Mapping[str, Any] | None] = []
    reasons = []
    for value, repeat in zip(values, repeats, strict=True):
        try:
            found.append(points.compute(value, repeat))
            reasons.append("")
        except UnsafeError:
            raise  # the coil's state is not known: nothing goes on
        except Exception as error:  # whatever a user's protocol or function raises
            found.append(None)
            reasons.append(why(error) or type(error).__name__)
    return Batch(addresses, found, reasons)


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
        for task in tasks:
            yield batch_of(self._points, task)


class Pool:
    """Processes of this machine, or the workers of a Dask cluster.

    Args:
        executor: sends them work.
        study: what they compute.
        count: how many they are.
    """

    def __init__(self, executor: Executor, study: Study, count: int) -> None:
        self.count = count
        self._executor = executor
        self._study = pickle.dumps(study)

    def batches(self, tasks: Iterable[Task]) -> Iterator[Batch]:
        """As they are finished.

        Raises:
            LinkLostError: a worker is gone.
        """
        coming = iter(tasks)
        running = {self._send(task) for task in islice(coming, self.count * AHEAD)}
        try:
            while running:
                done, running = wait(running, return_when=FIRST_COMPLETED)
                for one in done:
                    yield one.result()
                    running |= {self._send(task) for task in islice(coming, 1)}
        except (BrokenExecutor, CancelledError) as reason:
            raise LinkLostError(
                "A worker was ended from outside (too little memory?). What was "
                "finished is kept; start the study again and it goes on."
            ) from reason
        finally:
            for one in running:
                one.cancel()

    def _send(self, task: Task) -> Future[Batch]:
        return self._executor.submit(_on_worker, self._study, task)


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
            threads = sum(client.nthreads().values())
            yield Pool(client.get_executor(), study, threads)
    elif count == 1:
        yield Alone(points)
    else:
        count = count or os.cpu_count() or 1
        with ProcessPoolExecutor(count) as executor:
            yield Pool(executor, study, count)


@contextmanager
def _client(address: str) -> Iterator[Any]:
    try:
        import distributed
    except ImportError as reason:
        raise NotFoundError(
            "--scheduler needs Dask: pip install 'tactile-lab[cluster]'."
        ) from reason
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
    theirs = client.run(code_digest)
    if not theirs:
        raise NotFoundError(f"The scheduler {address} has no workers; start some.")
    other = [where for where, digest in theirs.items() if digest != code_digest()]
    if other:
        raise SceneError(
            f"{len(other)} of {len(theirs)} workers of {address} run another version "
            f"of this program (the first is {other[0]}); install the same on each."
        )


@lru_cache(maxsize=2)
def _points(study: bytes) -> Points:
    return Points(pickle.loads(study))


def _on_worker(study: bytes, task: Task) -> Batch:
    return batch_of(_points(study), task)
