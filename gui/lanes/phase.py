"""The plan's oscillation carried on from where the twin's has come.

The twin follows the force that was really applied and drifts away from the plan by some
part of an interval. At "now" the two meet: unshifted, the same spike would come twice,
or one would be missing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.spikes.rate import LEAST_SILENCE, SILENCE, begins


@dataclass(frozen=True, eq=False)
class Phase:
    """A shift of planned times; all of a train move alike, so intervals stay.

    Attributes:
        at: planned times, ascending, s; between them the shift changes evenly.
        by: the shift there, s.
    """

    at: FloatArray
    by: FloatArray

    @classmethod
    def none(cls) -> Phase:
        """No shift."""
        return cls(np.zeros(1), np.zeros(1))

    @property
    def most(self) -> float:
        """Largest shift, s."""
        return float(np.abs(self.by).max())

    def moved(self, planned: FloatArray) -> FloatArray:
        """Planned times where they are expected now, in the same order, s."""
        return planned + np.interp(planned, self.at, self.by)


def phase(planned: FloatArray, last: float) -> Phase:
    """The least shift that has a planned spike, or the train's beginning, at `last`.

    The next spike then comes one planned interval after it. The shift ends in the
    silence after the train, where it is no longer seen. Where the plan is silent at
    `last`, nothing is shifted.

    Args:
        planned: times of the planned spikes, ascending, s.
        last: time of the twin's newest spike, s.
    """
    if planned.size == 0:
        return Phase.none()
    first = begins(planned)
    own = _intervals(planned, first)
    # one interval before its first spike the train could have had another
    places = np.concatenate([planned, planned[first] - own[first]])
    index = np.concatenate([np.arange(planned.size), np.flatnonzero(first)])
    nearest = int(np.argmin(np.abs(places - last)))
    by = last - float(places[nearest])
    to_next = np.append(np.where(first[1:], own[:-1], np.diff(planned)), own[-1])
    beside = to_next if by > 0 and nearest < planned.size else own
    if abs(by) > beside[index[nearest]] / 2:
        return Phase.none()
    # trains that follow closely move along: no spike may overtake another
    pauses = np.append(first[1:], True)
    pauses[:-1] &= np.diff(planned) > 2 * abs(by)
    end = index[nearest] + int(np.argmax(pauses[index[nearest] :]))
    back = planned[end + 1 : end + 2]
    shift = np.concatenate([[by], np.zeros(back.size)])
    return Phase(np.concatenate([planned[end : end + 1], back]), shift)


def _intervals(planned: FloatArray, first: np.ndarray) -> FloatArray:
    """Each spike's interval before it; for the first of a train, the one after, s."""
    before = np.diff(planned, prepend=-np.inf)
    after = np.append(np.where(first[1:], np.inf, np.diff(planned)), np.inf)
    beside = np.minimum(before, np.diff(planned, append=np.inf))
    alone = np.maximum(beside, LEAST_SILENCE) / SILENCE
    begun = np.where(np.isinf(after), alone, np.minimum(after, before / 2))
    own: FloatArray = np.where(first, begun, before)
    return np.where(np.isinf(own), LEAST_SILENCE / SILENCE, own)
