"""Carry a study out: compute what is missing, keep it, gather the data set."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tactile_lab.errors import RecordingError
from tactile_lab.planning.plan import plan
from tactile_lab.store.folder import lock
from tactile_lab.studies.addresses import addresses
from tactile_lab.studies.dataset import KEPT, Gathered, gathered, is_written, write
from tactile_lab.studies.live import LOCK, LiveStudy
from tactile_lab.studies.points import RUNS, Points, PointTask
from tactile_lab.studies.shelf import Shelf
from tactile_lab.studies.study import Study
from tactile_lab.studies.workers import Finished, InProcess, Workers, workers
from tactile_lab.whole_file import failing_as

if TYPE_CHECKING:
    from tactile_lab.acquisition.ending import Executed
    from tactile_lab.engine.execution import Execution

LONG = 1.0
"""Seconds a batch should take: little to lose, enough to be worth sending."""
MOST = 100_000
"""Points of one batch."""
ENOUGH = 0.3
"""Seconds of points, solved at once, whose time tells what the others will take."""
BESIDES = 6.0
"""Time that start, data set and report of a study take besides its points, s (measured:
5.5 to 7 of a few points or 4608)."""
WORKER = 2.0
"""Time in which all workers load what simulates a bench, s (measured); what solves the
model they have from this process."""
SHELF = "points"
"""Folder of finished points, shared by all studies beside it."""
PATIENCE = 2.0
"""Longest wait for the workers of one that was killed to end, s."""


@dataclass(frozen=True)
class StudyProgress:
    """How far a study is.

    Attributes:
        done, total: points, those that were there already among the done.
        there: points that were computed before, by this study or another.
        failed: points refused or failed since it began.
        workers: how many compute.
    """

    done: int
    total: int
    there: int
    failed: int
    workers: int


@dataclass(frozen=True)
class Forecast:
    """What a study will cost, from points that were tried.

    Attributes:
        points: in all.
        there: computed before.
        seconds: a point takes one worker, s, on average over those that were tried;
            None where nothing is left to compute, or all of them failed.
        besides: start, workers, data set and report take, s.
        reason: why a tried point failed, if one did.
    """

    points: int
    there: int
    seconds: float | None
    besides: float
    reason: str = ""


def study_points(
    study: Study, out: Path, *play: Callable[[Execution], Executed]
) -> Points:
    """What computes the study's points in this process; `play` as of `Points`."""
    runs = out / study.name / RUNS if study.keeps_runs else None
    return Points(study, runs, *play)


def forecast(study: Study, out: Path) -> Forecast:
    """What carrying a study out under `out` will cost; tries some of its points.

    On real instruments nothing is tried: the plan of a run tells its time.
    """
    points, named = study_points(study, out), addresses(study)
    missing = _missing(study, named, Shelf(out / SHELF))
    size = study.design.size
    seconds, reason = None, ""
    if missing.size and study.on == "bench":
        seconds = plan(study.scene, preview=False).estimate.duration
    elif missing.size:
        seconds, reason = _tried(study, points, named, missing)
    besides = BESIDES + (WORKER if study.on == "simulated" else 0.0)
    return Forecast(size, size - missing.size, seconds, besides, reason)


def _tried(
    study: Study, points: Points, named: NDArray[np.void], missing: NDArray[np.intp]
) -> tuple[float | None, str]:
    """Seconds a point takes, of some that lie evenly among the missing, and a failure.

    The first one compiles. Then come twice as many each time, at once as the study has
    them, until they take long enough.
    """
    number, reason = 1, ""
    while True:
        even = ((np.arange(number) + 0.5) / number * missing.size).astype(np.intp)
        began = time.perf_counter()
        batch = points.batch(_task(study, named, missing[even]))
        took = time.perf_counter() - began
        reason = reason or next(iter(batch.reasons.values()), "")
        if number == missing.size or (number > 1 and took >= ENOUGH):
            return (took / number if len(batch.reasons) < number else None), reason
        number = min(2 * number, missing.size)


