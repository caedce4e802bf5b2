"""CPU time: what a solver costs on a machine that has other things to do as well."""

from __future__ import annotations

import os
import time as wall


def spent() -> float:
    """CPU time of this process and of finished children so far, s."""
    children = os.times()
    return wall.process_time() + children.children_user + children.children_system


class Deadline:
    """After `cap` s of CPU time; cheap to ask while there is wall time left."""

    def __init__(self, cap: float) -> None:
        self._end = spent() + cap
        self._ask_again = wall.perf_counter() + cap

    def passed(self) -> bool:
        """Whether the time is used up."""
        if wall.perf_counter() < self._ask_again:
            return False
        left = self._end - spent()
        self._ask_again += max(left, 0.0)
        return left <= 0.0
