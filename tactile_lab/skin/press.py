"""Carry out a skin: every taxel on every core, the events to disk."""

from __future__ import annotations

import os
import time as wall
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_lab.errors import ParameterError, TactileLabError
from tactile_lab.model.batch import Records, certain, records
from tactile_lab.model.circuit import (
    LARGEST_VOLTAGE,
    SUBTHRESHOLD_LIMIT,
    FloatArray,
)
from tactile_lab.model.equations import fires_at_rest
from tactile_lab.model.solver import MOST_COUPLED, MOST_SPIKES
from tactile_lab.model.specimen import parts
from tactile_lab.quantity import show
from tactile_lab.skin import kernel
from tactile_lab.skin.bound import least_critical, spans
from tactile_lab.skin.events import FILE, EventWriter
from tactile_lab.skin.forces import Loads
from tactile_lab.skin.single import simulate_taxel
from tactile_lab.skin.skin import Skin

BLOCK = 64
"""Taxels solved in one go."""
AHEAD = 4
"""Blocks for each core that may be under way."""
CORNERS = 64
"""Times at which forces are looked at beforehand."""


@dataclass(frozen=True)
class Pressed:
    """What was computed.

    Attributes:
        events: number of spikes.
        taxels: how many fired, were silent, left out, dead, stuck, by name.
        error: largest estimated error of a spike time, s.
        seconds: of wall time.
        warnings: for people.
    """

    events: int
    taxels: dict[str, int]
    error: float
    seconds: float
    warnings: tuple[str, ...]


def press(
    skin: Skin,
    folder: Path,
    *,
    cores: int | None = None,
    tell: Callable[[int], object] = lambda taxels: None,
    watch: Callable[[int, NDArray[np.int64], FloatArray], object] | None = None,
) -> Pressed:
    """Compute all spikes and write them; the same to the last bit on any cores.

    Args:
        skin: what to compute.
        folder: where `events.h5` is put.
        cores: threads; as many as cores unless given.
        tell: is told how many taxels are done.
        watch: is given trains as they are written, as `EventWriter.add` takes them.

    Raises:
        ParameterError: the parts of a taxel make no circuit.
        SolverError: a taxel cannot be solved to the tolerance.
        RecordingError: the events cannot be written.
    """
    began = wall.perf_counter()
    size = skin.array.size
    cores = cores or os.cpu_count() or 1
    loads = Loads(skin)
    role = np.zeros(size, np.uint8)
    role[skin.array.named(skin.array.dead)] = kernel.DEAD
    role[skin.array.named(skin.array.stuck)] = kernel.STUCK
    count = np.zeros(size, np.int64)
    span, largest = spans(skin, loads)
    silent = (span < least_critical(skin)) & (role == kernel.FIRED)
    role[silent] = kernel.UNTOUCHED
    worst, pieces = 0.0, 0
    blocks = deque(slice(k, min(k + BLOCK, size)) for k in range(0, size, BLOCK))
    waiting: deque[tuple[slice, Future[Any]]] = deque()
    folder.mkdir(parents=True, exist_ok=True)
    with (
        EventWriter(folder / FILE, skin.duration) as writer,
        ThreadPoolExecutor(cores) as pool,
    ):
        while blocks or waiting:
            while blocks and len(waiting) < AHEAD * cores:
                part = blocks.popleft()
                asked = (skin, loads, part, role[part], span[part])
                waiting.append((part, pool.submit(solve_block, *asked)))
            part, future = waiting.popleft()
            try:
                count[part], found, force, error, times = future.result()
                largest[part] = np.where(np.isnan(force), largest[part], force)
            except BaseException:
                for _, other in waiting:
                    other.cancel()
                raise
            worst, pieces = max(worst, float(error.max())), pieces + int(found.sum())
            writer.add(part.start, count[part], times)
            if watch is not None:
                watch(part.start, count[part], times)
            tell(part.stop)
        names = ("fired", "silent", "left out", "dead", "stuck")
        told = {name: int((role == k).sum()) for k, name in enumerate(names)}
        seconds = wall.perf_counter() - began
        most = float(largest.max())
        writer.finish(
            {
                "places": skin.array.places,
                "count": count,
                "role": role,
                "largest_force": largest,
            },
            {
                "name": skin.name,
                "title": skin.title,
                "duration_s": skin.duration,
                "taxels": told,
                "specimen": skin.first_specimen or None,
                "error_s": worst,
                "pieces": pieces,
                "skin": skin.source,
            },
        )
    return Pressed(int(count.sum()), told, worst, seconds, warnings(skin, most))