def carry_out(
    study: Study,
    out: Path,
    *,
    count: int | None = None,
    scheduler: str | None = None,
    tell: Callable[[StudyProgress], None] = lambda progress: None,
    play: Callable[[Execution], Executed] | None = None,
) -> Gathered:
    """Compute all points that are missing, and write the data set.

    It can be interrupted at any moment: what was finished is kept, and the next call
    goes on. The result does not depend on who computed what.

    Args:
        study: what to compute.
        out: holds the studies' folders and the finished points.
        count: processes; as many as cores unless given.
        scheduler: address of a Dask scheduler.
        tell: told of each finished batch.
        play: carries out a run on real instruments, such as one that minds signals.

    Raises:
        RecordingError: the folder cannot be written, or another process carries
            the study out.
        UnsafeError: a coil's state could not be verified: nothing goes on.
        KeyboardInterrupt: a run was stopped: nothing goes on.
        NotFoundError, SceneError: the scheduler cannot be used.
    """
    points = study_points(study, out, *(() if play is None else (play,)))
    with _alone(out / study.name):
        return _carried_out(study, points, out, count, scheduler, tell)


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Let nobody else carry out the study of this folder meanwhile."""
    with failing_as(f"{folder} cannot be written", "Name another folder."):
        folder.mkdir(parents=True, exist_ok=True)
        file = (folder / LOCK).open("w", encoding="utf-8")
    with file:
        late = time.monotonic() + PATIENCE
        while not lock(file):
            if time.monotonic() > late:
                raise RecordingError(
                    f"Another process carries out the study of {folder}. Wait for it, "
                    "or give this study another file name; finished points are shared."
                )
            time.sleep(PATIENCE / 20)
        yield


def _carried_out(
    study: Study,
    points: Points,
    out: Path,
    count: int | None,
    scheduler: str | None,
    tell: Callable[[StudyProgress], None],
) -> Gathered:
    shelf, named = Shelf(out / SHELF), addresses(study)
    missing = _missing(study, named, shelf)
    done, failed = study.design.size - missing.size, 0
    there = done
    if missing.size:
        live = LiveStudy(study, shelf, named, out / study.name)
        with live, workers(study, points, shelf, count, scheduler) as crew:
            pace = _Pace(crew.count)
            tell(StudyProgress(done, study.design.size, there, failed, crew.count))
            for one in _batches(study, missing, named, points, shelf, crew, pace):
                pace.tell(one.points)
                done, failed = done + one.points, failed + one.failed
                live.tell(done, failed)
                tell(StudyProgress(done, study.design.size, there, failed, crew.count))
    found = gathered(study, shelf, shelf.find(named))
    if missing.size or not is_written(study, out / study.name):
        with failing_as(
            f"The data set cannot be written into {out / study.name}", KEPT
        ):
            write(found, out / study.name)
    return found


def _batches(
    study: Study,
    missing: NDArray[np.intp],
    named: NDArray[np.void],
    points: Points,
    shelf: Shelf,
    crew: Workers,
    pace: _Pace,
) -> Iterator[Finished]:
    """All that is missing, as it is finished.

    The first point of a model is computed here, so that code is compiled once and
    processes that fork have it.
    """
    tasks = _tasks(study, missing, named, pace)
    if study.on == "model":
        yield from InProcess(points, shelf).batches(islice(tasks, 1))
    yield from crew.batches(tasks)


def _missing(study: Study, named: NDArray[np.void], shelf: Shelf) -> NDArray[np.intp]:
    """Numbers of the points to compute, in the order in which they are."""
    _, first = np.unique(named, return_index=True)  # two points may be one
    first = np.sort(first)
    missing: NDArray[np.intp] = first[shelf.find(named[first]).file < 0]
    if study.on != "bench":
        return missing
    order = _order(study)  # of all, so that it is the same after an interruption
    return order[np.isin(order, missing)]


def _order(study: Study) -> NDArray[np.intp]:
    """In which a bench plays the points; random ones are drawn from the seed."""
    design = study.design
    rng, points = np.random.default_rng(design.seed), np.arange(design.size)
    if study.order == "random":
        return rng.permutation(points)
    if study.order == "blocked":
        blocks = points.reshape(-1, design.repeat).T
        return np.concatenate([rng.permutation(block) for block in blocks])
    return points


def _tasks(
    study: Study,
    missing: NDArray[np.intp],
    named: NDArray[np.void],
    pace: _Pace,
) -> Iterator[PointTask]:
    at = 0
    while at < missing.size:
        numbers = missing[at : at + (1 if study.on == "bench" else pace.points())]
        at += numbers.size
        yield _task(study, named, numbers)


def _task(
    study: Study, named: NDArray[np.void], numbers: NDArray[np.intp]
) -> PointTask:
    design = study.design
    return PointTask(named[numbers], design.columns(numbers), design.repeats(numbers))


class _Pace:
    """How many points a batch should have, from the time the others took."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._began = 0.0
        self._done = 0

    def points(self) -> int:
        """Of the next batch; at first one, then at most twice what is done."""
        if not self._done:
            return 1
        each = (time.perf_counter() - self._began) * self._count / self._done
        return int(min(max(LONG / max(each, 1e-9), 1), 2 * self._done, MOST))

    def tell(self, points: int) -> None:
        """So many more are done; the first one compiled, and is not counted."""
        if not self._began:
            self._began = time.perf_counter()
        self._done += points
