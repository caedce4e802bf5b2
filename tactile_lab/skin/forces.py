"""The force on a taxel against time, in as few straight pieces as keep it true."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.model.compiled import entry, inner, inner_making_arrays, source_stamp
from tactile_lab.skin.contact import COLUMNS, KIND, SHAPE_1, SHAPE_2, SPHERE, STRIP
from tactile_lab.skin.skin import Skin
from tactile_lab.skin.track import (
    KEPT,
    TrackSeries,
    slot_of,
    stress_of,
    summed,
    track_of,
)

SOURCES = tuple(
    Path(__file__).with_name(f"{n}.py") for n in ("contact", "track", "forces")
)
"""Files of machine code beside the solver's."""
(
    STRENGTH, START, RAMP, HOLD, PERIOD, TIMES, VIBRATION, FREQUENCY, AT_X, AT_Y,
    WAY_X, WAY_Y, SPEED, RESTS, FIRST, END, HOW, COURSE,
) = range(18)  # fmt: skip
"""Columns of a course, how strong and where a stimulus is: see `stimulus.Stimulus`. It
moves with SPEED along WAY_X, WAY_Y, and has the loads from FIRST to END."""
STILL, SHARED, SINGLE = range(3)
"""HOW its stress is found: once, times the strength; so, but shared along its track;
anew each time, where it is not in proportion to the strength or quickly found."""
FEW = 2
"""Loads whose stress is found as quickly as a series is summed up."""
SAMPLED = 0.1
"""Of the error that is allowed: what goes to where the force is computed; the rest goes
to the lines between these points."""
FINEST = 1 << 12
"""Into so many parts a stretch between two given points is cut at most."""


class Pressing(NamedTuple):
    """All that presses on a skin, as compiled code takes it.

    Attributes:
        depth: of the taxels, m.
        area: that gathers the stress for one, m^2.
        rows: loads as `contact` describes, shape (l, COLUMNS).
        courses: of each stimulus, shape (stimuli, COURSE).
        coarse: between whose points forces are halved, s, shape (m,).
        slides: after each of these up to the next, the stimulus that slides while
            nothing else changes, or -1.
        series: of what is shared, of this thread alone.
    """

    depth: float
    area: float
    rows: FloatArray
    courses: FloatArray
    coarse: FloatArray
    slides: Any
    series: TrackSeries


@inner
def strength_at(courses: FloatArray, s: int, t: float) -> float:
    """Force, N, or pressure, Pa, of stimulus s at t, s."""
    since = t - courses[s, START]
    if since <= 0.0:
        return 0.0
    within = since
    if courses[s, TIMES] > 1.0:
        period, last = courses[s, PERIOD], courses[s, TIMES] - 1.0
        within = since - min(math.floor(since / period), last) * period
    ramp, hold = courses[s, RAMP], courses[s, HOLD]
    part = min(within, 2.0 * ramp + hold - within) / ramp
    if part <= 0.0:
        return 0.0
    strength = courses[s, STRENGTH] * min(part, 1.0)
    if courses[s, VIBRATION] > 0.0:
        angle = 2.0 * math.pi * courses[s, FREQUENCY] * since
        strength *= 1.0 + courses[s, VIBRATION] * math.sin(angle)
    return float(strength)


@inner
def placed(x: float, y: float, pressing: Any, at: FloatArray) -> None:
    """Fill `at`, of shape (stimuli, 2), with where a taxel at x, y, m, is.

    Beside a stimulus that stands still: with its stress, Pa, of strength 1. Beside one
    that moves: with its place along and across its way, m, or the number of its track.
    """
    depth, rows, courses = pressing.depth, pressing.rows, pressing.courses
    for s in range(courses.shape[0]):
        off_x, off_y = x - courses[s, AT_X], y - courses[s, AT_Y]
        first, end = int(courses[s, FIRST]), int(courses[s, END])
        if courses[s, HOW] == STILL:
            at[s, 0] = stress_of(rows, first, end, 1.0, off_x, off_y, depth)
            continue
        way_x, way_y = courses[s, WAY_X], courses[s, WAY_Y]
        at[s, 0] = off_x * way_x + off_y * way_y
        at[s, 1] = off_y * way_x - off_x * way_y
        if courses[s, HOW] == SHARED:
            even = rows[first, KIND] == STRIP  # along the ridges nothing changes
            at[s, 1] = 0.0 if even else track_of(at[s, 1], depth)


