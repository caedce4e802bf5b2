"""Carry out a skin: every taxel on every core, the events to disk."""

from __future__ import annotations

import math
import shutil
import time as wall
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import ParameterError, RecordingError
from tactile_lab.model.circuit import LARGEST_VOLTAGE, SUBTHRESHOLD_LIMIT
from tactile_lab.model.equations import fires_at_rest
from tactile_lab.quantity import show
from tactile_lab.skin import kernel
from tactile_lab.skin.blocks import solve_block, solved_blocks
from tactile_lab.skin.bound import least_critical, spans
from tactile_lab.skin.events import FILE, EventWriter, recording
from tactile_lab.skin.forces import Loads
from tactile_lab.skin.skin import Skin

TAXEL, SPIKE = 33, 26
"""Bytes on the disk: of a taxel, and of a spike, which waits there for 16 to be sorted
while some 10 of the file are written."""
TRIED = 16
"""Taxels at most that tell how many spikes will come."""
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
    scheduler: str | None = None,
    tell: Callable[[int], object] = lambda taxels: None,
    watch: Callable[[int, NDArray[np.int64], FloatArray], object] | None = None,
) -> Pressed:
    """Compute all spikes and write them; the same to the last bit on any cores.

    Args:
        skin: what to compute.
        folder: where `events.h5` is put.
        cores: threads; as many as cores unless given.
        scheduler: address of a Dask scheduler whose workers compute instead.
        tell: is told how many taxels are done.
        watch: is given trains as they are written, as `EventWriter.add` takes them.

    Raises:
        ParameterError: the parts of a taxel make no circuit.
        SolverError: a taxel cannot be solved to the tolerance.
        RecordingError: the events cannot be written, or there is no room for them.
        NotFoundError, SceneError: the scheduler cannot be used.
        LinkLostError: its workers are gone; nothing is written.
    """
    began = wall.perf_counter()
    size = skin.array.size
    loads = Loads(skin)
    role = np.zeros(size, np.uint8)
    role[skin.array.named(skin.array.dead)] = kernel.DEAD
    role[skin.array.named(skin.array.stuck)] = kernel.STUCK
    count = np.zeros(size, np.int64)
    span, largest = spans(skin, loads)
    silent = (span < least_critical(skin)) & (role == kernel.FIRED)
    role[silent] = kernel.UNTOUCHED
    worst, pieces = 0.0, 0
    _refuse_too_large(loads, role, span, folder)
    with recording():
        folder.mkdir(parents=True, exist_ok=True)
    with EventWriter(folder / FILE, skin.duration) as writer:
        for part, found in solved_blocks(loads, role, span, cores, scheduler):
            role[part], count[part], lines, force, error, times = found
            largest[part] = np.where(np.isnan(force), largest[part], force)
            worst, pieces = max(worst, float(error.max())), pieces + int(lines.sum())
            writer.add(part.start, count[part], times)
            if watch is not None:
                watch(part.start, count[part], times)
            tell(part.stop)
        names = ("fired", "silent", "left out", "dead", "stuck")
        told = {name: int((role == k).sum()) for k, name in enumerate(names)}
        seconds = wall.perf_counter() - began
        most = float(largest[role != kernel.UNTOUCHED].max(initial=0.0))
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


def _refuse_too_large(
    loads: Loads, role: NDArray[np.uint8], span: FloatArray, folder: Path
) -> None:
    """Refuse what the disk cannot hold, going by some taxels that are tried."""
    array, asked = loads.skin.array, np.flatnonzero(role == kernel.FIRED)
    spikes = len(array.stuck) * array.stuck_rate * loads.skin.duration
    number = min(TRIED, math.ceil(asked.size / (1 << 8)))
    tried = asked[np.linspace(0, asked.size, number, endpoint=False).astype(int)]
    for n in tried:
        one = slice(n, n + 1)
        found = solve_block(loads, one, role[one], span[one])
        spikes += found.times.size * asked.size / number
    needed = array.size * TAXEL + spikes * SPIKE
    there = next(
        place for place in (folder, *folder.resolve().parents) if place.exists()
    )
    free = shutil.disk_usage(there).free
    if needed > free:
        raise RecordingError(
            f"{folder} has room for {show(free, 'B', 2)}; about {show(needed, 'B', 2)} "
            f"are needed for {array.size:,} taxels and some {spikes:,.2g} spikes, by "
            f"{number} taxels that were tried. Make room, name another folder, or "
            "make the array smaller or the duration shorter."
        )


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
