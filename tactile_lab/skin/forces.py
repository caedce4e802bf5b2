"""The force on a taxel against time, in as few straight pieces as keep it true."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tactile_lab.model.circuit import FloatArray
from tactile_lab.model.compiled import entry, inner, source_stamp
from tactile_lab.skin.contact import COLUMNS, stress
from tactile_lab.skin.skin import Skin

SOURCES = tuple(Path(__file__).with_name(f"{n}.py") for n in ("contact", "forces"))
"""Files of machine code beside the solver's."""
(
    STRENGTH, START, RAMP, HOLD, PERIOD, TIMES, VIBRATION, FREQUENCY, AT_X, AT_Y,
    SPEED_X, SPEED_Y, RESTS, COURSE,
) = range(14)  # fmt: skip
"""Columns of a course, how strong and where a stimulus is: see `stimulus.Stimulus`."""
SAMPLED = 0.2
"""Of the error that is allowed: what goes to where the force is computed; the rest goes
to the lines between these points."""
FINEST = 1 << 12
"""Into so many parts a stretch between two given points is cut at most."""


@inner
def strength_at(course: FloatArray, t: float) -> float:
    """Force, N, or pressure, Pa, of a stimulus at t, s."""
    since = t - course[START]
    if since <= 0.0:
        return 0.0
    within = since
    if course[TIMES] > 1.0:
        number = min(math.floor(since / course[PERIOD]), course[TIMES] - 1.0)
        within = since - number * course[PERIOD]
    ramp, hold = course[RAMP], course[HOLD]
    part = min(within, 2.0 * ramp + hold - within) / ramp
    if part <= 0.0:
        return 0.0
    wave = course[VIBRATION] * math.sin(2.0 * math.pi * course[FREQUENCY] * since)
    return float(course[STRENGTH] * min(part, 1.0) * (1.0 + wave))


@inner
def force_at(
    x: float, y: float, depth: float, rows: FloatArray, owner: Any, courses: FloatArray,
    t: float,
) -> float:  # fmt: skip
    """Pa on a taxel at x, y, m, under all loads at t, s."""
    total, strength, off_x, off_y = 0.0, 0.0, 0.0, 0.0
    last = -1
    for i in range(owner.size):
        s = owner[i]
        if s != last:  # loads of one stimulus move together
            last = s
            strength = strength_at(courses[s], t)
            moved = max(t - courses[s, START] - courses[s, RESTS], 0.0)
            off_x = x - courses[s, AT_X] - courses[s, SPEED_X] * moved
            off_y = y - courses[s, AT_Y] - courses[s, SPEED_Y] * moved
        if strength != 0.0:
            total += stress(rows[i], strength, off_x, off_y, depth)
    return total


@inner
def longer(numbers: FloatArray, size: int) -> FloatArray:
    """The array, or a copy of twice its length where it is full."""
    if size < numbers.size:
        return numbers
    larger = np.empty(2 * numbers.size)
    larger[:size] = numbers[:size]
    return larger


@inner
def force_on(
    x: float, y: float, depth: float, area: float, rows: FloatArray, owner: Any,
    courses: FloatArray, coarse: FloatArray, framed: FloatArray, error: float,
) -> Any:  # fmt: skip
    """The force on a taxel: halved between given points until straight lines do.

    Args:
        x: of the taxel, m.
        y: the same.
        depth: under the surface, m.
        area: that gathers the stress, m^2.
        rows: loads, see `contact`.
        owner: the stimulus of each load.
        courses: of each stimulus, shape (stimuli, COURSE).
        coarse: times, s.
        framed: forces to add, linear between the same times, N.
        error: by which the middle between two points may lie beside their line, N; it
            becomes a point itself.

    Returns:
        Times, s, and forces, N.
    """
    time, force = np.empty(2 * coarse.size), np.empty(2 * coarse.size)
    t0 = coarse[0]
    f0 = framed[0] + area * force_at(x, y, depth, rows, owner, courses, t0)
    time[0], force[0] = t0, f0
    size = 1
    wait_t, wait_f = np.empty(64), np.empty(64)
    for k in range(1, coarse.size):
        begin, slope = coarse[k - 1], framed[k] - framed[k - 1]
        whole = coarse[k] - begin
        wait_t[0] = coarse[k]
        wait_f[0] = framed[k] + area * force_at(
            x, y, depth, rows, owner, courses, coarse[k]
        )
        waiting = 1
        while waiting:
            t1, f1 = wait_t[waiting - 1], wait_f[waiting - 1]
            t = 0.5 * (t0 + t1)
            f = framed[k - 1] + slope * (t - begin) / whole
            f += area * force_at(x, y, depth, rows, owner, courses, t)
            fine = (t1 - t0) * FINEST > whole
            if abs(f - 0.5 * (f0 + f1)) > error and fine:
                wait_t[waiting], wait_f[waiting] = t, f
                waiting += 1
                continue
            time, force = longer(time, size + 1), longer(force, size + 1)
            time[size], force[size] = t, f
            time[size + 1], force[size + 1] = t1, f1
            size += 2
            t0, f0 = t1, f1
            waiting -= 1
    return time[:size], force[:size]


