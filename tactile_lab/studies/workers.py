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
from multiprocessing import Pipe, parent_process
from multiprocessing.connection import Connection
from multiprocessing.connection import wait as wait_for
from pathlib import Path
from threading import Thread
from typing import NamedTuple, Protocol

from tactile_lab.engine.cluster import cluster
from tactile_lab.engine.process import BEHIND, take_place
from tactile_lab.errors import LinkLostError, SceneError
from tactile_lab.studies.points import Points, PointTask
from tactile_lab.studies.shelf import Batch, Shelf, put
from tactile_lab.studies.study import Study

AHEAD = 2
"""Batches that wait at each worker, so that none stands idle."""
MOST_ENDED = 3
"""So often in a row workers may be ended from outside before a batch is finished."""


class Finished(NamedTuple):
    """A batch that is on disk: how many points it has, how many of them failed."""

    points: int
    failed: int


class Stored(NamedTuple):
    """What a worker of this machine answers: its batch's file, how many failed.

    Short, so that a pipe takes it whole or not at all: one who is killed within a long
    answer leaves half of it there, and the rest is waited for without end.
    """

    path: Path
    failed: int


class Workers(Protocol):
    """Whoever computes batches."""

    count: int

    def batches(self, tasks: Iterable[PointTask]) -> Iterator[Finished]:
        """Each task's batch once it is on the shelf, in any order.

        Tasks are taken as they are needed.
        """


class InProcess:
    """This process, one point after another: what real instruments need."""

    count = 1

    def __init__(self, points: Points, shelf: Shelf) -> None:
        self._points, self._shelf = points, shelf

    def batches(self, tasks: Iterable[PointTask]) -> Iterator[Finished]:
        """In the order of the tasks."""
        for task in tasks:
            yield _shelved(self._points.batch(task), task, self._shelf)


class Pool:
    """Processes of this machine, or the workers of a Dask cluster.

    Args:
        start: gives an executor that sends them work; called again where all of its
            workers are gone.
        study: what they compute.
        runs: where they keep runs; None to keep none.
        shelf: where the batches are put.
        count: how many they are.
        lost: what an executor raises where its workers are gone for good.
        local: whether they write into the shelf's folder themselves.
    """

    def __init__(
        self,
        start: Callable[[], Executor],
        study: Study,
        runs: Path | None,
        shelf: Shelf,
        count: int,
        lost: tuple[type[BaseException], ...] = (),
        *,
        local: bool = True,
    ) -> None:
        self.count = count
        self._start = start
        self._shelf, self._into = shelf, shelf.folder if local else None
        self._study = pickle.dumps((_without_points(study), runs))
        self._lost: tuple[type[BaseException], ...] = (
            BrokenExecutor,
            CancelledError,
            *lost,
        )

    def batches(self, tasks: Iterable[PointTask]) -> Iterator[Finished]:
        """As they are finished; a worker that is ended is replaced.

        Raises:
            LinkLostError: workers are gone, or end again and again.
        """
        coming, waiting = iter(tasks), deque[PointTask]()
        running: dict[Future[Batch | Stored], PointTask] = {}
        executor, ended = self._start(), 0
        try:
            while True:
                try:
                    while len(running) < self.count * AHEAD:
                        task = waiting.popleft() if waiting else next(coming, None)
                        if task is None:
                            break
                        waiting.appendleft(task)  # until it is sent
                        sent = executor.submit(
                            _on_worker, self._study, task, self._into
                        )
                        running[sent] = waiting.popleft()
                    if not running:
                        return
                    done, _ = wait(running, return_when=FIRST_COMPLETED)
                    for one in done:
                        found = one.result()
                        ended = 0
                        yield _shelved(found, running.pop(one), self._shelf)
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


def _shelved(found: Batch | Stored, task: PointTask, shelf: Shelf) -> Finished:
    """The points of a task are on the shelf when this returns."""
    if isinstance(found, Batch):
        found = Stored(put(found, shelf.folder), len(found.reasons))
    shelf.add(found.path, task.addresses)
    return Finished(task.addresses.size, found.failed)


def _without_points(study: Study) -> Study:
    """The study as a worker needs it: the values of its points come with each task."""
    axes = tuple(replace(axis, values=axis.values[:1]) for axis in study.design.axes)
    return replace(study, design=replace(study.design, axes=axes), source={})


@contextmanager
def workers(
    study: Study,
    points: Points,
    shelf: Shelf,
    count: int | None,
    scheduler: str | None,
) -> Iterator[Workers]:
    """Whoever computes this study.

    Args:
        study: which.
        points: computes them in this process.
        shelf: where they are put.
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
        yield InProcess(points, shelf)
    elif scheduler is not None:
        if study.keeps_runs:
            raise SceneError(
                "runs = true keeps each run on this machine; leave it out, or "
                "--scheduler."
            )
        with cluster(scheduler) as client:
            from distributed.scheduler import KilledWorker

            threads = sum(client.nthreads().values())
            lost = (KilledWorker, OSError)
            yield Pool(
                client.get_executor, study, None, shelf, threads, lost, local=False
            )
    elif count == 1:
        yield InProcess(points, shelf)
    else:
        count = count or os.cpu_count() or 1
        yield Pool(lambda: _Processes(count), study, points.runs, shelf, count)


class _Processes(ProcessPoolExecutor):
    """Processes of this machine, which end when it is shut down or killed.

    A shut-down executor tells its workers through a queue, the lock of which one that
    was killed may have held: the others would wait for it without end. So they are told
    beside it.
    """

    def __init__(self, count: int) -> None:
        told, self._tell = Pipe(duplex=False)
        super().__init__(count, initializer=_end_when, initargs=(told,))

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers, whatever they are at."""
        self._tell.send_bytes(b"end")  # nobody takes it out: all of them see it
        super().shutdown(wait, cancel_futures=cancel_futures)


def _end_when(told: Connection) -> None:
    """Let this process end when it is told to, or the one that began it is killed.

    Whatever holds instruments on this computer comes before it.
    """
    take_place(BEHIND)
    parent = parent_process()
    if parent is not None:
        ends: list[Connection | int] = [told, parent.sentinel]
        Thread(target=lambda: (wait_for(ends), os._exit(1)), daemon=True).start()


@lru_cache(maxsize=2)
def _points(study: bytes) -> Points:
    return Points(*pickle.loads(study))


def _on_worker(study: bytes, task: PointTask, into: Path | None) -> Batch | Stored:
    """The batch of a task, or its file where there is a folder to put it into."""
    batch = _points(study).batch(task)
    return Stored(put(batch, into), len(batch.reasons)) if into else batch
