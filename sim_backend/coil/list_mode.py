"""A simulated source's own clock: plays a list of currents while nobody talks to it."""

from __future__ import annotations

import threading
from collections.abc import Callable

from sim_backend.serial_line.scpi import ScpiError
from tactile_lab.clock import Clock

MAX_POINTS = 1002


class ListPlayer:
    """Plays a list of set-points, each for the same time.

    Args:
        clock: the bench's time.
        apply: called with each current, A.
    """

    def __init__(self, clock: Clock, apply: Callable[[float], None]) -> None:
        self.points: list[float] = []
        self.dwell = 0.01
        self.count = 1
        self.playing = False
        self._clock = clock
        self._apply = apply
        self._round = 0

    def clear(self) -> None:
        """Forget the list."""
        self.points = []

    def append(self, current: float) -> None:
        """One more point, A.

        Raises:
            ScpiError: the memory is full (-223).
        """
        if len(self.points) >= MAX_POINTS:
            raise ScpiError(-223, "Too much data")
        self.points.append(current)

    def start(self) -> None:
        """Play from now on.

        Raises:
            ScpiError: the list is empty (-221).
        """
        if not self.points:
            raise ScpiError(-221, "Settings conflict")
        self._round += 1
        self.playing = True
        begun = self._clock.now()
        thread = threading.Thread(
            target=self._play, args=(self._round, begun), name="list", daemon=True
        )
        thread.start()

    def stop(self) -> bool:
        """End the list; whether one was chosen."""
        was, self.playing = self.playing, False
        self._clock.notify()
        return was

    def _play(self, round_: int, begun: float) -> None:
        points, dwell = tuple(self.points), self.dwell
        total = len(points) * self.count if self.count else None
        with self._clock.taking_part("list"):
            k = 0
            while total is None or k < total:
                if self._clock.wait_for(
                    lambda: not self.playing or self._round != round_,
                    begun + k * dwell,
                ):
                    return
                self._apply(points[k % len(points)])
                k += 1
