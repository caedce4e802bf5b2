"""The visible time, shared by all lanes: follow, zoom, pan, cursors."""

from __future__ import annotations

import time
from collections.abc import Callable

from PySide6.QtCore import QObject, Signal

HEAD = 0.9
"""Where "now" stays while following, as a share of the width."""

Seen = tuple[float, float, Callable[[], object]]
"""Start and width of a view, s, and what shows the rest of it."""

PAUSE, KEPT = 0.6, 50
"""Seconds without a change after which a view is kept for the way back; how many."""

SHORTEST = 1e-5
"""Shortest visible time, s."""


class TimeView(QObject):
    """The window of time on screen, the head of the data, cursors, the chosen spike."""

    changed = Signal()
    cursors_changed = Signal()
    follow_changed = Signal(bool)

    def __init__(self) -> None:
        super().__init__()
        self.start = 0.0
        self.width = 5.0
        self.now = 0.0
        self.length = 5.0
        self.follow = True
        self.cursors: tuple[float, float] | None = None
        self.spike: float | None = None
        self.beside: Callable[[], Callable[[], object]] = lambda: lambda: None
        """Notes what else is seen, such as ranges of values; its answer shows that."""
        self._before: list[Seen] = []
        self._after: list[Seen] = []
        self._noted = -PAUSE
        self.clock = time.monotonic

    @property
    def end(self) -> float:
        """End of the visible time, s."""
        return self.start + self.width

    def set_now(self, now: float, length: float) -> None:
        """The data reaches to `now`; the run is or will be `length` long, s."""
        self.now, self.length = now, max(length, now, 1e-3)
        if self.follow:
            self.start = max(0.0, now - HEAD * self.width)

    def set_follow(self, follow: bool) -> None:
        """Keep the head in view, or stay where the user looks."""
        if follow is not self.follow:
            self.follow = follow
            self.follow_changed.emit(follow)
        if follow:
            self.start = max(0.0, self.now - HEAD * self.width)
        self.changed.emit()

    def show_span(self, start: float, width: float) -> None:
        """Show a window; following ends."""
        self.note()
        longest = max(self.length, self.now) * 1.25 + 1.0
        self.width = min(max(width, SHORTEST), longest)
        self.start = min(max(start, -0.2 * self.width), longest)
        if self.follow:
            self.follow = False
            self.follow_changed.emit(False)
        self.changed.emit()

    def note(self) -> None:
        """Keep what is seen for the way back; one drag or turn of the wheel is one."""
        now = self.clock()
        if now - self._noted > PAUSE:
            self._before = [*self._before[-KEPT:], self._seen]
            self._after = []
        self._noted = now

    def show_step(self, start: float, length: float) -> None:
        """Show a stretch with a little of what is on either side."""
        self.show_span(start - 0.05 * length, 1.1 * length)

    def back(self) -> None:
        """Show what was seen before the last change."""
        self._return(self._before, self._after)

    def forward(self) -> None:
        """Undo going back."""
        self._return(self._after, self._before)

    @property
    def _seen(self) -> Seen:
        return self.start, self.width, self.beside()

    def _return(self, here: list[Seen], there: list[Seen]) -> None:
        if here:
            there.append(self._seen)
            kept = self._before, self._after
            start, width, show_beside = here.pop()
            show_beside()
            self.show_span(start, width)
            self._before, self._after = kept
            self._noted = -PAUSE

    def set_width(self, width: float) -> None:
        """Show `width` s, keeping the head (following) or the middle in place."""
        if self.follow:
            self.width = max(width, SHORTEST)
            self.start = max(0.0, self.now - HEAD * self.width)
            self.changed.emit()
        else:
            self.show_span(self.start + (self.width - width) / 2, width)

    def zoom(self, factor: float, about: float | None = None) -> None:
        """Zoom by `factor` (above 1: in) about a time; following keeps the head."""
        width = self.width / factor
        if self.follow:
            self.set_width(min(width, self.length * 1.2 + 1.0))
            return
        centre = self.start + self.width / 2 if about is None else about
        share = (centre - self.start) / self.width
        self.show_span(centre - share * width, width)

    def pan(self, by: float) -> None:
        """Move the window by `by` s."""
        self.show_span(self.start + by, self.width)

    def show_all(self) -> None:
        """Show the whole run."""
        self.show_span(0.0, max(self.length, self.now))

    def place_cursors(self, a: float, b: float) -> None:
        """Put the cursors at two times, s."""
        self.cursors = (a, b)
        self.cursors_changed.emit()
        self.changed.emit()

    def put_cursor(self, which: int, at: float) -> None:
        """Put cursor A (0) or B (1) at a time, s; the other, if new, near the edge."""
        if self.cursors is None:
            far = self.start + (0.9 if which == 0 else 0.1) * self.width
            self.cursors = (at, far) if which == 0 else (far, at)
        self.move_cursor(which, at)

    def show_spike(self, at: float) -> None:
        """Choose the spike at a time, s, and have it in view."""
        self.spike = at
        if self.start + 0.05 * self.width <= at <= self.end - 0.05 * self.width:
            self.changed.emit()
        else:
            self.show_span(at - self.width / 2, self.width)

    def clear_cursors(self) -> None:
        """Take the cursors away."""
        self.cursors = None
        self.cursors_changed.emit()
        self.changed.emit()

    def move_cursor(self, which: int, to: float) -> None:
        """Move cursor A (0) or B (1) to a time, s."""
        if self.cursors is not None:
            a, b = self.cursors
            self.place_cursors(*((to, b) if which == 0 else (a, to)))