@inner
def thinned(time: FloatArray, force: FloatArray, error: float) -> int:
    """Keep so few points that straight lines pass all the others within `error`.

    From the last point kept, a line goes as far as the cone of slopes that pass each
    point in between within `error` stays open (Imai and Iri, J. Information Processing
    9, 159, 1986), and ends as near to the force there as the cone lets it: up to
    `error` beside it, which takes half as many lines as ending on it.

    Returns:
        The number of points kept; they are moved to the front of both arrays.
    """
    kept, good = 1, 0
    start, height = time[0], force[0]
    low, high = -np.inf, np.inf
    for i in range(1, time.size):
        dt = time[i] - start
        lower = max(low, (force[i] - error - height) / dt)
        upper = min(high, (force[i] + error - height) / dt)
        if lower > upper:
            height = ended(time[good], force[good], start, height, low, high)
            start = time[good]
            time[kept], force[kept] = start, height
            kept += 1
            dt = time[i] - start
            lower = (force[i] - error - height) / dt
            upper = (force[i] + error - height) / dt
        low, high, good = lower, upper, i
    if good:
        last = ended(time[good], force[good], start, height, low, high)
        time[kept], force[kept] = time[good], last
        kept += 1
    return kept


@inner
def ended(
    t: float, f: float, start: float, height: float, low: float, high: float
) -> float:
    """Where a line from `height` N ends at t, s, nearest to f with a slope allowed."""
    dt = t - start
    slope = (f - height) / dt
    if slope < low:
        return float(height + low * dt)
    return float(height + high * dt) if slope > high else f


class Loads:
    """All that presses on a skin, as compiled code takes it.

    Attributes:
        skin: which it presses on.
        time: between whose points forces are halved, s, shape (m,).
        rows: loads as `contact` describes, shape (l, COLUMNS).
        owner: which stimulus each belongs to, shape (l,).
        courses: of each stimulus, shape (stimuli, COURSE).
    """

    def __init__(self, skin: Skin) -> None:
        self.skin = skin
        self.time = skin.times
        loads = [one.loads(skin.array) for one in skin.stimuli]
        sizes = [one.shape[0] for one in loads]
        self.owner = np.repeat(np.arange(len(loads)), sizes)
        self.rows = np.concatenate([np.empty((0, COLUMNS)), *loads])
        self.courses = np.empty((len(loads), COURSE))
        for k, one in enumerate(skin.stimuli):
            way = math.radians(one.towards)
            self.courses[k] = (
                one.strength, one.start, one.ramp, one.hold, one.period or 0.0,
                one.times, one.vibration, one.frequency, *one.at,
                one.speed * math.cos(way), one.speed * math.sin(way), one.rests,
            )  # fmt: skip

    def framed(self, taxels: slice) -> FloatArray:
        """Forces from frames on these taxels, shape (taxels, m), N; 0 without."""
        count = len(range(*taxels.indices(self.skin.array.size)))
        total = np.zeros((count, self.time.size))
        for one in self.skin.frames:
            total += one.at(self.time, taxels)
        return total

    def largest(self, times: FloatArray) -> float:
        """The largest force on any taxel at these times, frames left aside, N."""
        array = self.skin.array
        return float(
            largest_force(
                array.places, array.depth, array.side**2, self.rows, self.owner,
                self.courses, times,
            )
        )  # fmt: skip

    def force(self, taxel: int) -> tuple[FloatArray, FloatArray]:
        """Times, s, and the force on one taxel at them, N; linear in between."""
        array = self.skin.array
        x, y = array.places[taxel]
        found: tuple[FloatArray, FloatArray] = one_force(
            x, y, array.depth, array.side**2, self.rows, self.owner, self.courses,
            self.time, self.framed(slice(taxel, taxel + 1))[0], self.skin.force_error,
        )  # fmt: skip
        return found


def _build(stamp: int) -> tuple[Callable[..., Any], Callable[..., Any]]:
    @entry
    def most(
        places: FloatArray, depth: float, area: float, rows: FloatArray, owner: Any,
        courses: FloatArray, times: FloatArray,
    ) -> float:  # fmt: skip
        _ = stamp
        found = 0.0
        for i in range(places.shape[0]):
            x, y = places[i, 0], places[i, 1]
            for t in times:
                found = max(found, force_at(x, y, depth, rows, owner, courses, t))
        return area * found

    @entry
    def one_force(
        x: float, y: float, depth: float, area: float, rows: FloatArray, owner: Any,
        courses: FloatArray, coarse: FloatArray, framed: FloatArray, error: float,
    ) -> Any:  # fmt: skip
        _ = stamp
        time, force = force_on(
            x, y, depth, area, rows, owner, courses, coarse, framed, SAMPLED * error
        )
        kept = thinned(time, force, (1.0 - SAMPLED) * error)
        return time[:kept].copy(), force[:kept].copy()

    return one_force, most


one_force, largest_force = _build(source_stamp(*SOURCES))
