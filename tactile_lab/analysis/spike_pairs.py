"""Measured spikes paired with predicted ones."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactile_lab.analysis.belief import PART
from tactile_lab.analysis.estimate import Z95
from tactile_lab.arrays import FloatArray
from tactile_lab.quantity import rounded

WITHIN = 0.5
"""A spike may lie off its expected place by this part of the interval around it."""
SILENCE = 3.0
"""A gap so many times longer than the interval before begins a new burst."""
ALONE = 1.0
"""And so does one this long, s: V_C2 forgets within it what the spike before was."""
FINEST = 0.001
"""An error of the rate below this tells nothing more, %."""


@dataclass(frozen=True, eq=False)
class Matched:
    """Measured spikes paired with predicted ones.

    Attributes:
        measured: shape (k,), times of the pairs' measured spikes, s.
        offsets: shape (k,), measured less predicted, s.
        missed: predicted spikes without a measured one.
        extra: measured spikes without a predicted one.
        rate_error: shape (j,), relative error of 1/ISI where two neighbours on both
            sides are paired: measured over predicted less 1.
        rated: shape (j,), times of the later of those neighbours, s.
        open: shape (k,) each, s: what each cause of uncertainty leaves open, either
            sign, by its name; not a number where it has no such spike.
        rate_tolerance: shape (j,): what all of them leave open of the rate error.
    """

    measured: FloatArray
    offsets: FloatArray
    missed: int
    extra: int
    rate_error: FloatArray
    rated: FloatArray
    open: Mapping[str, FloatArray]
    rate_tolerance: FloatArray

    @property
    def tolerance(self) -> FloatArray:
        """Shape (k,), s: what all causes leave open together, either sign."""
        return together(self.open, self.offsets.size)

    @property
    def scatter(self) -> float:
        """How far noise takes a spike from where it is predicted, 95 %, s: the median.

        An interval that noise makes longer makes all later spikes of its burst late, so
        that the n-th lies off by the root of n times as much as one interval. That is
        told by how the offset changes from one interval to the next, into which no slow
        drift enters; not a number without three spikes in a burst.
        """
        gaps = np.diff(self.measured)
        silence = np.minimum(SILENCE * _interval(self.measured)[:-1], ALONE)
        begins = np.append(True, gaps > silence)
        burst, at = np.cumsum(begins), np.arange(begins.size)
        inside = burst[2:] == burst[:-2]
        if not inside.any():
            return float("nan")
        changes = np.abs(np.diff(self.offsets, 2)[inside])
        one = Z95 * float(np.median(changes)) / 0.6745 / math.sqrt(2)
        return one * math.sqrt(np.median(at - at[begins][burst - 1] + 1))

    @property
    def within(self) -> float:
        """Part of the pairs whose offset lies within the tolerance, 0 to 1."""
        told = np.isfinite(self.tolerance)
        inside = np.abs(self.offsets[told]) <= self.tolerance[told]
        return float(np.mean(inside)) if inside.size else float("nan")

    @property
    def sentence(self) -> str:
        """For a person: "26 of 26 spikes matched, median offset 1.2 ms"."""
        measured = self.measured.size + self.extra
        text = f"{self.measured.size} of {measured} spikes matched"
        if self.missed:
            ones = "one" if self.missed == 1 else "ones"
            text += f", {self.missed} predicted {ones} missing"
        if self.offsets.size:
            middle = rounded(np.median(self.offsets) * 1e3)
            largest = rounded(np.max(np.abs(self.offsets)) * 1e3)
            text += f", offset {middle} ms (median), {largest} ms at most"
        if self.rate_error.size:
            error = float(np.median(self.rate_error)) * 100
            told = rounded(error) if abs(error) >= FINEST else f"below {FINEST}"
            text += f", rate error {told} % (median)"
        return text


def match(
    measured: ArrayLike,
    predicted: ArrayLike,
    displaced: Sequence[tuple[str, ArrayLike]] = (),
) -> Matched:
    """Pair spikes in order, each where the pair before lets expect it.

    A train that runs a little faster leaves the other behind by and by, so each spike
    is looked for at the offset of the last pair, after a long silence at none. It must
    lie there within half the shorter of the intervals around either spike, so that a
    pair never reaches across a neighbour.

    Args:
        measured: s, ascending.
        predicted: s, ascending.
        displaced: by name of a cause of uncertainty, what is predicted where it is
            moved by `PART` of its band.
    """
    ours = np.asarray(measured, dtype=np.float64)
    theirs = np.asarray(predicted, dtype=np.float64)
    if ours.size == 0 or theirs.size == 0:
        nothing = np.empty(0)
        return Matched(
            nothing, nothing, theirs.size, ours.size, nothing, nothing, {}, nothing
        )
    to_theirs = _followed(ours, theirs)
    paired = to_theirs >= 0
    offsets = ours - theirs[to_theirs]
    index = np.flatnonzero(paired)
    both = paired[1:] & paired[:-1] & (np.diff(to_theirs) == 1)
    rate_error = np.diff(theirs[to_theirs])[both] / np.diff(ours)[both] - 1
    shifts = [
        (name, _shift(theirs, np.asarray(d, np.float64))) for name, d in displaced
    ]
    bend = sum(
        ((np.diff(s) / np.diff(theirs)) ** 2 for _, s in shifts),
        np.zeros(max(theirs.size - 1, 0)),
    )
    return Matched(
        ours[index],
        offsets[index],
        int(theirs.size - index.size),
        int(ours.size - index.size),
        rate_error,
        ours[1:][both],
        by_cause((name, shift[to_theirs[index]]) for name, shift in shifts),
        np.sqrt(bend)[to_theirs[:-1][both]],
    )


def by_cause(parts: Iterable[tuple[str, FloatArray]]) -> dict[str, FloatArray]:
    """Independent parts of an uncertainty, those of one cause put together."""
    squares: dict[str, FloatArray] = {}
    for name, part in parts:
        squares[name] = squares.get(name, 0.0) + part**2
    return {name: np.sqrt(square) for name, square in squares.items()}


def together(parts: Mapping[str, FloatArray], size: int) -> FloatArray:
    """Independent parts of an uncertainty as one, shape (size,)."""
    return np.sqrt(sum((part**2 for part in parts.values()), np.zeros(size)))


def irregularity(values: FloatArray) -> float:
    """Half-width that holds 95 % of the scatter of `values` about a smooth course."""
    if values.size < 3:
        return float("nan")
    bends = np.abs(values[2:] - 2 * values[1:-1] + values[:-2])
    # of Gaussian noise: the median is 0.6745 sigma, a second difference sqrt(6) of it
    return 1.96 * float(np.nanmedian(bends)) / 0.6745 / math.sqrt(6)


def _shift(spikes: FloatArray, displaced: FloatArray) -> FloatArray:
    """How far each spike moves under the whole band; NaN where it has no other."""
    moved = np.full(spikes.size, np.nan)
    if spikes.size and displaced.size:
        there = _nearest(spikes, displaced)
        mutual = _nearest(displaced, spikes)[there] == np.arange(spikes.size)
        moved[mutual] = (displaced[there] - spikes)[mutual] / PART
    return moved


def _followed(ours: FloatArray, theirs: FloatArray) -> NDArray[np.intp]:
    """For each of ours the index of its pair among theirs, or -1."""
    found = np.full(ours.size, -1, dtype=np.intp)
    near_ours, near_theirs = _interval(ours), _interval(theirs)
    offset, free = 0.0, 0
    for i, time in enumerate(ours):
        if i and time - ours[i - 1] > SILENCE * near_ours[i - 1]:
            offset = 0.0
        after = free + int(np.searchsorted(theirs[free:], time - offset))
        around = [j for j in (after - 1, after) if free <= j < theirs.size]
        if not around:
            continue
        j = min(around, key=lambda k: abs(time - offset - theirs[k]))
        room = WITHIN * min(near_ours[i], near_theirs[j])
        if abs(time - offset - theirs[j]) <= room:
            found[i], free = j, j + 1
            offset = time - theirs[j]
    return found


def _nearest(of: FloatArray, among: FloatArray) -> NDArray[np.intp]:
    after = np.clip(np.searchsorted(among, of), 0, among.size - 1)
    before = np.maximum(after - 1, 0)
    closer = np.abs(among[before] - of) <= np.abs(among[after] - of)
    return np.where(closer, before, after)


def _interval(times: FloatArray) -> FloatArray:
    """The shorter interval beside each spike; endless for a lone one."""
    gaps = np.diff(times)
    before = np.append(np.inf, gaps)
    after = np.append(gaps, np.inf)
    shorter: FloatArray = np.minimum(before, after)
    return shorter
