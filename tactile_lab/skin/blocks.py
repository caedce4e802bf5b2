"""Who solves the taxels of an array: threads of this process, or a Dask cluster."""

from __future__ import annotations

import os
import pickle
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.engine.cluster import cluster
from tactile_lab.errors import LinkLostError, TactileLabError
from tactile_lab.model.batch import Records, certain, records
from tactile_lab.model.solver import MOST_COUPLED, MOST_SPIKES
from tactile_lab.model.specimen import parts
from tactile_lab.quantity import show
from tactile_lab.skin import kernel
from tactile_lab.skin.forces import Loads
from tactile_lab.skin.single import simulate_taxel
from tactile_lab.skin.skin import Skin

BLOCK, SENT = 64, 512
"""Taxels solved in one go; those sent to a worker of a cluster."""
AHEAD = 4
"""Blocks for each core that may be under way."""


class SolvedBlock(NamedTuple):
    """What became of a block.

    Attributes:
        role: of each taxel, as `kernel` numbers it.
        spikes: their number.
        pieces: straight ones of its force.
        force: the largest, N; NaN for those left out without computing it.
        error: largest estimated error of a spike time, s.
        times: all spikes, s, taxel after taxel.
    """

    role: NDArray[np.uint8]
    spikes: NDArray[np.int64]
    pieces: NDArray[np.int64]
    force: FloatArray
    error: FloatArray
    times: FloatArray


def solve_block(
    loads: Loads, part: slice, role: NDArray[np.uint8], span: FloatArray,
    framed: FloatArray | None = None,
) -> SolvedBlock:  # fmt: skip
    """Solve those of a block that are not left out yet.

    Args:
        loads: on the skin.
        part: numbers of the taxels.
        role: of each.
        span: what the range of the force on each stays below, N; infinite if unknown.
        framed: forces from frames on those not left out, N; the loads know them unless
            given.
    """
    skin = loads.skin
    role = role.copy()
    asked = np.flatnonzero(role != kernel.UNTOUCHED)
    count, pieces = np.zeros(role.size, np.int64), np.zeros(role.size, np.int64)
    force, error = np.full(role.size, np.nan), np.zeros(role.size)
    if not asked.size:
        return SolvedBlock(role, count, pieces, force, error, np.empty(0))
    taxels = part.start + asked
    first = skin.first_specimen
    many = (
        records(skin.circuit, parts(skin.circuit, first + taxels))
        if first
        else np.repeat(records(skin.circuit, {}), taxels.size)
    )
    for taxel in taxels[~certain(skin.circuit, many, None)]:
        with _saying(f"Taxel {taxel}"):
            skin.circuit_of(int(taxel))
    became = role[asked]
    if framed is None:
        framed = loads.framed(taxels)
    count[asked], pieces[asked], force[asked], error[asked], times = solved(
        skin, loads, many, skin.array.places[taxels], framed, became, span[asked]
    )
    role[asked] = became
    return SolvedBlock(role, count, pieces, force, error, times)


def solved(
    skin: Skin, loads: Loads, many: Records, places: FloatArray, framed: FloatArray,
    role: NDArray[np.uint8], span: FloatArray,
) -> Any:  # fmt: skip
    """Numbers of spikes and pieces, forces, errors, spikes of circuits at places, m.

    Fills `role` in.
    """
    saturates = skin.circuit.saturation
    run = kernel.run_saturating if saturates else kernel.run
    return run(
        many, skin.circuit.t1 == "direct", role, skin.array.stuck_rate, places,
        loads.pressing, framed, span, skin.force_error, skin.duration, skin.tolerance,
        MOST_COUPLED if saturates else MOST_SPIKES,
    )  # fmt: skip


def solved_blocks(
    loads: Loads,
    role: NDArray[np.uint8],
    span: FloatArray,
    cores: int | None,
    scheduler: str | None,
) -> Iterator[tuple[slice, SolvedBlock]]:
    """All taxels of a skin, block by block in the order of their numbers.

    Args:
        loads: on the skin.
        role: of each taxel.
        span: see `solve_block`.
        cores: threads; as many as cores unless given.
        scheduler: address of a Dask scheduler; None for this process.

    Raises:
        SolverError: a taxel cannot be solved to the tolerance.
        LinkLostError: the workers of the scheduler are gone.
    """
    waiting: deque[tuple[slice, Future[SolvedBlock]]] = deque()
    left_out = role == kernel.UNTOUCHED
    with _workers(loads, cores, scheduler) as workers:
        blocks = _parts(left_out, workers.block)
        try:
            while blocks or waiting:
                while blocks and len(waiting) < AHEAD * workers.threads:
                    part = blocks.popleft()
                    asked = (part, role[part], span[part])
                    if left_out[part].all():  # not worth sending
                        future: Future[SolvedBlock] = Future()
                        future.set_result(solve_block(loads, *asked))
                    else:
                        future = workers.submit(*asked)
                    waiting.append((part, future))
                part, future = waiting.popleft()
                found = future.result()
                refused = np.flatnonzero(found.role == kernel.REFUSED)
                if refused.size:
                    taxel = part.start + int(refused[0])
                    most = show(float(found.force[refused[0]]), "N")
                    with _saying(f"Taxel {taxel}, pressed with up to {most}"):
                        simulate_taxel(loads.skin, taxel)
                yield part, found
        finally:
            for _, other in waiting:
                other.cancel()


def _parts(left_out: NDArray[np.bool_], block: int) -> deque[slice]:
    """So many taxels each; those that are left out altogether in one go."""
    found: deque[slice] = deque()
    silent = False
    for start in range(0, left_out.size, block):
        part = slice(start, min(start + block, left_out.size))
        before, silent = silent, bool(left_out[part].all())
        if before and silent:
            part = slice(found.pop().start, part.stop)
        found.append(part)
    return found


class _Workers(NamedTuple):
    """Whom blocks are submitted to, how many they are, and taxels of a block."""

    submit: Callable[..., Future[SolvedBlock]]
    threads: int
    block: int


@contextmanager
def _workers(
    loads: Loads, cores: int | None, scheduler: str | None
) -> Iterator[_Workers]:
    if scheduler is None:
        count = cores or os.cpu_count() or 1
        with ThreadPoolExecutor(count) as pool:
            solve = partial(solve_block, loads)
            yield _Workers(partial(pool.submit, solve), count, BLOCK)
        return
    with cluster(scheduler) as client:
        from distributed.scheduler import KilledWorker

        executor: Any = client.get_executor()  # untyped
        skin = loads.skin
        given = pickle.dumps(loads)

        def submit(part: slice, role: NDArray[np.uint8], span: FloatArray) -> Any:
            framed = None
            if skin.frames:
                asked = part.start + np.flatnonzero(role != kernel.UNTOUCHED)
                framed = loads.framed(asked)
            return executor.submit(_on_worker, given, part, role, span, framed)

        try:
            yield _Workers(submit, sum(client.nthreads().values()), SENT)
        except (KilledWorker, CancelledError, OSError) as reason:
            raise LinkLostError(
                "Workers were ended from outside (too little memory?), or their "
                "scheduler was. Nothing was written; start again."
            ) from reason


@lru_cache(maxsize=2)
def _loads(given: bytes) -> Loads:
    found: Loads = pickle.loads(given)
    return found


def _on_worker(given: bytes, *block: Any) -> SolvedBlock:
    return solve_block(_loads(given), *block)


@contextmanager
def _saying(which: str) -> Iterator[None]:
    """Tell in an error which taxel it is about."""
    try:
        yield
    except TactileLabError as reason:
        raise type(reason)(f"{which}: {reason}") from reason