def solve_block(
    skin: Skin, loads: Loads, part: slice, role: NDArray[np.uint8], span: FloatArray
) -> Any:
    """Solve those of a block that are not left out yet; fills `role` in.

    Args:
        skin: what to compute.
        loads: on it.
        part: numbers of the taxels.
        role: of each.
        span: what the range of the force on each stays below, N; infinite if unknown.

    Returns:
        Numbers of spikes and pieces, largest forces, N, NaN for those left out, errors,
        s, each of shape (block,); and all spikes, s.
    """
    array, circuit = skin.array, skin.circuit
    asked = np.flatnonzero(role != kernel.UNTOUCHED)
    count, pieces = np.zeros(role.size, np.int64), np.zeros(role.size, np.int64)
    force, error = np.full(role.size, np.nan), np.zeros(role.size)
    if not asked.size:
        return count, pieces, force, error, np.empty(0)
    taxels = part.start + asked
    first = skin.first_specimen
    many = (
        records(circuit, parts(circuit, first + taxels))
        if first
        else np.repeat(records(circuit, {}), taxels.size)
    )
    for taxel in taxels[~certain(circuit, many, None)]:
        with _saying(f"Taxel {taxel}"):
            skin.circuit_of(int(taxel))
    became = role[asked]
    framed = loads.framed(taxels)
    count[asked], pieces[asked], force[asked], error[asked], times = solved(
        skin, loads, many, array.places[taxels], framed, became, span[asked]
    )
    role[asked] = became
    refused = asked[became == kernel.REFUSED]
    if refused.size:
        taxel, most = part.start + int(refused[0]), show(float(force[refused[0]]), "N")
        with _saying(f"Taxel {taxel}, pressed with up to {most}"):
            simulate_taxel(skin, taxel)
    return count, pieces, force, error, times


def solved(
    skin: Skin, loads: Loads, many: Records, places: FloatArray, framed: FloatArray,
    role: NDArray[np.uint8], span: FloatArray,
) -> Any:  # fmt: skip
    """Numbers of spikes and pieces, forces, errors, spikes of circuits at places, m."""
    saturates = skin.circuit.saturation
    run = kernel.run_saturating if saturates else kernel.run
    return run(
        many, skin.circuit.t1 == "direct", role, skin.array.stuck_rate, places,
        loads.pressing, framed, span, skin.force_error, skin.duration, skin.tolerance,
        MOST_COUPLED if saturates else MOST_SPIKES,
    )  # fmt: skip


@contextmanager
def _saying(which: str) -> Iterator[None]:
    """Tell in an error which taxel it is about."""
    try:
        yield
    except TactileLabError as reason:
        raise type(reason)(f"{which}: {reason}") from reason


def highest(skin: Skin) -> tuple[float, tuple[str, ...]]:
    """The highest force on a taxel at the corners of the stimuli, N, and warnings.

    Raises:
        ParameterError: it makes a voltage beyond what the model describes.
    """
    loads = Loads(skin)
    corners = [one.corners.ravel() for one in skin.stimuli]
    at = np.unique(np.concatenate([np.empty(0), *corners]))
    at = at[at <= skin.duration][:CORNERS]
    most = loads.largest(at)
    for one in skin.frames:
        most = max(most, float(one.forces.max()) * one.scale)
    if abs(skin.circuit.k_F) * most > LARGEST_VOLTAGE:
        raise ParameterError(
            f"A taxel feels up to {show(most, 'N')}; at most "
            f"{show(LARGEST_VOLTAGE / abs(skin.circuit.k_F), 'N')} can be simulated. "
            "Press less, or make side smaller."
        )
    return most, warnings(skin, most)


def warnings(skin: Skin, most: float) -> tuple[str, ...]:
    """Where the model is left by a fast touch, and where none is needed to fire."""
    found = []
    if fires_at_rest(skin.circuit):
        found.append("Taxels as marked fire at rest: see V_GS in [sensor].")
    limit = (SUBTHRESHOLD_LIMIT - skin.circuit.V_GS) / abs(skin.circuit.k_F)
    if most > limit:
        found.append(
            f"Taxels feel up to {show(most, 'N')}: a fast touch beyond "
            f"{show(limit, 'N')} leaves the exponential law of Eq. (1), and I_DS is "
            "overestimated there."
        )
    return tuple(found)
