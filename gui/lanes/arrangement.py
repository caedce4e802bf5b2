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

    def resize(self, upper: Lane, lower: Lane, heights: tuple[float, float]) -> None:
        """Share the height of two neighbours as these heights, px, are."""
        both = self.weight(upper) + self.weight(lower)
        total = sum(heights)
        high = min(max(heights[0], LOWEST), max(total - LOWEST, LOWEST))
        self._weights[upper.key] = both * high / total
        self._weights[lower.key] = both * (1 - high / total)

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
