"""How the user left the lanes: their order, their heights, and which are hidden."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence

from gui.lanes.lane import Lane

LOWEST = 40.0
"""Height below which a drag makes no lane, px."""


class Arrangement:
    """Order, shares of the height and hidden lanes, by key; lanes it never saw last.

    Attributes:
        hidden: keys of lanes that are not shown. The force lane says what that of the
            coil current does.
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Back to what the lanes have by themselves."""
        self.hidden = {"coil_current"}
        self._order: list[str] = []
        self._weights: dict[str, float] = {}

    def ordered(self, lanes: Iterable[Lane]) -> list[Lane]:
        """The lanes from the top."""
        place = {key: number for number, key in enumerate(self._order)}
        return sorted(lanes, key=lambda lane: place.get(lane.key, len(place)))

    def weight(self, lane: Lane) -> float:
        """Its share of the height."""
        return self._weights.get(lane.key, lane.weight)

    def put(self, keys: Sequence[str]) -> None:
        """Have lanes in this order; those that are not on screen keep their place."""
        rest = [key for key in self._order if key not in keys]
        self._order = [*keys, *rest]

    def resize(self, lanes: Sequence[Lane], heights: Sequence[float]) -> None:
        """Share the height of lanes as these heights, px, are."""
        share = sum(self.weight(lane) for lane in lanes) / sum(heights)
        for lane, height in zip(lanes, heights, strict=True):
            self._weights[lane.key] = share * height

    @property
    def text(self) -> str:
        """All of it, as `restore` takes it."""
        return json.dumps([self._order, self._weights, sorted(self.hidden)])

    def restore(self, text: str) -> None:
        """Take up what `text` gave; what is no such text changes nothing."""
        try:
            order, weights, hidden = json.loads(text)
            found = {str(key): float(share) for key, share in weights.items()}
            keys = [str(key) for key in order], {str(key) for key in hidden}
        except (ValueError, TypeError, AttributeError):
            return  # of another version: the lanes are as they are by themselves
        if all(0.01 < share < 100 for share in found.values()):
            (self._order, self.hidden), self._weights = keys, found


def resized(heights: Sequence[float], at: int, by: float) -> list[float]:
    """Heights, px, once one is higher by so many px, at the cost of those below it.

    The next below gives first, then the one below that: at its least it has nothing to
    give. What the lane itself gives, where `by` is negative, goes to the next below.
    """
    found = list(heights)
    if by < 0:
        givers, taker = range(at, at + 1), at + 1
    else:
        givers, taker = range(at + 1, len(found)), at
    wanted = abs(by)
    for giver in givers:
        given = min(wanted, max(found[giver] - LOWEST, 0.0))
        found[giver] -= given
        found[taker] += given
        wanted -= given
    return found
