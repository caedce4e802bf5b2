"""A simulated source's own clock: plays a list of currents while nobody talks to it."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass

from sim_backend.serial_line.scpi import ScpiError
from tactile_lab.clock import Clock

MAX_POINTS = 1002


@dataclass(frozen=True, kw_only=True)
class ListFault:
    """What goes wrong with lists, for tests.

    Attributes:
        cut_after: time after which a list goes to 0 A and ends, s.
        trigger_lost: a list that is started does not play.
        dwell_grid: dwells are rounded to multiples of it, s; 0 for none.
        memory: points it holds.
    """

    cut_after: float = math.inf
    trigger_lost: bool = False
    dwell_grid: float = 0.0
    memory: int = MAX_POINTS


class ListPlayer:
    """Plays a list of set-points, each for its dwell; one dwell stands for all.

    Args:
        clock: the bench's time.
        apply: called with each current, A, and when it takes effect, s.
    """

    def __init__(self, clock: Clock, apply: Callable[[float, float], None]) -> None:
        self.points: list[float] = []
        self.dwells: list[float] = []
        self.count = 1
        self.fault = ListFault()
        self.playing = False
        self._clock = clock
        self._apply = apply
        self._round = 0

    def clear(self) -> None:
        """Forget the list."""
        self.points, self.dwells = [], []

    def append(self, current: float) -> None:
        """One more point, A.

        Raises:
            ScpiError: the memory is full (-223).
        """
        self._append(self.points, current)

    def append_dwell(self, seconds: float) -> None:
        """One more dwell, s.

        Raises:
            ScpiError: the memory is full (-223).
        """
        grid = self.fault.dwell_grid
        self._append(self.dwells, round(seconds / grid) * grid if grid else seconds)

    def _append(self, memory: list[float], value: float) -> None:
        if len(memory) >= self.fault.memory:
            raise ScpiError(-223, "Too much data")
        memory.append(value)

    def start(self) -> None:
        """Play from now on.

        Raises:
            ScpiError: the list is empty, or its dwells are not as many as its points
                (-221).
        """
        if not self.points or len(self.dwells) not in (1, len(self.points)):
            raise ScpiError(-221, "Settings conflict")
        self._round += 1
        self.playing = True
        if self.fault.trigger_lost:
            return
        begun = self._clock.now()
        thread = threading.Thread(
            target=self._play, args=(self._round, begun), name="list", daemon=True
        )
        self._clock.start(thread)

    def stop(self) -> bool:
        """End the list; whether one was chosen."""
        was, self.playing = self.playing, False
        self._clock.notify()
        return was

    def _play(self, round_: int, begun: float) -> None:
        points, dwells = tuple(self.points), tuple(self.dwells)
        total = len(points) * self.count if self.count else None
        due, k = begun, 0
        with self._clock.taking_part("list"):
            while (total is None or k < total) and due - begun < self.fault.cut_after:
                if self._clock.wait_for(
                    lambda: not self.playing or self._round != round_, due
                ):
                    return
                self._apply(points[k % len(points)], due)
                due += dwells[k % len(dwells)]
                k += 1
            if k != total and not self._clock.wait_for(
                lambda: not self.playing or self._round != round_, due
            ):
                self._apply(0.0, due)
