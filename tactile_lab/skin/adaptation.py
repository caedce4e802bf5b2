"""How far each taxel's rate falls while the load rests on the skin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_lab.analysis.spike_train import SILENT_AFTER
from tactile_lab.arrays import FloatArray
from tactile_lab.quantity import count, show
from tactile_lab.skin.events import Events
from tactile_lab.skin.skin import Skin
from tactile_lab.skin.stimulus import Stimulus

READ = 1 << 22
"""Events read in one go."""
FEWEST_INTERVALS = 2
"""Fewer say nothing of a fall."""


@dataclass(frozen=True, eq=False)
class SkinAdaptation:
    """The fall of each taxel's rate within one hold; each array has shape (taxels,).

    The fall is that of a single run's trial, `analysis.spike_train.Response.fall`: from
    the highest rate within the hold to that of its last two spikes, as a part of the
    former; a rate is 1/ISI of a whole interval.

    Attributes:
        hold: (start, end), s: the load rests there, so that each force is constant.
        intervals: whole intervals of each taxel within it.
        fall: 0.4 for a fall by 40 %; NaN below two intervals and for stuck taxels.
        error: by how much `fall` may err, from the largest error of a spike time.
        silent: which taxels of known fall had stopped before the hold ended: their
            silence passed their last interval twice over.
        rare: which fired, but had fewer than two intervals.
    """

    hold: tuple[float, float]
    intervals: NDArray[np.int64]
    fall: FloatArray
    error: FloatArray
    silent: NDArray[np.bool_]
    rare: NDArray[np.bool_]

    @property
    def known(self) -> NDArray[np.bool_]:
        """Of which taxels the fall is known."""
        return np.isfinite(self.fall)

    @property
    def told(self) -> str:
        """For a person, in a line."""
        begin, end = (show(t, "s") for t in self.hold)
        when = f"from {begin} to {end}, while the load rests"
        fall = 100 * self.fall[self.known]
        if not fall.size:
            text = f"no taxel has two whole intervals {when}"
        else:
            text = f"the rate falls by {np.median(fall):.0f} % "
            if fall.size > 1:
                text += f"(median; {fall.min():.0f} to {fall.max():.0f} %) "
            text += f"in {count(fall.size, 'taxel')} {when}"
            if self.silent.any():
                text += f"; {self.silent.sum():,} fell silent"
        if self.rare.any():
            text += f"; {self.rare.sum():,} fired too rarely to tell"
        return text

    def to_dict(self) -> dict[str, Any]:
        """As ``--json`` prints it: s, and parts."""
        fall = self.fall[self.known]
        some = fall.size > 0
        return {
            "hold_s": list(self.hold),
            "taxels": int(fall.size),
            "fall_median": float(np.median(fall)) if some else None,
            "fall_least": float(fall.min()) if some else None,
            "fall_largest": float(fall.max()) if some else None,
            "fell_silent": int(self.silent.sum()),
            "too_few_spikes": int(self.rare.sum()),
        }


def longest_hold(skin: Skin) -> tuple[float, float] | None:
    """The longest time for which something presses and nothing changes, s.

    The first of several as long; None where the load never rests.
    """
    changing = [np.array([[0.0, 0.0], [skin.duration, skin.duration]])]
    changing += [_changing(one) for one in skin.stimuli]
    changing += [one.times[[0, -1]][None] for one in skin.frames]
    spans = np.clip(np.concatenate(changing), 0.0, skin.duration)
    spans = spans[np.argsort(spans[:, 0], kind="stable")]
    begin = np.maximum.accumulate(spans[:-1, 1])
    length = np.round(spans[1:, 0] - begin, 9)
    middle = begin + length / 2
    pressed = np.zeros(middle.size, np.bool_)
    for one in skin.stimuli:
        number = np.searchsorted(one.corners[:, 0], middle) - 1
        pressed |= (number >= 0) & (middle < one.corners[number, 3])
    for still in skin.frames:
        first, last = still.times[[0, -1]]
        ends = (still.forces[0] > 0).any(), (still.forces[-1] > 0).any()
        pressed |= ((middle < first) & ends[0]) | ((middle > last) & ends[1])
    length[~pressed] = 0.0
    longest = int(length.argmax())
    if length[longest] <= 0.0:
        return None
    return round(float(begin[longest]), 12), round(float(spans[longest + 1, 0]), 12)


def _changing(one: Stimulus) -> FloatArray:
    """From when to when its force changes, shape (n, 2), s."""
    begin, held, lifted, end = one.corners.T
    if one.vibration:
        return np.stack([begin, end], axis=1)
    spans = [np.stack([begin, held], axis=1), np.stack([lifted, end], axis=1)]
    if one.speed:
        moving = np.stack([np.maximum(begin, one.start + one.rests), end], axis=1)
        spans.append(moving[moving[:, 1] > moving[:, 0]])
    return np.concatenate(spans)


def adaptation_of(skin: Skin, events: Events) -> SkinAdaptation | None:
    """The fall of each taxel's rate within the longest hold, with flat memory.

    None where the load never rests: a rate that changes with the load tells nothing of
    adaptation.
    """
    hold = longest_hold(skin)
    if hold is None:
        return None
    size = skin.array.size
    before, last_interval = np.full(size, np.nan), np.full(size, np.nan)
    shortest, intervals = np.full(size, np.inf), np.zeros(size, np.int64)
    for first in range(0, events.time.shape[0], READ):
        time = events.time[first : first + READ]
        inside = (time >= hold[0]) & (time <= hold[1])
        taxel = events.taxel[first : first + READ][inside]
        order = np.argsort(taxel, kind="stable")
        time, taxel = time[inside][order], taxel[order]
        fresh = np.diff(taxel, prepend=-1) != 0
        since = np.where(fresh, before[taxel], np.roll(time, 1))
        whole = np.isfinite(since)
        np.minimum.at(shortest, taxel[whole], (time - since)[whole])
        last_interval[taxel[whole]] = (time - since)[whole]  # the last one counts
        intervals += np.bincount(taxel[whole], minlength=size)
        before[taxel] = time
    told = (intervals >= FEWEST_INTERVALS) & ~skin.array.named(skin.array.stuck)
    kept = np.where(told, shortest / last_interval, np.nan)
    error = 2 * float(events.about["error_s"]) / last_interval * (1 + kept)
    silent = told & (hold[1] - before > SILENT_AFTER * last_interval)
    fired = (events.count > 0) & ~skin.array.named(skin.array.stuck)
    return SkinAdaptation(hold, intervals, 1 - kept, error, silent, fired & ~told)