@inner
def shared(at: FloatArray, pressing: Any, s: int, stretch: float) -> int:
    """Where the series of a stretch of the track beside stimulus s is."""
    courses = pressing.courses
    return slot_of(
        pressing.series, pressing.rows, int(courses[s, FIRST]), int(courses[s, END]),
        courses[s, WAY_X], courses[s, WAY_Y], at[s, 1], stretch, pressing.depth,
    )  # fmt: skip


@inner
def force_at(at: FloatArray, pressing: Any, t: float) -> float:
    """N on a taxel, `placed`, under all loads at t, s."""
    depth, rows, courses = pressing.depth, pressing.rows, pressing.courses
    total = 0.0
    for s in range(courses.shape[0]):
        strength = strength_at(courses, s, t)
        if strength == 0.0:
            continue
        if courses[s, HOW] == STILL:
            total += strength * at[s, 0]
            continue
        moved = max(t - courses[s, START] - courses[s, RESTS], 0.0)
        u, across = at[s, 0] - courses[s, SPEED] * moved, at[s, 1]
        if courses[s, HOW] == SHARED:
            place = u / depth
            stretch = math.floor(place)
            slot = shared(at, pressing, s, stretch)
            x = 2.0 * (place - stretch) - 1.0
            total += strength * summed(pressing.series.factor, slot, x)
        else:
            first, end = int(courses[s, FIRST]), int(courses[s, END])
            way_x, way_y = courses[s, WAY_X], courses[s, WAY_Y]
            off_x, off_y = u * way_x - across * way_y, u * way_y + across * way_x
            total += stress_of(rows, first, end, strength, off_x, off_y, depth)
    return float(pressing.area * total)


@inner_making_arrays
def longer(numbers: FloatArray, size: int) -> FloatArray:
    """The array, or a longer copy where so many do not fit."""
    if size <= numbers.size:
        return numbers
    larger = np.empty(2 * size)
    for i in range(numbers.size):
        larger[i] = numbers[i]
    return larger


@inner_making_arrays
def slid(
    at: FloatArray, pressing: Any, s: int, end: float, error: float,
    time: FloatArray, force: FloatArray, size: int,
) -> Any:  # fmt: skip
    """Points up to `end`, s, while stimulus s slides and nothing else changes.

    Each stretch has as many as its largest curvature asks for.

    Returns:
        Times, s, forces, N, and their number.
    """
    depth, courses, series = pressing.depth, pressing.courses, pressing.series
    speed = courses[s, SPEED]
    since = courses[s, START] + courses[s, RESTS]
    scale = courses[s, STRENGTH] * pressing.area
    begin = time[size - 1]
    rest = 0.0  # what else presses
    stretch = math.floor((at[s, 0] - speed * (begin - since)) / depth)
    last = math.floor((at[s, 0] - speed * (end - since)) / depth)
    on = 1 if last > stretch else -1
    for n in range(abs(last - stretch) + 1):
        slot = shared(at, pressing, s, stretch + n * on)
        if n == 0:
            x = 2.0 * ((at[s, 0] - speed * (begin - since)) / depth - stretch) - 1.0
            rest = force[size - 1] - scale * summed(series.factor, slot, x)
        bend, parts = 0.5 * series.bend[slot] * scale, FINEST
        if bend < FINEST * FINEST * error:
            parts = 1 + int(math.sqrt(bend / error))
        time, force = longer(time, size + parts + 1), longer(force, size + parts + 1)
        for i in range(parts):
            part = i / parts if on > 0 else 1.0 - i / parts
            u = (stretch + n * on + part) * depth
            t = since + (at[s, 0] - u) / speed
            if time[size - 1] < t < end:
                time[size] = t
                x = 2.0 * part - 1.0
                force[size] = rest + scale * summed(series.factor, slot, x)
                size += 1
    return time, force, size


@inner_making_arrays
def force_on(
    x: float, y: float, pressing: Any, framed: FloatArray, error: float
) -> Any:
    """The force on a taxel at so many times that straight lines do in between.

    A stretch between given points is halved until halves of its halves lie on their
    lines, or is taken from `slid`.

    Args:
        x: of the taxel, m.
        y: the same.
        pressing: on it.
        framed: forces to add, linear between the same times, N.
        error: by which the force may lie beside its lines, N.

    Returns:
        Times, s, and forces, N.
    """
    coarse = pressing.coarse
    at = np.empty((pressing.courses.shape[0], 2))
    placed(x, y, pressing, at)
    time, force = np.empty(4 * coarse.size), np.empty(4 * coarse.size)
    t0 = coarse[0]
    f0 = framed[0] + force_at(at, pressing, t0)
    time[0], force[0] = t0, f0
    size, k = 1, 0
    wait_t, wait_f, wait_m = np.empty(64), np.empty(64), np.empty(64)
    while k < coarse.size - 1:
        begin, k = k, k + 1
        s = pressing.slides[begin]
        if s >= 0:
            while k < coarse.size - 1 and pressing.slides[k] == s:
                k += 1
            time, force, size = slid(
                at, pressing, s, coarse[k], error, time, force, size
            )
            time, force = longer(time, size + 1), longer(force, size + 1)
            t0, f0 = coarse[k], force_at(at, pressing, coarse[k])
            time[size], force[size] = t0, f0
            size += 1
            continue
        whole, base = coarse[k] - t0, t0
        slope = (framed[k] - framed[begin]) / whole
        wait_t[0] = coarse[k]
        wait_f[0] = framed[k] + force_at(at, pressing, coarse[k])
        wait_m[0] = framed[begin] + 0.5 * slope * whole
        wait_m[0] += force_at(at, pressing, t0 + 0.5 * whole)
        waiting = 1
        while waiting:
            t1, f1, m = wait_t[waiting - 1], wait_f[waiting - 1], wait_m[waiting - 1]
            t = t0 + 0.25 * (t1 - t0)
            a = framed[begin] + slope * (t - base) + force_at(at, pressing, t)
            t = t0 + 0.75 * (t1 - t0)
            b = framed[begin] + slope * (t - base) + force_at(at, pressing, t)
            off = max(abs(a - 0.5 * (f0 + m)), abs(b - 0.5 * (m + f1)))
            if off > error and (t1 - t0) * FINEST > whole:
                wait_m[waiting - 1] = b
                wait_t[waiting], wait_f[waiting] = t0 + 0.5 * (t1 - t0), m
                wait_m[waiting] = a
                waiting += 1
                continue
            time, force = longer(time, size + 4), longer(force, size + 4)
            for i in range(4):
                time[size + i] = t0 + 0.25 * (i + 1) * (t1 - t0)
            time[size + 3] = t1
            force[size], force[size + 1], force[size + 2], force[size + 3] = a, m, b, f1
            size += 4
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
    """What presses on a skin, told to compiled code.

    Attributes:
        skin: which it presses on.
        time: between whose points forces are halved, s, shape (m,).
    """

    def __init__(self, skin: Skin) -> None:
        self.skin = skin
        self.time = skin.times
        loads = [one.loads(skin.array) for one in skin.stimuli]
        ends = np.cumsum([one.shape[0] for one in loads])
        rows = np.concatenate([np.empty((0, COLUMNS)), *loads])
        courses = np.empty((len(loads), COURSE))
        for k, (one, end) in enumerate(zip(skin.stimuli, ends, strict=True)):
            first = end - loads[k].shape[0]
            kinds = set(rows[first:end, KIND])
            way_x, way_y = _direction(one.towards)
            speed = one.speed
            if STRIP in kinds:  # all that matters is across the ridges
                across_x, across_y = rows[first, SHAPE_1], rows[first, SHAPE_2]
                speed *= way_x * across_x + way_y * across_y
                way_x, way_y = across_x, across_y
            if SPHERE in kinds:
                how = SINGLE
            elif speed == 0.0:
                how = STILL
            else:
                how = SHARED if end - first > FEW else SINGLE
            courses[k] = (
                one.strength, one.start, one.ramp, one.hold, one.period or 0.0,
                one.times, one.vibration, one.frequency, *one.at, way_x, way_y, speed,
                one.rests, first, end, how,
            )  # fmt: skip
        slides = self._slides(courses)
        area = skin.array.side**2
        self._given = (skin.array.depth, area, rows, courses, self.time, slides)
        self._own = threading.local()

    def __getstate__(self) -> dict[str, Any]:
        """For another process: without forces of files, which it may not have."""
        bare = replace(self.skin, frames=(), source={}, array=replace(self.skin.array))
        return {"skin": bare, "time": self.time, "_given": self._given}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """As another process has it."""
        vars(self).update(state, _own=threading.local())

    @property
    def pressing(self) -> Pressing:
        """For this thread."""
        if not hasattr(self._own, "series"):
            shared = np.any(self._given[3][:, HOW] == SHARED)
            self._own.series = TrackSeries.none(KEPT if shared else 1)
        return Pressing(*self._given, self._own.series)

    def _slides(self, courses: FloatArray) -> NDArray[np.int64]:
        """See `Pressing.slides`."""
        middle = (self.time[1:] + self.time[:-1]) / 2
        found = np.full(middle.size, -1)
        others = np.zeros(middle.size, np.int64)
        for k, one in enumerate(self.skin.stimuli):
            since = middle - one.start
            number = np.minimum(since // (one.period or math.inf), one.times - 1)
            within = since - number * (one.period or 0.0)
            active = (since > 0) & (within < 2 * one.ramp + one.hold)
            held = (within > one.ramp) & (within < one.ramp + one.hold)
            even = ~active | (held & (one.vibration == 0.0))
            moves = active & (courses[k, SPEED] != 0.0) & (since > one.rests)
            mine = moves & even & (courses[k, HOW] == SHARED)
            found[mine] = k
            others += mine | moves | ~even
        found[(others > 1) | bool(self.skin.frames)] = -1
        return found

    def framed(self, taxels: NDArray[np.intp]) -> FloatArray:
        """Forces from frames on these taxels, shape (taxels, m), N; 0 without."""
        total = np.zeros((taxels.size, self.time.size))
        for one in self.skin.frames:
            total += one.at(self.time, taxels)
        return total

    def largest(self, times: FloatArray) -> float:
        """The largest force on any taxel at these times, frames left aside, N."""
        return float(largest_force(self.skin.array.places, self.pressing, times))

    def force(self, taxel: int) -> tuple[FloatArray, FloatArray]:
        """Times, s, and the force on one taxel at them, N; linear in between."""
        found: tuple[FloatArray, FloatArray] = one_force(
            *self.skin.array.places[taxel], self.pressing,
            self.framed(np.array([taxel]))[0], self.skin.force_error,
        )  # fmt: skip
        return found


def _direction(towards: float) -> tuple[float, float]:
    """Its cosine and sine; right angles are right to the last bit."""
    turns, rest = divmod(towards, 90.0)
    way = complex(math.cos(math.radians(rest)), math.sin(math.radians(rest)))
    way *= (1, 1j, -1, -1j)[int(turns) % 4]
    return way.real, way.imag


def _build(stamp: int) -> tuple[Callable[..., Any], Callable[..., Any]]:
    @entry
    def most(places: FloatArray, pressing: Any, times: FloatArray) -> float:
        _ = stamp
        found = 0.0
        at = np.empty((pressing.courses.shape[0], 2))
        for i in range(places.shape[0]):
            placed(places[i, 0], places[i, 1], pressing, at)
            for t in times:
                found = max(found, force_at(at, pressing, t))
        return found

    @entry
    def one_force(
        x: float, y: float, pressing: Any, framed: FloatArray, error: float
    ) -> Any:
        _ = stamp
        time, force = force_on(x, y, pressing, framed, SAMPLED * error)
        kept = thinned(time, force, (1.0 - SAMPLED) * error)
        return time[:kept].copy(), force[:kept].copy()

    return one_force, most


one_force, largest_force = _build(source_stamp(*SOURCES))
